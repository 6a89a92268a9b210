// A stand-in for a Video4Linux device: what the kernel would answer to each call.

#include "capture/frames/video_camera.h"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>

#include <linux/videodev2.h>

#include <gtest/gtest.h>

#include "scene/core/seconds.h"

namespace daylit {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kWidth = 40, kHeight = 30, kPadding = 24;

/// What a test wants of the device, and what it was told; outlives it.
struct Bench {
  std::atomic<bool> is_plugged = true, is_silent = false;
  std::atomic<std::uint32_t> sequence = 0, damaged = 0; ///< of the next frame; so many are damaged
  std::atomic<std::uint32_t> lost = 0;                  ///< the counter jumps once by so many
  std::mutex mutex;
  std::map<std::uint32_t, std::vector<int>> controls;
  std::uint32_t code = 0;
  std::atomic<int> mapped = 0;
};

std::uint8_t sample(std::uint32_t frame, std::size_t x, std::size_t y) {
  return static_cast<std::uint8_t>(frame * 7 + x * 3 + y * 5);
}

class FakeDevice final : public VideoDevice {
public:
  explicit FakeDevice(std::shared_ptr<Bench> bench) : bench_(std::move(bench)) {}
  int open(const std::string&) override {
    errno = ENODEV;
    return bench_->is_plugged ? 3 : -1;
  }
  void close() override { queue_.clear(); }
  void* map(std::size_t bytes, std::int64_t offset) override {
    ++bench_->mapped;
    auto& memory = memory_[offset];
    memory.resize(bytes);
    return memory.data();
  }
  void unmap(void*, std::size_t) override { --bench_->mapped; }
  int wait(int milliseconds) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(std::min(milliseconds, 2)));
    return bench_->is_plugged ? !bench_->is_silent && !queue_.empty() : 1;
  }
  int control(unsigned long request, void* argument) override {
    if (!bench_->is_plugged) {
      errno = ENODEV;
      return -1;
    }
    switch (request) {
    case VIDIOC_QUERYCAP:
      static_cast<v4l2_capability*>(argument)->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
      return format(static_cast<v4l2_format*>(argument)->fmt.pix);
    case VIDIOC_S_CTRL: {
      const auto* c = static_cast<v4l2_control*>(argument);
      const std::lock_guard lock(bench_->mutex);
      bench_->controls[c->id].push_back(c->value);
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      auto* b = static_cast<v4l2_buffer*>(argument);
      b->length = row_ * kHeight;
      b->m.offset = b->index * 4096;
      return 0;
    }
    case VIDIOC_QBUF:
      queue_.push_back(static_cast<v4l2_buffer*>(argument)->index);
      return 0;
    case VIDIOC_DQBUF:
      return take(*static_cast<v4l2_buffer*>(argument));
    default:
      return 0;
    }
  }

private:
  int format(v4l2_pix_format& pix) {
    pix.width = kWidth, pix.height = kHeight; // it cannot do another size
    const std::uint32_t pixel = pix.pixelformat == V4L2_PIX_FMT_RGB24 ? 3 : pix.pixelformat == V4L2_PIX_FMT_Y16 ? 2 : 1;
    if (pix.pixelformat == V4L2_PIX_FMT_SRGGB12)
      pix.pixelformat = V4L2_PIX_FMT_GREY; // a driver says what it does instead
    pix.bytesperline = row_ = pixel * kWidth + kPadding;
    const std::lock_guard lock(bench_->mutex);
    bench_->code = pix.pixelformat;
    return 0;
  }
  int take(v4l2_buffer& b) {
    if (queue_.empty()) {
      errno = EAGAIN;
      return -1;
    }
    b.index = queue_.front();
    queue_.erase(queue_.begin());
    bench_->sequence += bench_->lost.exchange(0);
    b.sequence = bench_->sequence++;
    b.bytesused = row_ * kHeight;
    b.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    b.timestamp = {1000 + b.sequence, 500};
    if (bench_->damaged > 0) {
      --bench_->damaged;
      bench_->damaged % 2 ? b.flags |= V4L2_BUF_FLAG_ERROR : b.bytesused /= 2;
    }
    auto& memory = memory_[b.index * 4096];
    for (std::size_t y = 0; y < kHeight; ++y)
      for (std::size_t x = 0; x < row_; ++x)
        memory[y * row_ + x] = sample(b.sequence, x, y);
    return 0;
  }

  std::shared_ptr<Bench> bench_;
  std::map<std::int64_t, std::vector<std::uint8_t>> memory_;
  std::vector<std::uint32_t> queue_;
  std::uint32_t row_ = 0;
};

class VideoCameraTest : public testing::Test {
protected:
  std::unique_ptr<FrameSource> open(const CameraSettings& settings) {
    return source_of(std::make_shared<VideoCamera>(settings, nullptr, std::make_unique<FakeDevice>(bench_)));
  }
  static CameraSettings settings() {
    CameraSettings s;
    s.camera = "/dev/video7";
    s.width_px = kWidth, s.height_px = kHeight;
    return s;
  }
  static std::optional<CameraFrame> frame_of(FrameSource& source, double seconds = 10) {
    for (const double end = wall_seconds() + seconds; wall_seconds() < end;)
      if (auto frame = source.next(20ms); frame && *frame)
        return std::move(**frame);
    return std::nullopt;
  }
  /// Drivers and libv4l2 take as long as they like to open a device.
  static std::string trouble_of(const FrameSource& source) {
    for (const double end = wall_seconds() + 10; wall_seconds() < end && source.report().trouble.empty();)
      std::this_thread::sleep_for(5ms);
    return source.report().trouble;
  }
  static void expect_untouched(const CameraFrame& f, std::size_t bytes_per_pixel) {
    ASSERT_EQ(f.bytes.size(), kWidth * kHeight * bytes_per_pixel);
    std::size_t wrong = 0;
    for (std::size_t y = 0; y < kHeight; ++y)
      for (std::size_t x = 0; x < kWidth * bytes_per_pixel; ++x)
        wrong += f.bytes[y * kWidth * bytes_per_pixel + x] != sample(static_cast<std::uint32_t>(f.id), x, y);
    EXPECT_EQ(wrong, 0u);
  }
  std::shared_ptr<Bench> bench_ = std::make_shared<Bench>();
};

TEST_F(VideoCameraTest, frames_come_bit_for_bit_without_the_padding_of_their_rows) {
  for (const auto& [name, code, format] : {std::tuple{"", V4L2_PIX_FMT_RGB24, PixelFormat{Mosaic::rgb, 8}},
                                           {"Mono16", V4L2_PIX_FMT_Y16, PixelFormat{Mosaic::mono, 16}},
                                           {"BayerGR8", V4L2_PIX_FMT_SGRBG8, PixelFormat{Mosaic::grbg, 8}}}) {
    CameraSettings s = settings();
    s.pixel_format = name;
    const auto source = open(s);
    const auto frame = frame_of(*source);
    ASSERT_TRUE(frame) << source->report().trouble;
    EXPECT_EQ(frame->format, format);
    expect_untouched(*frame, static_cast<std::size_t>(format.samples_per_pixel() * format.bytes_per_sample()));
    EXPECT_EQ(frame->taken_ns, (1000 + static_cast<std::int64_t>(frame->id)) * 1'000'000'000 + 500'000);
    const std::lock_guard lock(bench_->mutex);
    EXPECT_EQ(bench_->code, code);
  }
  for (const double end = wall_seconds() + 10; wall_seconds() < end && bench_->mapped > 0;)
    std::this_thread::sleep_for(5ms);
  EXPECT_EQ(bench_->mapped, 0) << "all memory is given back";
}

TEST_F(VideoCameraTest, damaged_frames_are_counted_and_gaps_are_missing_frames) {
  const auto source = open(settings());
  ASSERT_TRUE(frame_of(*source));
  bench_->damaged = 6;
  bench_->lost = 9;
  for (const double end = wall_seconds() + 10; wall_seconds() < end && source->report().damaged < 6;)
    if (const auto frame = frame_of(*source, 0.1))
      expect_untouched(*frame, 3);
  EXPECT_EQ(source->report().damaged, 6u);
  EXPECT_EQ(source->report().missing, 9u);
}

TEST_F(VideoCameraTest, one_that_was_unplugged_or_falls_silent_is_opened_again) {
  const auto source = open(settings());
  ASSERT_TRUE(frame_of(*source));
  for (std::atomic<bool>* fault : {&bench_->is_plugged, &bench_->is_silent}) {
    const std::uint64_t before = source->report().connections;
    *fault = !*fault;
    for (const double end = wall_seconds() + 10; source->report().connected && wall_seconds() < end;)
      (void)source->next(20ms);
    EXPECT_FALSE(source->report().connected);
    EXPECT_FALSE(source->report().trouble.empty());
    *fault = !*fault;
    (void)source->next(0ms);
    EXPECT_TRUE(frame_of(*source)) << source->report().trouble;
    EXPECT_GT(source->report().connections, before);
  }
}

TEST_F(VideoCameraTest, exposure_and_gain_are_set_and_a_bracket_is_cycled) {
  CameraSettings s = settings();
  s.exposures_us = {100, 6400, 409600};
  s.gain = 12;
  const auto source = open(s);
  for (const double end = wall_seconds() + 10; wall_seconds() < end && source->report().whole < 4;)
    (void)source->next(20ms);
  const std::lock_guard lock(bench_->mutex);
  EXPECT_EQ(bench_->controls[V4L2_CID_GAIN], std::vector<int>{12});
  const std::vector<int>& set = bench_->controls[V4L2_CID_EXPOSURE_ABSOLUTE];
  ASSERT_GE(set.size(), 4u);
  EXPECT_EQ(std::vector<int>(set.begin(), set.begin() + 4), (std::vector<int>{1, 64, 4096, 1}));
}

TEST_F(VideoCameraTest, what_it_cannot_do_is_said) {
  CameraSettings s = settings();
  for (const auto& [name, words] : {std::pair{"BayerRG12", "does not send"}, {"Mono13", "is not read"}}) {
    s.pixel_format = name;
    const auto source = open(s);
    EXPECT_NE(trouble_of(*source).find(words), std::string::npos) << source->report().trouble;
    EXPECT_FALSE(frame_of(*source, 0.3));
  }
  s = settings();
  s.packet_bytes = 8000;
  EXPECT_FALSE(open_camera(s));
  s.packet_bytes = 0;
  s.camera = "/dev/null";
  const auto source = open_camera(s);
  ASSERT_TRUE(source);
  EXPECT_NE(trouble_of(**source), "");
  EXPECT_FALSE(frame_of(**source, 0.3));
}

} // namespace
} // namespace daylit
