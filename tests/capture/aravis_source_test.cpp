// Real GigE Vision packets over loopback, from Aravis' fake camera in this process.

#include "capture/frames/aravis_source.h"
#include "capture/frames/camera_thread.h"

#include <atomic>
#include <cstring>
#include <memory>
#include <thread>

#include <arv.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "scene/core/seconds.h"
#include "tests/capture/second_address.h"

namespace daylit {
namespace {

constexpr const char* kAddress = "127.0.0.1";

/// Sample i of frame n, different in every frame.
std::uint8_t sample(std::uint64_t n, std::size_t i) { return static_cast<std::uint8_t>(i * 31 + n * 7 + i / 251); }

void fill(ArvBuffer* buffer, void* counter, guint32, guint32, ArvPixelFormat format) {
  const std::uint64_t n = (*static_cast<std::atomic<std::uint64_t>*>(counter))++;
  std::size_t size = 0; // 0 here, although the pointer is right
  auto* data = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
  const std::size_t pixels = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)) *
                             static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
  for (std::size_t i = 0; data && i < pixels * (format >> 16 & 0xff) / 8; ++i)
    data[i] = sample(n, i);
  if (data)
    std::memcpy(data, &n, sizeof(n));
}

/// The port of the control channel is one per machine: tests that run beside this one wait.
class CameraTest : public testing::Test {
protected:
  void SetUp() override {
    lock_ = open("/tmp/daylit-camera-test.lock", O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    ASSERT_GE(lock_, 0);
    flock(lock_, LOCK_EX);
    if (!plug_in())
      GTEST_SKIP() << "no loopback network, or its port of GigE Vision is in use";
  }
  void TearDown() override {
    unplug();
    close(lock_);
  }
  bool plug_in(const std::string& address = kAddress) {
    camera_ = arv_gv_fake_camera_new(address.c_str(), "daylit-test");
    if (!camera_ || !arv_gv_fake_camera_is_running(camera_))
      return false;
    arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera_), fill, &served_);
    return true;
  }
  void unplug() {
    if (camera_)
      g_object_unref(camera_);
    camera_ = nullptr;
  }
  static CameraSettings settings() {
    CameraSettings s;
    s.camera = kAddress;
    s.pixel_format = "Mono16";
    s.width_px = 160, s.height_px = 120;
    s.frame_rate_hz = 50;
    s.exposure_us = 3000;
    s.packet_bytes = 8192;
    return s;
  }
  static std::optional<CameraFrame> frame_within(FrameSource& source, double seconds) {
    const double end = wall_seconds() + seconds;
    while (wall_seconds() < end)
      if (auto frame = source.next(std::chrono::milliseconds(50)); frame && *frame)
        return std::move(**frame);
    return std::nullopt;
  }
  /// As it was served: bit for bit what fill() wrote for the number in its first bytes.
  static void expect_untouched(const CameraFrame& frame) {
    std::uint64_t n = 0;
    std::memcpy(&n, frame.bytes.data(), sizeof(n));
    std::size_t wrong = 0;
    for (std::size_t i = sizeof(n); i < frame.bytes.size(); ++i)
      wrong += frame.bytes[i] != sample(n, i);
    EXPECT_EQ(wrong, 0u) << "of frame " << n;
  }

  int lock_ = -1;
  ArvGvFakeCamera* camera_ = nullptr;
  std::atomic<std::uint64_t> served_{0};
};

TEST_F(CameraTest, frames_arrive_bit_for_bit_in_the_declared_format) {
  CameraSettings s = settings();
  s.mosaic = Mosaic::rggb; // a mosaic that the camera does not know of
  auto source = open_camera(s);
  ASSERT_TRUE(source) << source.error().message();
  for (int k = 0; k < 5; ++k) {
    const auto frame = frame_within(**source, 15);
    ASSERT_TRUE(frame) << (*source)->report().trouble;
    EXPECT_EQ(frame->width_px, 160);
    EXPECT_EQ(frame->height_px, 120);
    EXPECT_EQ(frame->format, (PixelFormat{Mosaic::rggb, 16}));
    EXPECT_NEAR(frame->exposure_us, 3000, 1);
    expect_untouched(*frame);
  }
  EXPECT_TRUE((*source)->report().connected);
  EXPECT_EQ((*source)->report().damaged, 0u);
}

TEST_F(CameraTest, discovery_names_the_camera_and_its_id_opens_it) {
  std::string id;
  for (const FoundCamera& found : find_cameras())
    if (found.address == kAddress)
      id = found.id;
  ASSERT_NE(id.find("daylit-test"), std::string::npos) << id;
  CameraSettings s = settings();
  s.camera = id;
  s.pixel_format = "RGB8";
  auto source = open_camera(s);
  ASSERT_TRUE(source);
  const auto frame = frame_within(**source, 15);
  ASSERT_TRUE(frame) << (*source)->report().trouble;
  EXPECT_EQ(frame->format, (PixelFormat{Mosaic::rgb, 8}));
  expect_untouched(*frame);
}

TEST_F(CameraTest, a_slow_reader_gets_the_newest_frame_and_the_rest_are_counted) {
  auto source = open_camera(settings());
  ASSERT_TRUE(source);
  const auto first = frame_within(**source, 15);
  ASSERT_TRUE(first) << (*source)->report().trouble;
  const std::uint64_t before = (*source)->report().superseded; // on a busy machine the first one may have been late too
  for (const double end = wall_seconds() + 15; wall_seconds() < end && (*source)->report().superseded < before + 5;)
    usleep(10'000);
  EXPECT_GE((*source)->report().superseded, before + 5);
  const auto second = frame_within(**source, 1);
  ASSERT_TRUE(second);
  EXPECT_GT(second->id, first->id + 5);
}

TEST_F(CameraTest, frames_with_lost_packets_are_counted_and_never_given_out) {
  g_object_set(camera_, "gvsp-lost-ratio", 0.1, nullptr);
  CameraSettings s = settings();
  s.packet_bytes = 4096; // ten packets a frame: a third of them whole
  auto source = open_camera(s);
  ASSERT_TRUE(source);
  const double end = wall_seconds() + 15; // a machine under load takes its time
  std::uint64_t whole = 0;
  SourceReport report;
  while (wall_seconds() < end && (report.damaged < 10 || report.whole < 10)) {
    const auto frame = (*source)->next(std::chrono::milliseconds(20));
    if (frame && *frame) {
      expect_untouched(**frame);
      ++whole;
    }
    report = (*source)->report();
  }
  EXPECT_GE(report.damaged, 10u) << report.trouble;
  EXPECT_GE(report.whole, 10u);
  EXPECT_GE(whole, 1u);
  EXPECT_LE(whole + report.superseded, report.whole);
  EXPECT_GE(whole + report.superseded + 1, report.whole) << "each was given out, superseded, or waits";
}

TEST_F(CameraTest, an_unplugged_camera_is_said_to_be_gone_and_taken_up_again) {
  auto source = open_camera(settings());
  ASSERT_TRUE(source);
  ASSERT_TRUE(frame_within(**source, 15)) << (*source)->report().trouble;
  unplug();
  const double end = wall_seconds() + 15;
  while ((*source)->report().connected && wall_seconds() < end)
    (void)(*source)->next(std::chrono::milliseconds(20)); // frames that were under way
  EXPECT_FALSE((*source)->report().connected);
  EXPECT_FALSE((*source)->report().trouble.empty());
  (void)(*source)->next(std::chrono::milliseconds(0));
  EXPECT_FALSE(frame_within(**source, 0.2));
  ASSERT_TRUE(plug_in());
  const double back = wall_seconds();
  EXPECT_TRUE(frame_within(**source, 15)) << (*source)->report().trouble;
  RecordProperty("seconds_until_back", std::to_string(wall_seconds() - back));
  EXPECT_EQ((*source)->report().connections, 2u);
}

TEST_F(CameraTest, a_camera_named_by_its_id_is_found_again_at_another_address) {
  const std::string other = test::second_address();
  if (other.empty())
    GTEST_SKIP() << "this machine has one address only";
  CameraSettings s = settings();
  s.camera = "Aravis-Fake-daylit-test";
  auto source = open_camera(s);
  ASSERT_TRUE(source);
  ASSERT_TRUE(frame_within(**source, 15)) << (*source)->report().trouble;
  unplug();
  for (const double end = wall_seconds() + 15; (*source)->report().connected && wall_seconds() < end;)
    (void)(*source)->next(std::chrono::milliseconds(20));
  (void)(*source)->next(std::chrono::milliseconds(0));
  ASSERT_TRUE(plug_in(other));
  const auto frame = frame_within(**source, 30); // Aravis waits some ten seconds for answers from where it was
  ASSERT_TRUE(frame) << (*source)->report().trouble;
  expect_untouched(*frame);
  EXPECT_EQ((*source)->report().connections, 2u);
}

TEST_F(CameraTest, a_thread_that_still_looks_for_its_camera_is_told_of_until_it_has_ended) {
  CameraSettings settings;
  settings.camera = "no camera has this name";
  {
    const auto source = open_camera(settings);
    ASSERT_TRUE(source);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_TRUE(is_camera_leaving());
  for (const double end = wall_seconds() + 20; is_camera_leaving() && wall_seconds() < end;)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_FALSE(is_camera_leaving());
}

TEST_F(CameraTest, cameras_with_the_same_id_are_told_apart_by_their_addresses) {
  const std::string other = test::second_address();
  if (other.empty())
    GTEST_SKIP() << "this machine has one address only";
  ArvGvFakeCamera* twin = arv_gv_fake_camera_new(other.c_str(), "daylit-test");
  ASSERT_TRUE(arv_gv_fake_camera_is_running(twin));
  const auto dark = [](ArvBuffer* buffer, void*, guint32, guint32, ArvPixelFormat) {
    std::size_t size = 0;
    const int samples = arv_buffer_get_image_width(buffer) * arv_buffer_get_image_height(buffer);
    std::memset(const_cast<void*>(arv_buffer_get_data(buffer, &size)), 0, 2 * static_cast<std::size_t>(samples));
  };
  arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(twin), dark, nullptr);
  CameraSettings of_twin = settings();
  of_twin.camera = other;
  auto first = open_camera(settings()), second = open_camera(of_twin);
  ASSERT_TRUE(first && second);
  for (int k = 0; k < 3; ++k) {
    const auto bright = frame_within(**first, 15), black = frame_within(**second, 15);
    EXPECT_TRUE(bright && black) << (*first)->report().trouble << (*second)->report().trouble;
    if (bright && black) {
      expect_untouched(*bright);
      EXPECT_EQ(black->bytes, std::vector<std::uint8_t>(black->bytes.size(), 0));
    }
  }
  second->reset();
  g_object_unref(twin);
}

TEST_F(CameraTest, settings_that_the_camera_refuses_are_said) {
  CameraSettings s = settings();
  s.pixel_format = "Mono13";
  auto source = open_camera(s);
  ASSERT_TRUE(source);
  EXPECT_FALSE(frame_within(**source, 1.5));
  EXPECT_NE((*source)->report().trouble.find("pixel_format = \"Mono13\""), std::string::npos)
      << (*source)->report().trouble;
  EXPECT_NE((*source)->report().trouble.find("it has BayerBG8, "), std::string::npos) << (*source)->report().trouble;
  s.exposure_us = -1;
  EXPECT_FALSE(open_camera(s));
}

} // namespace
} // namespace daylit
