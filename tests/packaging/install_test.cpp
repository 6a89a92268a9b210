// An installation as others use it: a program built against it, and the Debian packages.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <vector>

#include <gtest/gtest.h>

#include "tests/packaging/shell.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;

const std::string kBuild = DAYLIT_BINARY_DIR, kCmake = DAYLIT_CMAKE;

class Installed : public testing::Test {
protected:
  static void SetUpTestSuite() {
    std::string pattern = (fs::temp_directory_path() / "daylit-install-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  /// Expects success.
  static std::string run(const std::string& command) {
    const ShellOutcome outcome = shell("cd " + folder_.string() + " && " + command);
    EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.text;
    return outcome.text;
  }
  static fs::path folder_;
};
fs::path Installed::folder_;

/// Debian packages of the CMake files that the example's build found (its cache names their folders).
std::set<std::string> packages_found(const fs::path& cache) {
  std::ifstream file(cache);
  std::set<std::string> packages;
  const std::regex entry(R"(([A-Za-z0-9_-]+)_DIR:PATH=(/usr/(lib|share)/\S*))");
  std::smatch match;
  for (std::string line; std::getline(file, line);)
    if (std::regex_match(line, match, entry))
      packages.merge(words_of(shell("dpkg -S " + match[2].str() + "/*onfig.cmake | sed 's/:.*//'").text));
  return packages;
}

TEST_F(Installed, programs_built_against_it_compute_what_ours_do) {
  const std::string prefix = (folder_ / "there").string(), bin = prefix + "/bin/";
  run(kCmake + " --install " + kBuild + " --prefix " + prefix);
  run(kCmake + " -S " + prefix + "/share/doc/libdaylit-dev/example -B example -DCMAKE_PREFIX_PATH=" + prefix);
  run(kCmake + " --build example");
  // Who installs libdaylit-dev can do the same.
  const std::string depends = shell("grep CPACK_DEBIAN_DEV_PACKAGE_DEPENDS " + kBuild + "/CPackConfig.cmake").text;
  const std::set<std::string> found = packages_found(folder_ / "example/CMakeCache.txt");
  EXPECT_GE(found.size(), 8u);
  for (const std::string& package : found)
    EXPECT_NE(depends.find(package), std::string::npos) << package << " is not among: " << depends;

  run(bin + "daylit-simulate --demo overcast -o demo --size 64,62 --spp 16 --quiet");
  run(bin + "daylit-precompute demo/room.obj -o demo/room.volume --quality draft --quiet");
  std::ofstream(folder_ / "sky.toml") << "[sky]\nmodel = \"uniform\"\nzenith_radiance = 100\n";
  const std::string ours = run("echo 1.5 1.5 0.5 0 0 1 | " + bin + "daylit-probe demo/room.volume --sky sky.toml"),
                    theirs = run("example/room_light demo/room.volume sky.toml 1.5 1.5 0.5");
  EXPECT_GT(std::atof(ours.c_str()), 0.0) << ours;
  EXPECT_NEAR(std::atof(theirs.c_str()), std::atof(ours.c_str()), 1e-4 * std::atof(ours.c_str()));
  run(bin + "daylit-run demo/CONFIG.toml --quiet");
  run("example/draw demo/CONFIG.toml drawn.exr");
  run("cmp drawn.exr demo/result.exr");
}

/// The text of a control field.
std::string field(const std::string& deb, const std::string& name) {
  return shell("dpkg-deb -f " + deb + " " + name).text;
}

TEST_F(Installed, packages_hold_their_programs_and_depend_on_what_these_need) {
  const fs::path debs = folder_ / "debs";
  run(std::string(DAYLIT_CPACK) + " --config " + kBuild + "/CPackConfig.cmake -G DEB -B " + debs.string());
  const auto deb = [&](const std::string& name) {
    return run("ls " + (debs / (name + "_*.deb")).string() + " | tr -d '\n'");
  };
  const std::map<std::string, std::vector<std::string>> files{
      {"daylit-bake",
       {"bin/daylit-precompute", "bin/daylit-probe", "bin/daylit-simulate", "share/man/man1/daylit-probe.1.gz",
        "share/bash-completion/completions/daylit-precompute"}},
      {"daylit-run",
       {"bin/daylit-run", "lib/systemd/system/daylit-run.service", "share/man/man1/daylit-run.1.gz",
        "share/bash-completion/completions/daylit-run"}},
      {"daylit-calibrate", {"bin/daylit-calibrate", "share/man/man1/daylit-calibrate.1.gz"}},
      {"daylit-bench", {"bin/daylit-bench"}},
      {"libdaylit-dev",
       {"lib/cmake/daylit/daylitConfig.cmake", "lib/libdaylit_runtime.a", "include/daylit/scene/volume/volume.h",
        "include/daylit/runtime/session/session.h", "include/daylit/sh/basis.h"}}};
  std::set<std::string> programs;
  for (const auto& [package, expected] : files) {
    const std::set<std::string> held = words_of(run("dpkg-deb -c " + deb(package) + " | sed 's/.* //'"));
    for (const std::string& file : expected)
      EXPECT_TRUE(held.contains("./usr/" + file)) << package << " lacks " << file;
    EXPECT_TRUE(held.contains("./usr/share/doc/" + package + "/copyright")) << package;
    for (const std::string& file : held)
      if (file.starts_with("./usr/bin/daylit")) {
        EXPECT_TRUE(programs.insert(file).second) << file << " is in two packages";
      }
  }
  EXPECT_EQ(programs.size(), 6u);
  // A baking server has no cameras and no graphics; a machine with a camera never bakes.
  const std::string bake = field(deb("daylit-bake"), "Depends"), live = field(deb("daylit-run"), "Depends");
  for (const char* package : {"opencv", "aravis", "libegl", "glfw"})
    EXPECT_EQ(bake.find(package), std::string::npos) << bake;
  for (const char* package : {"libaravis-0.8-0", "libopencv-core", "libembree", "libc6"})
    EXPECT_NE(live.find(package), std::string::npos) << live;
  EXPECT_EQ(live.find("libgmp"), std::string::npos) << live;
}

} // namespace
} // namespace daylit
