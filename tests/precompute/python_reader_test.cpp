// The Python of docs/volume-format.md opens what daylit-precompute writes and combines it as daylit does.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "scene/volume_file.h"

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

class PythonReader : public testing::Test {
protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("daylit_python_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  BasisVolume bake(const std::string& name, const std::string& regions) {
    const std::filesystem::path path = folder_ / name;
    const std::string command = DAYLIT_BINARY_DIR "/bin/daylit-precompute '" + kRoom.string() + "' -o '" +
                                path.string() + "' --quiet --grid 4,5,3 --patches 200 --regions " + regions;
    EXPECT_EQ(std::system(command.c_str()), 0);
    return *read_volume(path);
  }
  /// Writes radiances and returns what daylit makes of them.
  LightField radiances(const BasisVolume& volume, const std::string& name) {
    std::vector<Rgb> radiance;
    std::ofstream out(folder_ / name);
    for (int r = 0; r < volume.partition.size(); ++r) {
      radiance.emplace_back(1.0f + 0.01f * static_cast<float>(r % 17), 0.5f, 0.25f * static_cast<float>(r % 3));
      out << radiance.back().r << " " << radiance.back().g << " " << radiance.back().b << "\n";
    }
    return combine(volume, radiance);
  }
  void expect_same(const LightField& field, const std::string& name) {
    std::ifstream in(folder_ / name);
    for (const Sh9Rgb& sh : field.probe)
      for (const Rgb& c : sh)
        for (int k = 0; k < 3; ++k) {
          double value = 1e9;
          in >> value;
          ASSERT_NEAR(value, static_cast<double>(c[k]), 2e-5) << name;
        }
  }
  std::filesystem::path folder_;
};

TEST_F(PythonReader, the_lines_of_the_page_combine_as_daylit_does) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2> /dev/null") != 0)
    GTEST_SKIP() << "needs python3 with numpy";
  const std::vector<std::string> code = python_blocks(DAYLIT_SOURCE_DIR "/docs/volume-format.md");
  ASSERT_EQ(code.size(), 2u);
  const LightField regions = radiances(bake("room.volume", "uniform:64"), "radiance.txt"),
                   nodes = radiances(bake("fine.volume", "fine:256"), "fine.txt");
  std::ofstream(folder_ / "read.py")
      << "import numpy as np\nradiance = np.loadtxt('radiance.txt')\n"
      << code[0] << "np.savetxt('field.out', field.reshape(-1))\n"
      << code[1] << "meta, v = read_volume('fine.volume')\n"
      << "np.savetxt('fine.out', combine_compact(v, np.loadtxt('fine.txt')).reshape(-1))\n";
  ASSERT_EQ(std::system(("cd '" + folder_.string() + "' && /usr/bin/python3 read.py").c_str()), 0);
  expect_same(regions, "field.out");
  expect_same(nodes, "fine.out");
}

} // namespace
} // namespace daylit
