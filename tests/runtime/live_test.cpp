// The parts of a live run, without cameras.

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <mutex>
#include <set>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "capture/frames/recording.h"
#include "runtime/cmd/live_routes.h"
#include "runtime/live/camera_stage.h"
#include "runtime/live/live_status.h"
#include "runtime/live/newest.h"
#include "runtime/live/picture_board.h"
#include "runtime/live/recorder.h"
#include "scene/core/seconds.h"

namespace daylit {
namespace {

using namespace std::chrono_literals;

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch() / 1ns; }

CameraFrame frame_of(std::uint64_t id, std::uint8_t value = 100, int width = 4) {
  CameraFrame f{width, 2, {Mosaic::mono, 8}, std::vector<std::uint8_t>(std::size_t(2 * width), value), id};
  f.bytes[0] = static_cast<std::uint8_t>(value / 2 + id % 2);
  f.taken_ns = now_ns();
  return f;
}

bool within(double seconds, const std::function<bool()>& happens) {
  for (const double end = wall_seconds() + seconds; wall_seconds() < end; std::this_thread::sleep_for(1ms))
    if (happens())
      return true;
  return happens();
}

/// Gives out what it was handed last.
class HandedSource final : public FrameSource {
public:
  void hand(CameraFrame frame) {
    const std::lock_guard lock(mutex_);
    frame_ = std::move(frame);
  }
  Result<std::optional<CameraFrame>> next(std::chrono::milliseconds) override {
    ++asked_;
    const std::lock_guard lock(mutex_);
    return std::exchange(frame_, std::nullopt);
  }
  bool finished() const override { return false; }
  SourceReport report() const override {
    SourceReport r;
    r.connected = true;
    return r;
  }
  int asked() const { return asked_; }

private:
  std::mutex mutex_;
  std::optional<CameraFrame> frame_;
  std::atomic<int> asked_ = 0;
};

TEST(Newest, the_newest_value_wins_and_is_given_once) {
  Newest<int> place;
  EXPECT_FALSE(place.take(0ms));
  place.put(1);
  place.put(2);
  EXPECT_FALSE(place.wait_until_taken(0ms));
  EXPECT_EQ(place.take(0ms), 2);
  EXPECT_TRUE(place.wait_until_taken(0ms));
  EXPECT_FALSE(place.take(0ms));
}

TEST(CameraStage, works_on_the_newest_frame_and_only_while_its_results_are_wanted_and_taken) {
  HandedSource source;
  CameraWatch watch(4, 2, false);
  std::atomic<int> made = 0;
  CameraStage<std::uint64_t> stage(source, watch, 1.0,
                                   [&](const CameraFrame& f) -> Result<std::optional<std::uint64_t>> {
                                     ++made;
                                     return std::optional(f.id);
                                   });
  source.hand(frame_of(1));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(source.asked(), 0) << "nobody wants it";
  source.hand(frame_of(2));
  stage.want(true);
  ASSERT_TRUE(within(5, [&] { return made == 1; }));
  source.hand(frame_of(3));
  source.hand(frame_of(4));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(made, 1) << "the last result was not taken";
  EXPECT_EQ(stage.take(0ms), 2u);
  EXPECT_EQ(stage.take(5000ms), 4u) << "frame 3 was superseded";
  CameraFrame old = frame_of(5);
  old.taken_ns -= 2'000'000'000;
  source.hand(old);
  EXPECT_FALSE(stage.take(30ms)) << "of another moment";
  EXPECT_EQ(stage.report().used, 2u);
}

TEST(CameraStage, begins_as_late_as_the_next_result_is_in_time) {
  HandedSource source;
  CameraWatch watch(4, 2, false);
  CameraStage<std::uint64_t> stage(
      source, watch, 1.0,
      [](const CameraFrame& f) -> Result<std::optional<std::uint64_t>> { return std::optional(f.id); });
  stage.want(true);
  source.hand(frame_of(1));
  EXPECT_EQ(stage.take(5000ms, 100ms), 1u);
  source.hand(frame_of(2));
  std::this_thread::sleep_for(50ms);
  source.hand(frame_of(3));
  EXPECT_EQ(stage.take(5000ms), 3u) << "the younger one";
}

TEST(CameraStage, what_cannot_be_read_is_counted_and_said) {
  HandedSource source;
  CameraWatch watch(4, 2, false);
  CameraStage<int> stage(source, watch, 1.0, [&](const CameraFrame&) -> Result<std::optional<int>> {
    return Error{ErrorCode::value_invalid, "no such response", "", ""};
  });
  stage.want(true);
  source.hand(frame_of(1));
  ASSERT_TRUE(within(5, [&] { return stage.report().refused == 1; }));
  EXPECT_EQ(stage.report().trouble, "no such response");
}

TEST(CameraWatch, frames_of_another_size_and_black_skies_are_not_used) {
  CameraWatch sky(4, 2, true), room(4, 2, false);
  EXPECT_TRUE(sky.accept(frame_of(1)));
  EXPECT_FALSE(sky.accept(frame_of(2, 1))) << "a 256th of the range";
  EXPECT_TRUE(room.accept(frame_of(2, 1))) << "a dark room is a room";
  EXPECT_FALSE(sky.accept(frame_of(3, 100, 6)));
  SourceReport source;
  source.connected = true;
  EXPECT_EQ(sky.report(source).black, 1u);
  EXPECT_EQ(sky.report(source).refused, 1u);
  EXPECT_NE(sky.report(source).trouble.find("6 x 2"), std::string::npos) << sky.report(source).trouble;
  sky.used(frame_of(4));
  EXPECT_EQ(sky.report(source).trouble, "");
  EXPECT_GE(sky.report(source).frame_age_s, 0.0);
}

TEST(CameraWatch, the_same_picture_for_long_is_a_frozen_camera) {
  CameraWatch watch(4, 2, false, 20ms);
  SourceReport source;
  source.connected = true;
  watch.accept(frame_of(1));
  EXPECT_FALSE(watch.report(source).frozen);
  std::this_thread::sleep_for(25ms);
  watch.accept(frame_of(3)); // the same bits
  EXPECT_TRUE(watch.report(source).frozen);
  watch.accept(frame_of(4));
  EXPECT_FALSE(watch.report(source).frozen);
  std::this_thread::sleep_for(25ms);
  EXPECT_FALSE(watch.report(source).frozen) << "nobody looked at its frames meanwhile";
}

TEST(CameraWatch, a_picture_with_nothing_in_it_is_called_black_or_white) {
  CameraWatch watch(4, 2, false);
  const auto blank = [&](const CameraFrame& frame) {
    EXPECT_TRUE(watch.accept(frame));
    return watch.report({}).blank;
  };
  EXPECT_EQ(blank(frame_of(1, 1)), "black");
  EXPECT_EQ(blank(frame_of(2, 100)), "");
  CameraFrame frame = frame_of(3, 252);
  EXPECT_EQ(blank(frame), "") << "one sample is not";
  frame.bytes[0] = 252;
  EXPECT_EQ(blank(frame), "white");
  CameraFrame deep{4, 2, {Mosaic::mono, 12}, {}, 4};
  for (int k = 0; k < 8; ++k)
    deep.bytes.insert(deep.bytes.end(), {0xf0, 0x0f});
  EXPECT_EQ(blank(deep), "white");
  deep.bytes[5] = 0x0a;
  EXPECT_EQ(blank(deep), "");
}

TEST(CameraWatch, losses_are_explained) {
  const CameraWatch watch(4, 2, false);
  SourceReport source;
  source.connected = true;
  EXPECT_EQ(watch.report(source).likely_cause, "");
  source.damaged = 3;
  EXPECT_NE(watch.report(source).likely_cause.find("packet_size"), std::string::npos);
  source.missing = 9;
  EXPECT_NE(watch.report(source).likely_cause.find("frame_rate"), std::string::npos);
}

TEST(PictureBoard, viewers_are_counted_and_given_each_picture_once) {
  PictureBoard board;
  EXPECT_EQ(board.viewers(), 0);
  {
    PictureBoard::Viewer viewer(board, PictureBoard::Wants::linear);
    EXPECT_EQ(board.viewers(), 1);
    EXPECT_TRUE(board.wants_linear());
    EXPECT_FALSE(viewer.after(0, 0ms));
    board.publish({2, 2, std::vector<std::uint8_t>(12, 80)}, {});
    const auto picture = viewer.after(0, 0ms);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->index(), 1u);
    EXPECT_EQ(picture->jpeg().substr(0, 2), "\xff\xd8");
    EXPECT_FALSE(viewer.after(1, 0ms));
  }
  EXPECT_EQ(board.viewers(), 0);
}

/// A folder that goes with the test.
struct Folder {
  std::filesystem::path path;
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-live-XXXXXX").string();
    path = mkdtemp(pattern.data());
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

TEST(Recorder, all_that_is_offered_can_be_replayed) {
  const Folder folder;
  {
    auto recorder = Recorder::start(folder.path / "sky");
    ASSERT_TRUE(recorder) << recorder.error().message();
    for (std::uint64_t k = 0; k < 10; ++k)
      (*recorder)->offer(frame_of(k));
  }
  const auto recording = Recording::open(folder.path / "sky");
  ASSERT_TRUE(recording) << recording.error().message();
  EXPECT_EQ(recording->size(), 10u);
  EXPECT_EQ(recording->read(9)->id, 9u);
  EXPECT_FALSE(Recorder::start(folder.path / "sky")) << "there is one already";
}

TEST(Recorder, a_disk_that_takes_nothing_ends_the_recording_and_nothing_else) {
  const Folder folder;
  auto recorder = Recorder::start(folder.path / "sky");
  ASSERT_TRUE(recorder);
  std::filesystem::remove_all(folder.path / "sky");
  (*recorder)->offer(frame_of(1));
  ASSERT_TRUE(within(5, [&] { return !(*recorder)->report().trouble.empty(); }));
  (*recorder)->offer(frame_of(2));
  EXPECT_EQ((*recorder)->report().recorded, 0u);
  EXPECT_EQ((*recorder)->report().dropped, 2u);
  LiveStatus status;
  status.set("drawing", 0, 0, {}, {}, (*recorder)->finish(), std::nullopt);
  const std::string metrics = to_prometheus(status.report());
  EXPECT_NE(metrics.find("\ndaylit_recording_dropped_total{camera=\"sky\"} 2\n"), std::string::npos) << metrics;
  EXPECT_NE(metrics.find("\ndaylit_recording_ended{camera=\"sky\"} 1\n"), std::string::npos) << metrics;
}

/// A status after four pictures, one of them untouched.
void fill(LiveStatus& status) {
  FrameReport stages;
  stages.stage_ms = {{"sky", 2.5}};
  stages.warnings = {"it is \"dark\"\n"};
  for (const double latency : {0.01, 0.02, 0.03, 0.5}) {
    DrawnFrame frame;
    frame.drawn = latency < 0.1;
    frame.tracking = frame.drawn ? TrackingState::measured : TrackingState::lost;
    status.picture(frame, stages, latency);
  }
  EXPECT_TRUE(status.set("drawing", 0.25, 2, {}, {}, RecorderReport{7, 1, ""}, std::nullopt));
  EXPECT_FALSE(status.set("drawing", 0.25, 2, {}, {}, RecorderReport{7, 1, ""}, std::nullopt));
}

TEST(LiveStatus, is_told_as_json) {
  LiveStatus status;
  fill(status);
  const auto json = nlohmann::json::parse(to_json(status.report()));
  EXPECT_EQ(json["state"], "drawing");
  EXPECT_EQ(json["drawn"], 3);
  EXPECT_EQ(json["untouched"], 1);
  EXPECT_EQ(json["tracking"], "lost");
  EXPECT_NEAR(json["latency_ms"]["median"].get<double>(), 20, 1e-9);
  EXPECT_NEAR(json["latency_ms"]["p99"].get<double>(), 30, 1e-9);
  EXPECT_EQ(json["sky_age_s"], 0.25);
  EXPECT_EQ(json["stage_ms"]["sky"], 2.5);
  EXPECT_EQ(json["sky"]["connected"], false);
  EXPECT_TRUE(json["sky"]["frame_age_s"].is_null()) << "there was none";
  EXPECT_EQ(json["sky_recording"]["recorded"], 7);
  EXPECT_TRUE(json["interior_recording"].is_null());
}

TEST(LiveStatus, a_sky_over_range_has_an_unknown_upper_bound) {
  DrawnFrame frame;
  EXPECT_EQ(nlohmann::json::parse(to_json(frame))["sun"], "in range");
  frame.sky_balance = {500, 500, false, false, Rgb(2.0f)};
  const auto json = nlohmann::json::parse(to_json(frame));
  EXPECT_EQ(json["sun"], "over range");
  EXPECT_EQ(json["sky_irradiance"][0], 2.0);
  EXPECT_TRUE(json["sky_irradiance_at_most"].is_null());
}

TEST(LiveStatus, a_number_that_goes_on_is_no_other_state) {
  LiveStatus status;
  const auto is_news = [&](const char* state) { return status.set(state, 0, 0, {}, {}, std::nullopt, std::nullopt); };
  EXPECT_TRUE(is_news("sky camera black: its last good picture is 3 s old"));
  EXPECT_FALSE(is_news("sky camera black: its last good picture is 14 s old"));
  EXPECT_EQ(status.report().state, "sky camera black: its last good picture is 14 s old");
  EXPECT_TRUE(is_news("drawing"));
}

TEST(LiveStatus, is_told_to_prometheus_line_by_line) {
  LiveStatus status;
  fill(status);
  std::istringstream text(to_prometheus(status.report()));
  std::set<std::string> typed;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string first, second;
    words >> first >> second;
    if (first == "#") {
      std::string name;
      words >> name;
      EXPECT_TRUE(second == "HELP" || typed.insert(name).second) << line;
      continue;
    }
    std::string name = first.substr(0, first.find('{'));
    for (const char* suffix : {"_sum", "_count"})
      if (name.ends_with(suffix))
        name.resize(name.size() - std::string(suffix).size());
    EXPECT_TRUE(typed.contains(name)) << line;
    EXPECT_NO_THROW((void)std::stod(second)) << line;
  }
  EXPECT_GE(typed.size(), 18u);
  EXPECT_NE(to_prometheus(status.report()).find("\ndaylit_pictures_drawn_total 3\n"), std::string::npos);
}

HttpReply ask(const std::vector<HttpRoute>& routes, const std::string& path) {
  for (const HttpRoute& route : routes)
    if (route.path == path)
      return route.handler({path, "", {}});
  return {404, "", ""};
}

TEST(LiveRoutes, pictures_are_drawn_for_a_stream_as_long_as_it_is_watched) {
  PictureBoard board;
  LiveStatus status;
  const auto routes = live_routes(board, status);
  {
    const HttpReply reply = ask(routes, "/stream.mjpg");
    EXPECT_EQ(board.viewers(), 1);
    board.publish({2, 2, std::vector<std::uint8_t>(12, 80)}, {});
    const auto part = reply.stream();
    ASSERT_TRUE(part);
    EXPECT_EQ(part->substr(0, 38), "--daylit\r\nContent-Type: image/jpeg\r\nCo");
    EXPECT_EQ(*reply.stream(), "") << "each picture once";
  }
  EXPECT_EQ(board.viewers(), 0);
}

TEST(LiveRoutes, a_snapshot_is_the_next_picture_linear_where_that_is_asked_for) {
  PictureBoard board;
  LiveStatus status;
  const auto routes = live_routes(board, status);
  std::jthread run([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(1ms))
      if (board.viewers() > 0)
        board.publish({2, 2, std::vector<std::uint8_t>(12, 80)}, board.wants_linear() ? RgbImage(2, 2) : RgbImage{});
  });
  const HttpReply png = ask(routes, "/snapshot.png"), exr = ask(routes, "/snapshot.exr");
  EXPECT_EQ(png.status, 200);
  EXPECT_EQ(png.body.substr(1, 3), "PNG");
  EXPECT_EQ(exr.status, 200);
  EXPECT_EQ(exr.body.substr(0, 4), "\x76\x2f\x31\x01");
  EXPECT_EQ(board.viewers(), 0);
}

TEST(LiveRoutes, health_and_readiness_follow_the_run) {
  PictureBoard board;
  LiveStatus status;
  const auto routes = live_routes(board, status);
  EXPECT_EQ(ask(routes, "/healthz").status, 200);
  EXPECT_EQ(ask(routes, "/readyz").status, 503) << "no camera yet";
  CameraReport sky, interior;
  sky.source.connections = 1;
  interior.source.connected = true;
  status.set("drawing", 0, 0, sky, interior, std::nullopt, std::nullopt);
  EXPECT_EQ(ask(routes, "/readyz").status, 200);
  EXPECT_EQ(ask(routes, "/events").stream()->substr(0, 20), "event: status\ndata: ");
}

} // namespace
} // namespace daylit
