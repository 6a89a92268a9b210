#include "precompute/checkpoint.h"

#include <cstring>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

namespace daylit::precompute {
namespace {

using Store = radiosity::WorkStore;
const Store::Name kFirst{Store::Stage::exchange, 0, 0}, kSecond{Store::Stage::forward, 2, 7};

std::vector<std::byte> piece(int length) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(length));
  for (std::size_t k = 0; k < bytes.size(); ++k)
    bytes[k] = static_cast<std::byte>(k * 37);
  return bytes;
}

class CheckpointFile : public ::testing::Test {
protected:
  std::filesystem::path path = ::testing::TempDir() + "checkpoint" + std::to_string(::getpid());
  void SetUp() override {
    auto c = Checkpoint::open(path, 42, false);
    std::this_thread::sleep_for(std::chrono::milliseconds(2050)); // earlier pieces are not kept
    (*c)->keep(kFirst, piece(1000));
    (*c)->keep(kSecond, piece(300));
  }
  void TearDown() override { std::filesystem::remove(path); }
};

TEST_F(CheckpointFile, gives_back_what_was_kept_and_drops_what_was_cut_or_damaged) {
  {
    auto c = Checkpoint::open(path, 42, true);
    ASSERT_TRUE(c) << c.error().message();
    EXPECT_EQ((*c)->records_found(), 2u);
    EXPECT_EQ((*c)->note(), "") << "it is whole";
    EXPECT_EQ((*c)->find(kFirst), piece(1000));
    EXPECT_EQ((*c)->find(kSecond), piece(300));
    EXPECT_FALSE((*c)->find({Store::Stage::forward, 2, 8}));
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
  {
    auto c = Checkpoint::open(path, 42, true);
    ASSERT_TRUE(c);
    EXPECT_EQ((*c)->records_found(), 1u);
    EXPECT_EQ((*c)->note(), path.string() + " is cut short or damaged: what is lost of it is computed again");
    EXPECT_FALSE((*c)->find(kSecond));
  }
  {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(200);
    file.put('x');
  }
  auto c = Checkpoint::open(path, 42, true);
  ASSERT_TRUE(c);
  EXPECT_EQ((*c)->records_found(), 0u);
  EXPECT_EQ((*c)->note(), path.string() + " holds nothing that can be used: the bake starts anew");
}

TEST_F(CheckpointFile, of_other_inputs_is_refused) {
  const auto other = Checkpoint::open(path, 43, true);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().hint.find("--resume"), std::string::npos);
}

TEST_F(CheckpointFile, hostile_length_allocates_nothing_beyond_the_file) {
  {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(16 + 16); // length of the first record
    const std::uint64_t huge = ~std::uint64_t{0} / 2;
    file.write(reinterpret_cast<const char*>(&huge), sizeof huge);
  }
  const auto c = Checkpoint::open(path, 42, true);
  ASSERT_TRUE(c);
  EXPECT_EQ((*c)->records_found(), 0u);
}

} // namespace
} // namespace daylit::precompute
