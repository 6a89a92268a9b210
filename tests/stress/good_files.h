#pragma once

// A folder of good files, and the real programs run in copies of it.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "scene/image/image_formats.h"

namespace daylit::test {

namespace fs = std::filesystem;

/// Seconds after which a program hangs; sanitizers make programs ten times slower.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline const std::string kLimit_s = "600";
#else
inline const std::string kLimit_s = "60";
#endif

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

inline std::string slurp(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline void spill(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

inline bool has_program(const std::string& name) { return fs::exists(fs::path(DAYLIT_PROGRAM_FOLDER) / name); }

/// Runs "daylit-probe arguments" in `folder`; a crash or a hang is no exit code of ours.
inline Outcome run_in(const fs::path& folder, const std::string& command) {
  const std::string line = "cd " + folder.string() + " && timeout " + kLimit_s + " " DAYLIT_PROGRAM_FOLDER "/" +
                           command + " > ../stdout.txt 2> ../stderr.txt";
  const int status = std::system(line.c_str());
  Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), slurp(folder / "../stdout.txt"),
                  slurp(folder / "../stderr.txt")};
  return outcome;
}

/// A box of 2 x 2 x 2 m with a window in the wall y = 0.
inline const std::string kRoom = "mtllib room.mtl\n"
                                 "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n"
                                 "usemtl wall\nf 1 2 3 4\nf 5 8 7 6\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"
                                 "usemtl window\nf 1 5 6 2\n";
inline const std::string kMaterials = "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl window\nKd 0 0 0\n";

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// One good set of files, made once for a suite; each case works on a copy.
class GoodFiles : public testing::Test {
protected:
  static void SetUpTestSuite() {
    std::string pattern = (fs::temp_directory_path() / "daylit-bad-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
    const fs::path good = root_ / "good";
    fs::create_directory(good);
    spill(good / "room.obj", kRoom);
    spill(good / "room.mtl", kMaterials);
    ASSERT_TRUE(write_exr(good / "sky.exr", RgbImage(32, 16, Rgb(1.0f))));
    ASSERT_TRUE(write_exr(good / "photo.exr", RgbImage(64, 48, Rgb(0.3f))));
    spill(good / "sky.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + std::string(32, '\x80'));
    spill(good / "lens.yaml", "image_width: 64\nimage_height: 48\ncamera_matrix: [60, 0, 31.5, 0, 60, 23.5, 0, 0, 1]\n"
                              "distortion_model: plumb_bob\n");
    spill(good / "points.txt", "1 1 1 0 0 1\n");
    spill(good / "config.toml",
          "[sky]\nimage = \"sky.exr\"\n[interior]\nimage = \"photo.exr\"\nlens = \"lens.yaml\"\n"
          "[pose]\nposition = [1.0, 1.8, 1.0]\nlook_at = [1.0, 0.5, 0.2]\n"
          "[room]\nmodel = \"room.obj\"\nvolume = \"room.volume\"\n[[object]]\nmodel = \"cube.obj\"\n"
          "position = [1.0, 0.8, 0.0]\n[output]\npng = \"out.png\"\nexr = \"out.exr\"\n");
    spill(good / "cube.obj", "v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    const Outcome baked = run_in(good, "daylit-precompute room.obj -o room.volume --regions uniform:2 --grid 2,2,2 "
                                       "--patch-size 1 --quality draft --quiet");
    ASSERT_EQ(baked.exit_code, 0) << baked.err;
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  /// A copy of its own.
  static fs::path copy_for(const std::string& name) {
    fs::copy(root_ / "good", root_ / name, fs::copy_options::recursive);
    return root_ / name;
  }
  static inline fs::path root_;
};

inline void edit(const fs::path& path, const std::string& from, const std::string& to) {
  const std::string text = slurp(path);
  ASSERT_NE(text.find(from), std::string::npos) << path << " has no " << from;
  spill(path, replaced(text, from, to));
}

} // namespace daylit::test
