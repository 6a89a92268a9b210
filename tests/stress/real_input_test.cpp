// The stranger's road with real files: a photograph of printed markers with its camera file, a daylight map, a box
// room with one window around them (docs/my-room.md). No truth exists for this picture; what must hold is asserted.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "scene/image/image_formats.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;

/// 4 x 5 x 2.6 m, window in the wall x = 0, a table top around (2.4, 2.5, 0.75).
const char* const kRoom =
    "mtllib room.mtl\nv 0 0 0\nv 4 0 0\nv 4 5 0\nv 0 5 0\nv 0 0 2.6\nv 4 0 2.6\nv 4 5 2.6\nv 0 5 2.6\n"
    "v 0 1.3 0.9\nv 0 3.7 0.9\nv 0 3.7 2.3\nv 0 1.3 2.3\nusemtl floor\nf 1 2 3 4\nusemtl white\nf 5 8 7 6\nf 2 6 7 3\n"
    "f 3 7 8 4\nf 1 5 6 2\nf 1 4 10 9\nf 4 8 11 10\nf 8 5 12 11\nf 5 1 9 12\nusemtl window\nf 9 10 11 12\n"
    "usemtl table\nv 1.6 1.7 0.7\nv 3.2 1.7 0.7\nv 3.2 3.3 0.7\nv 1.6 3.3 0.7\nv 1.6 1.7 0.75\nv 3.2 1.7 0.75\n"
    "v 3.2 3.3 0.75\nv 1.6 3.3 0.75\nf 13 16 15 14\nf 17 18 19 20\nf 13 14 18 17\nf 14 15 19 18\nf 15 16 20 19\n"
    "f 16 13 17 20\n";
const char* const kMaterials = "newmtl floor\nKd 0.30 0.22 0.15\nnewmtl white\nKd 0.80 0.80 0.78\nnewmtl window\n"
                               "Kd 0 0 0\nTf 0.8 0.8 0.8\nnewmtl table\nKd 0.55 0.54 0.52\n";

std::string config_text(const fs::path& data) {
  return "[sky]\nimage = \"" + (data / "hdri/dry_hay_field_1k.hdr").string() + "\"\n[interior]\nimage = \"" +
         (data / "markers/singlemarkersoriginal.jpg").string() + "\"\nlens = \"" +
         (data / "markers/tutorial_camera_params.yml").string() +
         "\"\nresponse = \"srgb\"\nscale = \"marker\"\n[marker]\nids = [40]\nsize_m = 0.05\n"
         "world_from_board = [1, 0, 0, 2.4, 0, 1, 0, 2.5, 0, 0, 1, 0.75, 0, 0, 0, 1]\n"
         "[room]\nmodel = \"room.obj\"\nvolume = \"room.volume\"\n[[object]]\nmodel = \"" +
         (data / "objects/teapot.obj").string() +
         "\"\nposition = [2.4, 2.5, 0.75]\nrotation = [90, 0, 30]\nscale = 0.025\nreflectance = [0.6, 0.6, 0.6]\n"
         "[output]\npng = \"out.png\"\n";
}

int run_in(const fs::path& folder, const std::string& command) {
  const int status = std::system(
      ("cd " + folder.string() + " && " DAYLIT_PROGRAM_FOLDER "/" + command + " > stdout.txt 2>> stderr.txt").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 255;
}

/// Mean over a rectangle of after / before, of code values.
double mean_ratio(const Rgb8Image& before, const Rgb8Image& after, int x0, int y0, int x1, int y1) {
  double a = 0, b = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
      for (int c = 0; c < 3; ++c) {
        const std::size_t i = 3 * static_cast<std::size_t>(y * before.width + x) + static_cast<std::size_t>(c);
        b += before.bytes[i], a += after.bytes[i];
      }
  return a / b;
}

/// Pixels of a rectangle that are not the same.
std::size_t changed_pixels(const Rgb8Image& before, const Rgb8Image& after, int x0, int y0, int x1, int y1) {
  std::size_t count = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const std::size_t i = 3 * static_cast<std::size_t>(y * before.width + x);
      count += std::equal(&before.bytes[i], &before.bytes[i] + 3, &after.bytes[i]) ? 0 : 1;
    }
  return count;
}

/// The room, baked, and the photograph.
class RealInput : public testing::Test {
protected:
  static void SetUpTestSuite() {
    data = fs::path(DAYLIT_SOURCE_DIR) / "../shared/data";
    if (!fs::exists(data / "markers") || !fs::exists(data / "hdri") ||
        !fs::exists(fs::path(DAYLIT_PROGRAM_FOLDER) / "daylit-run"))
      return;
    std::string pattern = (fs::temp_directory_path() / "daylit-real-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder = pattern;
    std::ofstream(folder / "room.obj") << kRoom;
    std::ofstream(folder / "room.mtl") << kMaterials;
    ASSERT_EQ(run_in(folder, "daylit-precompute room.obj -o room.volume --quality draft --quiet"), 0);
  }
  static void TearDownTestSuite() {
    if (!folder.empty())
      fs::remove_all(folder);
  }
  void SetUp() override {
    if (folder.empty())
      GTEST_SKIP() << "the shared photograph and sky are not here, or this build has no daylit-run";
  }
  /// The photograph, and with the teapot on it.
  static std::pair<Rgb8Image, Rgb8Image> pictures(const std::string& more_config) {
    std::ofstream(folder / "config.toml") << config_text(fs::canonical(data)) + more_config;
    EXPECT_EQ(run_in(folder, "daylit-run config.toml"), 0) << std::ifstream(folder / "stderr.txt").rdbuf();
    auto before = read_ldr_image(data / "markers/singlemarkersoriginal.jpg");
    auto after = read_ldr_image(folder / "out.png");
    EXPECT_TRUE(before && after && after->bytes.size() == before->bytes.size());
    return {std::move(*before), std::move(*after)};
  }
  static inline fs::path data, folder;
};

// Marker 40 is seen at (384, 330), 9 pixels to the centimetre, its right edge towards +x: the window (-x) is on the
// left, the shadow on the right. Above y = 150 and left of x = 150 the teapot's effect is below 0.5 %.

TEST_F(RealInput, teapot_on_the_marker_is_lit_from_the_window_and_the_rest_keeps_its_bits) {
  const auto [before, after] = pictures("");
  const std::size_t changed = changed_pixels(before, after, 0, 0, 640, 480);
  EXPECT_GT(changed, 5000u);
  EXPECT_LT(changed, 100000u);
  EXPECT_EQ(changed_pixels(before, after, 0, 0, 640, 150), 0u);
  EXPECT_EQ(changed_pixels(before, after, 0, 0, 150, 480), 0u);
  EXPECT_LT(mean_ratio(before, after, 445, 310, 475, 340), 0.97); // in the shadow
  // The pot's side towards the window is brighter than the one away from it, and neither is black or blown out.
  const Rgb8Image grey{640, 480, std::vector<std::uint8_t>(before.bytes.size(), 255)};
  const double lit = mean_ratio(grey, after, 352, 315, 364, 335), shaded = mean_ratio(grey, after, 420, 315, 430, 335);
  EXPECT_GT(lit, 1.1 * shaded);
  EXPECT_GT(shaded, 0.1);
  EXPECT_LT(lit, 1.0);
}

TEST_F(RealInput, the_lit_side_of_the_teapot_brightens_the_table_as_path_tracing_says) {
  // Irradiance at the table with over without the teapot, by `daylit-simulate irradiance --total` on the room with the
  // teapot's triangles in it, 2^20 paths: 1.0367, 1.0270, 1.0208, 1.0125 at 10, 11, 12, 14 cm towards the window, each
  // +- 0.0005. The pixels here lie 9 to 12.5 cm away; code values change by the power 1 / 2.2 of that.
  const auto [before, after] = pictures("");
  const double expected = std::pow(1.030, 1.0 / 2.2);
  EXPECT_NEAR(mean_ratio(before, after, 270, 310, 300, 340), expected, 0.005);
}

TEST_F(RealInput, without_the_effect_on_the_room_only_object_and_shadow_change) {
  const auto [before, after] = pictures("[light]\nindirect_shadow = false\n");
  EXPECT_GT(changed_pixels(before, after, 0, 0, 640, 480), 5000u);
  EXPECT_EQ(changed_pixels(before, after, 0, 0, 640, 150), 0u);
  EXPECT_EQ(changed_pixels(before, after, 0, 0, 300, 480), 0u);
}

} // namespace
} // namespace daylit
