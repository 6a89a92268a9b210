// The Python of docs/volume-format.md opens what daylit-precompute writes and combines it as daylit does.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "scene/volume/volume_file.h"
#include "tests/scene/volume_kinds.h"

namespace daylit {
namespace {

const std::filesystem::path kRoom = DAYLIT_SOURCE_DIR "/tests/fixtures/truth/s1_daylit_cornell.obj";

/// Code blocks of a page, one after another.
std::vector<std::string> python_blocks(const std::filesystem::path& page) {
  std::ifstream in(page);
  std::vector<std::string> blocks;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line == "```python")
      blocks.emplace_back();
    else if (inside && line != "```")
      blocks.back() += line + "\n";
    inside = line == "```python" || (inside && line != "```");
  }
  return blocks;
}

/// The largest coefficient; that of a sum of floats is off by a few of its last bits.
double largest_of(const LightField& field) {
  double most = 0;
  for (const Sh9Rgb& sh : field.probe)
    for (const Rgb& c : sh)
      most = std::max({most, double(std::abs(c.r)), double(std::abs(c.g)), double(std::abs(c.b))});
  return most;
}

class PythonReader : public testing::Test {
protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("daylit_python_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// What the program writes, read back.
  BasisVolume bake(const std::filesystem::path& room, const std::string& name, const std::string& options) {
    const std::filesystem::path path = folder_ / name;
    const std::string command = DAYLIT_BINARY_DIR "/bin/daylit-precompute '" + room.string() + "' -o '" +
                                path.string() + "' --quiet " + options;
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    Result<BasisVolume> volume = read_volume(path);
    EXPECT_TRUE(volume) << volume.error().message();
    return std::move(*volume);
  }
  /// Two metres each way, a tinted pane in one wall: the light on the surfaces has a row per colour.
  std::filesystem::path tinted_room() {
    std::ofstream(folder_ / "box.mtl") << "newmtl wall\nKd 0.7 0.6 0.5\nnewmtl window\nTf 0.9 0.8 0.6\n";
    std::ofstream(folder_ / "box.obj")
        << "mtllib box.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n"
           "v 0.5 0 0.8\nv 1.5 0 0.8\nv 1.5 0 1.7\nv 0.5 0 1.7\nusemtl wall\nf 1 2 3 4\nf 8 7 6 5\nf 2 6 7 3\n"
           "f 3 7 8 4\nf 4 8 5 1\nf 2 1 9 10\nf 6 2 10 11\nf 5 6 11 12\nf 1 5 12 9\nusemtl window\nf 12 11 10 9\n";
    return folder_ / "box.obj";
  }
  /// Writes radiances and returns what daylit makes of them.
  LightField radiances(const BasisVolume& volume, const std::string& name) {
    radiance_.clear();
    std::ofstream out(folder_ / name);
    for (int r = 0; r < volume.partition.size(); ++r) {
      radiance_.emplace_back(1.0f + 0.01f * static_cast<float>(r % 17), 0.5f, 0.25f * static_cast<float>(r % 3));
      out << radiance_.back().r << " " << radiance_.back().g << " " << radiance_.back().b << "\n";
    }
    return combine(volume, radiance_);
  }
  void expect_same(const LightField& field, const std::string& name) {
    std::ifstream in(folder_ / name);
    const double tolerance = 2e-6 * largest_of(field);
    ASSERT_GT(tolerance, 0.0) << name;
    for (const Sh9Rgb& sh : field.probe)
      for (const Rgb& c : sh)
        for (int k = 0; k < 3; ++k) {
          double value = 1e9;
          in >> value;
          ASSERT_NEAR(value, static_cast<double>(c[k]), tolerance) << name;
        }
  }
  std::filesystem::path folder_;
  std::vector<Rgb> radiance_; ///< of the last call of radiances()
};

TEST_F(PythonReader, the_lines_of_the_page_combine_as_daylit_does) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2> /dev/null") != 0)
    GTEST_SKIP() << "needs python3 with numpy";
  const std::vector<std::string> code = python_blocks(DAYLIT_SOURCE_DIR "/docs/volume-format.md");
  ASSERT_EQ(code.size(), 2u);
  EXPECT_LE(std::ranges::count(code[0], '\n'), 28) << "the whole reader fits in 28 lines of the page";
  const std::string given = "--grid 4,5,3 --patches 200 --regions ";
  const BasisVolume regions = bake(kRoom, "room.volume", given + "uniform:64"),
                    nodes = bake(kRoom, "fine.volume", given + "fine:256"),
                    defaults = bake(tinted_room(), "default.volume", "--grid 4,4,4 --patches 300");
  ASSERT_TRUE(nodes.compact && defaults.compact);
  ASSERT_EQ(defaults.compact->light.colours, 3u);
  ASSERT_TRUE(write_volume(folder_ / "half.volume", regions, BasisPrecision::float16));
  const LightField by_region = radiances(regions, "radiance.txt"),
                   by_half = combine(*read_volume(folder_ / "half.volume"), radiance_),
                   by_node = radiances(nodes, "fine.txt"), by_default = radiances(defaults, "default.txt");
  const BasisVolume tinted = test::with_band4(test::compact_volume(3)), rows = test::with_band4(test::plain_volume());
  ASSERT_TRUE(write_volume(folder_ / "band4.volume", tinted));
  ASSERT_TRUE(write_volume(folder_ / "rows4.volume", rows, BasisPrecision::float16));
  radiances(tinted, "band4.txt");
  const LightField band4{combine(tinted, radiance_, ShOrder::fourth).band4};
  radiances(rows, "rows4.txt");
  const LightField rows4{combine(*read_volume(folder_ / "rows4.volume"), radiance_, ShOrder::fourth).band4};
  std::ofstream(folder_ / "read.py") << code[0] << code[1] << R"(
def check(name, sky, combine, *part):
    meta, v = read_volume(name + ".volume")
    field = fill_interpolated(v, combine(v, np.loadtxt(sky + ".txt"), *part))
    np.savetxt(name + ".out", field.reshape(-1))
check("room", "radiance", combine_regions)
check("half", "radiance", combine_regions)
check("fine", "fine", combine_compact)
check("default", "default", combine_compact)
check("band4", "band4", combine_compact, "compact.band4.")
check("rows4", "rows4", combine_regions, "basis.band4")
)";
  ASSERT_EQ(std::system(("cd '" + folder_.string() + "' && /usr/bin/python3 read.py").c_str()), 0);
  expect_same(by_region, "room.out");
  expect_same(by_half, "half.out");
  expect_same(by_node, "fine.out");
  expect_same(by_default, "default.out");
  expect_same(band4, "band4.out");
  expect_same(rows4, "rows4.out");
}

} // namespace
} // namespace daylit
