// A live run from end to end: two cameras that send real GigE Vision packets over loopback, from Aravis' fake cameras
// in this process.

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <fstream>
#include <memory>
#include <string_view>
#include <thread>

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "capture/frames/recording.h"
#include "fake_camera.h"
#include "runtime/cmd/live_command.h"
#include "runtime/http/http_server.h"
#include "runtime/live/live_run.h"
#include "runtime/live/replay.h"
#include "scene/core/program.h"
#include "scene/core/seconds.h"
#include "scene/image/image_formats.h"
#include "test_session.h"
#include "tests/capture/second_address.h"

namespace daylit {
namespace {

using test::FakeCamera;

using namespace std::chrono_literals;

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr double kSlower = 10; ///< a picture takes seconds
#else
constexpr double kSlower = 1;
#endif

std::vector<std::uint8_t> sixteen_bits(const std::vector<Rgb>& texels, float largest) {
  std::vector<std::uint8_t> bytes;
  for (const Rgb& t : texels) {
    const auto code = static_cast<unsigned>(65535 * std::clamp(t.g / largest, 0.0f, 1.0f));
    bytes.push_back(static_cast<std::uint8_t>(code));
    bytes.push_back(static_cast<std::uint8_t>(code >> 8));
  }
  return bytes;
}

std::vector<std::uint8_t> eight_bits(const std::vector<Rgb>& texels) {
  std::vector<std::uint8_t> bytes;
  for (const Rgb& t : texels)
    for (int c = 0; c < 3; ++c)
      bytes.push_back(static_cast<std::uint8_t>(255 * std::clamp(t[c], 0.0f, 1.0f)));
  return bytes;
}

class LiveCamerasTest : public testing::Test {
protected:
  static constexpr float kSkyRange = 4.0f;

  void SetUp() override {
    // The port of the control channel is one per machine: tests that run beside this one wait.
    lock_ = open("/tmp/daylit-camera-test.lock", O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    ASSERT_GE(lock_, 0);
    flock(lock_, LOCK_EX);
    const std::string second = test::second_address();
    if (second.empty())
      GTEST_SKIP() << "this machine has one address only";
    sky_ = std::make_unique<FakeCamera>("127.0.0.1", sixteen_bits(studio_.sky.radiance, kSkyRange));
    interior_ = std::make_unique<FakeCamera>(second, eight_bits(studio_.photo.texels));
    if (!sky_->is_running() || !interior_->is_running())
      GTEST_SKIP() << "no loopback network, or its port of GigE Vision is in use";
    RunConfig& c = studio_.config;
    c.sky.camera = camera("127.0.0.1", "Mono16", studio_.sky.width, studio_.sky.height);
    c.interior.camera = camera(second, "RGB8", test::Studio::kWidth, test::Studio::kHeight);
    c.interior.scale = 1.0 / double(kSkyRange);
  }
  void TearDown() override {
    stop();
    sky_.reset();
    interior_.reset();
    close(lock_);
  }
  static CameraConfig camera(const std::string& address, const std::string& format, int width, int height) {
    CameraConfig c;
    c.camera = address;
    c.pixel_format = format;
    c.exposure_us = 1000;
    c.frame_rate_hz = 40 / kSlower;
    c.packet_bytes = 8192;
    c.width_px = width, c.height_px = height;
    return c;
  }
  /// In a thread of its own.
  void start() {
    auto loaded = LiveRun::load(studio_.config, Backend::rays, [](const std::string&, double) { return true; });
    ASSERT_TRUE(loaded) << loaded.error().message();
    run_ = std::move(*loaded);
    thread_ = std::thread([this] {
      LiveSurroundings around{board_, status_};
      around.sky_recorder = sky_recorder_.get();
      around.interior_recorder = interior_recorder_.get();
      around.go_on = [this] { return !over_; };
      const auto ended = run_->run(around);
      EXPECT_TRUE(ended) << ended.error().message();
    });
  }
  void stop() {
    over_ = true;
    if (thread_.joinable())
      thread_.join();
    over_ = false;
  }
  bool within(double seconds, const std::function<bool(const LiveReport&)>& holds) const {
    for (const double end = wall_seconds() + kSlower * seconds; wall_seconds() < end; std::this_thread::sleep_for(5ms))
      if (holds(status_.report()))
        return true;
    return false;
  }
  static bool starts(const LiveReport& r, const char* words) { return r.state.starts_with(words); }

  int lock_ = -1;
  test::Studio studio_;
  std::unique_ptr<FakeCamera> sky_, interior_;
  PictureBoard board_;
  LiveStatus status_;
  std::unique_ptr<Recorder> sky_recorder_, interior_recorder_;
  std::unique_ptr<LiveRun> run_;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

TEST_F(LiveCamerasTest, pictures_are_those_of_a_replay_bit_for_bit) {
  const auto folder = studio_.folder / "tape";
  sky_recorder_ = *Recorder::start(folder / "sky");
  interior_recorder_ = *Recorder::start(folder / "interior");
  start();
  std::shared_ptr<const LivePicture> live;
  {
    PictureBoard::Viewer viewer(board_, PictureBoard::Wants::view);
    ASSERT_TRUE(within(20, [](const LiveReport& r) { return r.drawn >= 3; })) << to_json(status_.report());
    live = viewer.after(board_.last_index() - 1, 1000ms);
  }
  ASSERT_TRUE(live);
  const LiveReport report = status_.report();
  EXPECT_GT(report.latency_median_ms, 0.0);
  // A busy machine loses packets on its loopback device, too: damaged pictures are neither drawn nor recorded.
  stop();
  sky_recorder_.reset(), interior_recorder_.reset();
  studio_.config.output.png = studio_.folder / "out.png";
  const auto replayed = replay_recording(studio_.config, {folder, 2, Backend::rays}, [](const DrawnFrame&) {});
  ASSERT_TRUE(replayed) << replayed.error().message();
  const auto picture = read_ldr_image(studio_.folder / "out-00001.png");
  ASSERT_TRUE(picture) << picture.error().message();
  EXPECT_EQ(picture->bytes, live->view().bytes);
  EXPECT_NE(picture->bytes, eight_bits(studio_.photo.texels)) << "an object stands in it";
}

TEST_F(LiveCamerasTest, nothing_is_made_ready_or_drawn_while_nobody_looks) {
  start();
  ASSERT_TRUE(within(20, [](const LiveReport& r) { return r.interior.source.whole > 10 && r.sky.source.whole > 10; }));
  const LiveReport r = status_.report();
  EXPECT_EQ(r.drawn + r.untouched + r.sky.used + r.interior.used, 0u);
  EXPECT_TRUE(starts(r, "idle")) << r.state;
}

TEST_F(LiveCamerasTest, each_camera_may_go_and_come_back_and_the_other_is_not_disturbed) {
  start();
  const PictureBoard::Viewer viewer(board_, PictureBoard::Wants::view);
  ASSERT_TRUE(within(20, [](const LiveReport& r) { return r.drawn > 0; })) << to_json(status_.report());

  sky_->unplug();
  ASSERT_TRUE(within(10, [](const LiveReport& r) { return starts(r, "sky camera away"); })) << status_.report().state;
  const std::uint64_t drawn = status_.report().drawn;
  EXPECT_TRUE(within(5, [&](const LiveReport& r) { return r.drawn > drawn + 5; })) << "under the last good sky";
  EXPECT_GT(status_.report().sky_age_s, 1.0);
  sky_->plug_in();
  EXPECT_TRUE(within(10, [](const LiveReport& r) {
    return r.sky.source.connections == 2 && r.sky_age_s < 0.5 * kSlower;
  })) << to_json(status_.report());

  interior_->unplug();
  ASSERT_TRUE(within(10, [](const LiveReport& r) { return starts(r, "interior camera away"); }))
      << status_.report().state;
  EXPECT_GT(status_.report().picture_age_s, 0.5);
  interior_->plug_in();
  EXPECT_TRUE(within(10, [](const LiveReport& r) {
    return r.interior.source.connections == 2 && r.picture_age_s < 0.5 * kSlower;
  })) << to_json(status_.report());
  EXPECT_EQ(status_.report().sky.source.connections, 2u) << "the sky's camera stayed open";
}

/// A port that was free a moment ago.
int free_port() {
  const auto server = HttpServer::start({"127.0.0.1", 0, ""}, {});
  return server ? (*server)->port() : 0;
}

/// /status of the daemon at the port; empty: it does not answer.
std::string status_at(int port) {
  const int s = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
  const std::string ask = "GET /status HTTP/1.1\r\nHost: localhost\r\n\r\n";
  std::string text;
  char buffer[4096];
  if (connect(s, reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0 && send(s, ask.data(), ask.size(), 0) > 0)
    for (ssize_t got = 0; (got = recv(s, buffer, sizeof(buffer), 0)) > 0;)
      text.append(buffer, static_cast<std::size_t>(got));
  close(s);
  return text;
}

TEST_F(LiveCamerasTest, a_recording_that_ends_early_is_told_at_the_end_of_the_run) {
  const auto tape = studio_.folder / "tape";
  LiveOptions options;
  options.record = tape;
  options.frames = 30;
  options.backend = Backend::rays;
  options.quiet = true;
  Result<void> ended;
  std::thread daemon([&] { ended = run_live(studio_.config, options, [](const DrawnFrame&) {}); });
  std::error_code none;
  for (const double end = wall_seconds() + 10 * kSlower;
       wall_seconds() < end && !std::filesystem::exists(tape / "sky" / "frames.jsonl");)
    std::this_thread::sleep_for(1ms);
  for (int k = 0; k < 100 && (std::filesystem::remove_all(tape / "sky", none), std::filesystem::exists(tape / "sky"));
       ++k)
    std::this_thread::sleep_for(1ms);
  daemon.join();
  ASSERT_FALSE(ended);
  EXPECT_EQ(exit_code(ended.error()), kExitFailed);
  EXPECT_NE(ended.error().message().find("the recording ended before the run did (sky: "), std::string::npos)
      << ended.error().message();
}

TEST_F(LiveCamerasTest, pictures_that_cannot_be_written_are_told_before_a_camera_is_touched) {
  LiveOptions options;
  options.frames = 3;
  options.backend = Backend::rays;
  options.quiet = true;
  int drawn = 0;
  const auto draw = [&] { return run_live(studio_.config, options, [&](const DrawnFrame&) { ++drawn; }); };
  studio_.config.output = {};
  const auto nowhere = draw();
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().message().find("no file is named"), std::string::npos) << nowhere.error().message();
  studio_.config.output.png = studio_.folder / "out.png";
  const auto theirs = studio_.folder / "out-00002.png";
  std::ofstream(theirs) << "a letter";
  const auto refused = draw();
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message().find("--force"), std::string::npos) << refused.error().message();
  EXPECT_EQ(drawn, 0);
  options.force = true;
  const auto done = draw();
  EXPECT_TRUE(done) << done.error().message();
  EXPECT_EQ(drawn, 3);
  EXPECT_TRUE(read_ldr_image(theirs));
}

TEST_F(LiveCamerasTest, pictures_asked_for_are_counted_on_after_a_reload) {
  studio_.config.output.png = studio_.folder / "out.png";
  LiveOptions options;
  options.config = studio_.folder / "config.toml";
  options.frames = 60;
  options.backend = Backend::rays;
  options.quiet = true;
  std::ofstream(options.config) << to_toml(studio_.config);
  const auto config = read_run_config(options.config);
  ASSERT_TRUE(config) << config.error().message();
  watch_for_reload();
  int drawn = 0;
  testing::internal::CaptureStderr();
  const auto done = run_live(*config, options, [&](const DrawnFrame&) {
    if (++drawn == 3)
      std::raise(SIGHUP);
    std::this_thread::sleep_for(20ms); // of 60, enough to load it
  });
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(done) << done.error().message();
  EXPECT_NE(said.find("the new configuration is in use"), std::string::npos) << said;
  EXPECT_EQ(drawn, options.frames);
  EXPECT_TRUE(std::filesystem::exists(studio_.folder / "out-00059.png"));
  EXPECT_FALSE(std::filesystem::exists(studio_.folder / "out-00060.png"));
}

/// What systemd listens on.
class NotifySocket {
public:
  NotifySocket() : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    const std::string name = "daylit-live-" + std::to_string(getpid());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path + 1, sizeof address.sun_path - 1);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), size), 0);
    setenv("NOTIFY_SOCKET", ("@" + name).c_str(), 1);
  }
  ~NotifySocket() {
    close(socket_);
    unsetenv("NOTIFY_SOCKET");
  }
  /// Times that the watchdog was fed since the last call.
  int fed() const {
    int count = 0;
    std::array<char, 512> text{};
    for (ssize_t n = 0; (n = recv(socket_, text.data(), text.size(), 0)) > 0;)
      count += std::string_view(text.data(), static_cast<std::size_t>(n)).find("WATCHDOG=1") != std::string_view::npos;
    return count;
  }

private:
  int socket_;
};

/// Last: SIGTERM ends everything that asks interrupted().
TEST_F(LiveCamerasTest, z_signals_reload_the_configuration_and_end_the_run) {
  const NotifySocket systemd;
  const auto file = studio_.folder / "config.toml";
  const int port = free_port();
  studio_.config.http = HttpConfig{port, "127.0.0.1", {}};
  const std::string good = to_toml(studio_.config);
  std::ofstream(file) << good;
  const auto config = read_run_config(file);
  ASSERT_TRUE(config) << config.error().message();
  Result<void> ended = Error{ErrorCode::io, "not ended", "", ""};
  watch_for_interrupt();
  watch_for_reload();
  std::thread daemon([&] {
    LiveOptions options;
    options.config = file;
    options.backend = Backend::rays;
    options.quiet = true;
    ended = run_live(*config, options, [](const DrawnFrame&) {});
  });
  const auto says = [&](const std::string& words) {
    for (const double end = wall_seconds() + 15 * kSlower; wall_seconds() < end; std::this_thread::sleep_for(5ms))
      if (status_at(port).find(words) != std::string::npos)
        return true;
    return false;
  };
  EXPECT_TRUE(says(R"("connected":true)"));
  std::ofstream(file) << good << "\n[lights]\n";
  std::raise(SIGHUP);
  EXPECT_TRUE(says("did you mean 'light'")) << status_at(port);
  EXPECT_NE(status_at(port).find(R"("reloads":{"done":0,"refused":1)"), std::string::npos) << status_at(port);
  std::ofstream(file) << good;
  std::raise(SIGHUP);
  EXPECT_TRUE(says(R"("reloads":{"done":1,"refused":1)")) << status_at(port);
  EXPECT_TRUE(says(R"("interior":{"connected":true)")) << "opened again by the new configuration";
  interior_->unplug();
  EXPECT_TRUE(says("interior camera away")) << status_at(port);
  (void)systemd.fed();
  std::this_thread::sleep_for(2500ms);
  EXPECT_GE(systemd.fed(), 1) << "it would be started again, which brings no camera back";
  const double begin = wall_seconds();
  std::raise(SIGTERM);
  daemon.join();
  EXPECT_LT(wall_seconds() - begin, 0.5 * kSlower);
  EXPECT_TRUE(ended) << ended.error().message();
}

} // namespace
} // namespace daylit
