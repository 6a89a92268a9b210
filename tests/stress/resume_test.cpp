// kill -9 at random moments: the bake goes on from its checkpoint to the same bits.

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

namespace daylit {
namespace {

namespace fs = std::filesystem;
const std::string kBake = DAYLIT_PROGRAM_FOLDER "/daylit-precompute '" DAYLIT_SOURCE_DIR
                                                "/tests/fixtures/truth/s1_daylit_cornell.obj' --grid 4,4,4 --quiet";

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

int run(const std::string& command) { return std::system((command + " 2>/dev/null").c_str()); }

class Resume : public ::testing::Test {
protected:
  fs::path folder = fs::path(::testing::TempDir()) / ("resume" + std::to_string(::getpid()));
  fs::path output = folder / "room.volume", checkpoint = folder / "room.volume.checkpoint";
  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }
  std::string to(const fs::path& path) const { return " -o '" + path.string() + "'"; }
};

TEST_F(Resume, killed_at_ten_random_moments_ends_in_the_same_bits) {
  const std::string bake = kBake + " --patch-size 0.4"; // about 3,000 facets
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(run(bake + to(folder / "whole.volume")), 0);
  const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::string expected = content(folder / "whole.volume");
  std::mt19937 random(7);
  int went_on = 0;
  for (int k = 0; k < 10; ++k) {
    const double seconds = std::uniform_real_distribution<double>(0.05, 0.95)(random) * whole;
    run("timeout -s KILL " + std::to_string(seconds) + " " + bake + to(output));
    went_on += fs::exists(checkpoint);
    ASSERT_EQ(run(bake + " --resume --threads " + std::to_string(1 + k % 2) + to(output)), 0) << seconds << " s";
    ASSERT_TRUE(content(output) == expected) << "killed after " << seconds << " s of " << whole;
    EXPECT_FALSE(fs::exists(checkpoint));
    fs::remove(output);
  }
  std::printf("%d of 10 kills left a checkpoint; a whole bake took %.1f s\n", went_on, whole);
}

TEST_F(Resume, damaged_or_foreign_checkpoint_is_refused_or_computed_again) {
  ASSERT_EQ(run(kBake + to(folder / "whole.volume")), 0);
  std::ofstream(checkpoint) << "not a checkpoint";
  EXPECT_NE(run(kBake + " --resume" + to(output)), 0);
  EXPECT_FALSE(fs::exists(output));
  EXPECT_NE(run(kBake + to(output)), 0) << "somebody else's file";
  EXPECT_EQ(run(kBake + " --force" + to(output)), 0); // without --resume it starts anew
  EXPECT_TRUE(content(output) == content(folder / "whole.volume"));
}

} // namespace
} // namespace daylit
