// What control groups allow: files as the kernel shows them.

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "scene/core/memory.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;

class Groups : public testing::Test {
protected:
  fs::path folder = fs::path(testing::TempDir()) / ("groups" + std::to_string(getpid()));
  void TearDown() override { fs::remove_all(folder); }
  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories((folder / file).parent_path());
    std::ofstream(folder / file) << text;
  }
  double bytes() const { return control_group_bytes(folder / "own", folder / "mounted"); }
};

TEST_F(Groups, of_version_2_the_least_of_a_group_and_those_around_it_counts) {
  write("own", "0::/system/bake.service\n");
  EXPECT_TRUE(std::isinf(bytes())) << "no such group here";
  write("mounted/system/bake.service/memory.max", "max\n");
  EXPECT_TRUE(std::isinf(bytes()));
  write("mounted/system/memory.max", "4000000000\n");
  EXPECT_EQ(bytes(), 4e9);
  write("mounted/system/bake.service/memory.max", "1000000000\n");
  EXPECT_EQ(bytes(), 1e9);
}

TEST_F(Groups, of_version_1_the_memory_controller_counts_and_its_largest_number_is_no_limit) {
  write("own", "5:cpu,cpuacct:/a\n4:memory:/a/b\nnot a line\n");
  write("mounted/memory/a/b/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_TRUE(std::isinf(bytes()));
  write("mounted/memory/memory.limit_in_bytes", "2000000000\n");
  EXPECT_EQ(bytes(), 2e9) << "the group itself may not be mounted in a container";
}

TEST(Memory, the_machine_has_some_and_the_address_space_no_limit) {
  EXPECT_GT(machine_memory_bytes(), 1e8);
  EXPECT_GT(address_space_left_bytes(), machine_memory_bytes());
}

} // namespace
} // namespace daylit
