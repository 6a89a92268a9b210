#include "capture/frames/recording.h"

#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "scene/core/seconds.h"

namespace daylit {
namespace {

class RecordingFolder : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-frames-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void write(const std::vector<CameraFrame>& frames) const {
    auto writer = RecordingWriter::create(folder_);
    ASSERT_TRUE(writer) << writer.error().message();
    for (const CameraFrame& frame : frames)
      ASSERT_TRUE(writer->add(frame));
  }
  std::filesystem::path folder_;
};

CameraFrame frame_of(Mosaic mosaic, int bits, std::uint64_t id) {
  CameraFrame frame{
      7, 5, {mosaic, bits}, {}, id, 1'700'000'000'000'000'000 + std::int64_t(id) * 100'000'000, 1234.5 + double(id)};
  const std::size_t samples = frame_bytes(7, 5, frame.format) / frame.format.bytes_per_sample();
  for (std::size_t i = 0; i < samples; ++i) {
    const auto value = static_cast<unsigned>((i * 40503 + id * 977) & ((1u << bits) - 1));
    frame.bytes.push_back(static_cast<std::uint8_t>(value));
    if (bits > 8)
      frame.bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  }
  return frame;
}

std::vector<CameraFrame> all_kinds() {
  std::vector<CameraFrame> frames;
  for (const Mosaic mosaic : {Mosaic::mono, Mosaic::rgb, Mosaic::rggb, Mosaic::grbg, Mosaic::gbrg, Mosaic::bggr})
    for (const int bits : {8, 10, 12, 16})
      frames.push_back(frame_of(mosaic, bits, frames.size()));
  return frames;
}

TEST_F(RecordingFolder, every_kind_of_frame_comes_back_bit_for_bit) {
  write(all_kinds());
  auto recording = Recording::open(folder_);
  ASSERT_TRUE(recording) << recording.error().message();
  ASSERT_EQ(recording->size(), all_kinds().size());
  const auto source = replay(*recording, ReplayTiming::fast);
  for (const CameraFrame& frame : all_kinds()) {
    EXPECT_FALSE(source->finished());
    const auto again = source->next(std::chrono::milliseconds(0));
    ASSERT_TRUE(again && *again);
    EXPECT_EQ(**again, frame) << frame.id;
  }
  EXPECT_TRUE(source->finished());
  EXPECT_EQ(source->report().whole, all_kinds().size());
  EXPECT_EQ(source->report().superseded, 0u);
}

TEST_F(RecordingFolder, original_timing_gives_the_newest_frame_that_is_due) {
  std::vector<CameraFrame> frames;
  for (std::uint64_t id = 0; id < 6; ++id) // 100 ms apart
    frames.push_back(frame_of(Mosaic::mono, 8, id));
  write(frames);
  const auto source = replay(*Recording::open(folder_), ReplayTiming::original);
  const double start = wall_seconds();
  const auto first = source->next(std::chrono::milliseconds(0));
  ASSERT_TRUE(first && *first);
  EXPECT_EQ((*first)->id, 0u);
  EXPECT_FALSE(*source->next(std::chrono::milliseconds(1))) << "the second is not due yet";
  const auto second = source->next(std::chrono::seconds(1));
  ASSERT_TRUE(second && *second);
  EXPECT_GE(wall_seconds() - start, 0.0999 * static_cast<double>((*second)->id));
  while (wall_seconds() - start < 0.51) {
  }
  const auto last = source->next(std::chrono::seconds(1));
  ASSERT_TRUE(last && *last);
  EXPECT_EQ((*last)->id, 5u) << "a slow reader gets the newest";
  EXPECT_TRUE(source->finished());
  EXPECT_EQ(source->report().whole, 6u);
  EXPECT_EQ(source->report().superseded, 3u);
}

TEST_F(RecordingFolder, a_recording_that_was_cut_off_is_whole_up_to_its_last_line) {
  write({frame_of(Mosaic::mono, 8, 0), frame_of(Mosaic::mono, 8, 1)});
  std::ofstream(folder_ / "frames.jsonl", std::ios::app) << "{\"file\":\"00000002.pg";
  const auto recording = Recording::open(folder_);
  ASSERT_TRUE(recording) << recording.error().message();
  EXPECT_EQ(recording->size(), 2u);
}

TEST_F(RecordingFolder, damage_is_an_error_that_names_file_or_line) {
  write({frame_of(Mosaic::rggb, 12, 0), frame_of(Mosaic::rggb, 12, 1)});
  const auto recording = Recording::open(folder_);
  ASSERT_TRUE(recording);
  {
    std::fstream file(folder_ / "00000001.pgm", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(-1, std::ios::end).put('\x55');
  }
  EXPECT_TRUE(recording->read(0));
  const auto damaged = recording->read(1);
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().message().find("00000001.pgm"), std::string::npos);
  std::filesystem::resize_file(folder_ / "00000000.pgm", 20);
  EXPECT_FALSE(recording->read(0));
  for (const char* line :
       {"nonsense\n", "{}\n",
        "{\"file\":\"../x\",\"id\":1,\"time_ns\":1,\"exposure_us\":1,\"mosaic\":\"mono\",\"xxh64\":\"\"}\n",
        "{\"file\":\"x\",\"id\":1,\"time_ns\":1,\"exposure_us\":1,\"mosaic\":\"hexagons\",\"xxh64\":\"\"}\n"}) {
    std::ofstream(folder_ / "frames.jsonl") << line;
    const auto bad = Recording::open(folder_);
    ASSERT_FALSE(bad) << line;
    EXPECT_NE(bad.error().message().find("line 1"), std::string::npos) << bad.error().message();
  }
}

TEST_F(RecordingFolder, a_recording_is_never_written_over) {
  write({frame_of(Mosaic::mono, 8, 0)});
  EXPECT_FALSE(RecordingWriter::create(folder_));
  EXPECT_FALSE(Recording::open(folder_ / "elsewhere"));
}

/// Each mosaic of an even colour is that colour again.
TEST(LinearPicture, a_mosaic_is_filled_in_with_the_right_colours) {
  struct Case {
    Mosaic mosaic;
    const char* cells;
  };
  const double value[3] = {100, 2000, 4095}; // R G B, 12 bits
  for (const Case& c : {Case{Mosaic::rggb, "rggb"}, Case{Mosaic::grbg, "grbg"}, Case{Mosaic::gbrg, "gbrg"},
                        Case{Mosaic::bggr, "bggr"}}) {
    CameraFrame frame{10, 8, {c.mosaic, 12}, {}, 0, 0, 0};
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 10; ++x) {
        const char colour = c.cells[2 * (y % 2) + x % 2];
        const auto code = static_cast<unsigned>(value[colour == 'r' ? 0 : colour == 'g' ? 1 : 2]);
        frame.bytes.push_back(static_cast<std::uint8_t>(code));
        frame.bytes.push_back(static_cast<std::uint8_t>(code >> 8));
      }
    const auto picture = linear_picture(frame);
    ASSERT_TRUE(picture);
    for (const Rgb& t : picture->texels)
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(double(t[k]), value[k] / 4095, 1e-3) << c.cells << " channel " << k;
  }
}

TEST(LinearPicture, a_frame_of_the_wrong_length_is_an_error) {
  CameraFrame frame = frame_of(Mosaic::rggb, 12, 0);
  EXPECT_TRUE(linear_picture(frame));
  frame.bytes.pop_back();
  EXPECT_FALSE(linear_picture(frame));
  EXPECT_FALSE(linear_picture(CameraFrame{}));
}

} // namespace
} // namespace daylit
