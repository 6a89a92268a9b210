// Another program's look at the shared picture: its own mapping of the name.

#include "runtime/output/shared_picture.h"

#include <cstring>
#include <set>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace daylit {
namespace {

const std::string kName = "daylit-test-" + std::to_string(getpid());
constexpr int kWidth = 320, kHeight = 200;

Rgb8Image plain(int width, int height, std::uint8_t value) {
  return {width, height, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width) * height, value)};
}

/// What a reader does; it knows the layout from the page only.
class Reader {
public:
  Reader() {
    const int file = shm_open(("/" + kName).c_str(), O_RDONLY, 0);
    if (file < 0)
      return;
    size_ = static_cast<std::size_t>(lseek(file, 0, SEEK_END));
    memory_ = static_cast<const std::uint8_t*>(mmap(nullptr, size_, PROT_READ, MAP_SHARED, file, 0));
    close(file);
  }
  ~Reader() {
    if (memory_)
      munmap(const_cast<std::uint8_t*>(memory_), size_);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  bool is_there() const { return memory_ != nullptr; }
  std::size_t size() const { return size_; }
  template <class T>
  T at(std::size_t byte) const {
    T value;
    std::memcpy(&value, memory_ + byte, sizeof value);
    return value;
  }
  std::uint64_t sequence() const { return reinterpret_cast<const std::atomic<std::uint64_t>*>(memory_ + 16)->load(); }
  std::vector<std::uint8_t> pixels() const { return {memory_ + 64, memory_ + size_}; }

private:
  const std::uint8_t* memory_ = nullptr;
  std::size_t size_ = 0;
};

TEST(SharedPicture, another_program_reads_the_newest_picture_by_the_documented_layout) {
  auto shared = SharedPicture::create(kName, kWidth, kHeight);
  ASSERT_TRUE(shared) << shared.error().message();
  ASSERT_TRUE(shared->write(plain(kWidth, kHeight, 7), 41));
  Rgb8Image picture = plain(kWidth, kHeight, 9);
  picture.bytes.back() = 200;
  ASSERT_TRUE(shared->write(picture, 42));
  const Reader reader;
  ASSERT_TRUE(reader.is_there());
  EXPECT_EQ(reader.size(), 64 + picture.bytes.size());
  EXPECT_EQ(reader.at<std::uint64_t>(0), 0x003154494c594144u) << "DAYLIT1 and a zero, little endian";
  EXPECT_EQ(reader.at<std::uint32_t>(8), static_cast<std::uint32_t>(kWidth));
  EXPECT_EQ(reader.at<std::uint32_t>(12), static_cast<std::uint32_t>(kHeight));
  EXPECT_EQ(reader.sequence() % 2, 0u);
  EXPECT_EQ(reader.at<std::uint64_t>(24), 42u);
  EXPECT_GT(reader.at<std::int64_t>(32), 0);
  EXPECT_EQ(reader.pixels(), picture.bytes);
}

TEST(SharedPicture, readers_never_take_halves_of_two_pictures_for_one) {
  auto shared = SharedPicture::create(kName, kWidth, kHeight);
  ASSERT_TRUE(shared);
  ASSERT_TRUE(shared->write(plain(kWidth, kHeight, 0), 1));
  const Reader reader;
  ASSERT_TRUE(reader.is_there());
  std::jthread writer([&](const std::stop_token& stop) {
    for (std::uint64_t k = 0; !stop.stop_requested(); ++k)
      EXPECT_TRUE(shared->write(plain(kWidth, kHeight, static_cast<std::uint8_t>(k)), k));
  });
  int whole = 0;
  for (int tries = 0; whole < 200 && tries < 2'000'000; ++tries) {
    const std::uint64_t before = reader.sequence();
    const auto pixels = reader.pixels();
    if (before % 2 != 0 || reader.sequence() != before)
      continue;
    ++whole;
    EXPECT_EQ(std::set<std::uint8_t>(pixels.begin(), pixels.end()).size(), 1u);
  }
  EXPECT_EQ(whole, 200);
}

TEST(SharedPicture, another_size_comes_in_new_memory_and_the_old_says_so) {
  auto shared = SharedPicture::create(kName, kWidth, kHeight);
  ASSERT_TRUE(shared);
  const Reader old;
  ASSERT_TRUE(shared->write(plain(64, 48, 5), 1));
  EXPECT_EQ(old.at<std::uint32_t>(8), 0u);
  {
    const Reader now;
    EXPECT_EQ(now.at<std::uint32_t>(8), 64u);
    EXPECT_EQ(now.pixels(), plain(64, 48, 5).bytes);
  }
}

TEST(SharedPicture, the_name_goes_with_it_and_nothing_of_others_is_overwritten) {
  {
    const auto shared = SharedPicture::create(kName, kWidth, kHeight);
    ASSERT_TRUE(shared) << shared.error().message();
    EXPECT_FALSE(SharedPicture::create(kName, kWidth, kHeight)) << "one that goes on";
    EXPECT_TRUE(Reader().is_there());
  }
  EXPECT_FALSE(Reader().is_there());
  const int file = shm_open(("/" + kName).c_str(), O_CREAT | O_RDWR, 0600);
  ASSERT_GE(file, 0);
  EXPECT_EQ(write(file, "something else of that name", 27), 27);
  close(file);
  const auto refused = SharedPicture::create(kName, kWidth, kHeight);
  EXPECT_FALSE(refused);
  EXPECT_EQ(Reader().size(), 27u);
  shm_unlink(("/" + kName).c_str());
  if (const pid_t killed = fork(); killed == 0) {
    const auto left = SharedPicture::create(kName, kWidth, kHeight);
    _exit(left ? 0 : 1); // without any destructor
  } else {
    int status = -1;
    waitpid(killed, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_TRUE(Reader().is_there());
  EXPECT_TRUE(SharedPicture::create(kName, kWidth, kHeight)) << "what a killed run left";
  for (const char* name : {"", "a/b", "..", "."})
    EXPECT_FALSE(SharedPicture::create(name, kWidth, kHeight)) << name;
}

} // namespace
} // namespace daylit
