#include "runtime/cmd/live_command.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <future>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <malloc.h>

#include "capture/frames/camera_thread.h"
#include "runtime/base/service_notify.h"
#include "runtime/cmd/live_routes.h"
#include "runtime/cmd/local_viewers.h"
#include "runtime/live/live_run.h"
#include "runtime/output/outputs.h"
#include "runtime/page/page_files.h"
#include "runtime/page/scene_routes.h"
#include "scene/core/program.h"
#include "scene/core/read_file.h"
#include "scene/core/seconds.h"

namespace daylit {

namespace {

using namespace std::chrono_literals;
using LoadedRun = Result<std::unique_ptr<LiveRun>>;

constexpr double kFeedEvery_s = 1;
constexpr std::size_t kMostTokenBytes = 4096;
constexpr int kMemoryArenas = 4; ///< of the C library: one for each of 24 clients' threads would grow for hours

void say(const std::string& text) { std::fprintf(stderr, "daylit-run: %s\n", text.c_str()); }

bool go_on(const std::string&, double) { return !interrupted(); }

/// The secret in the file, without the line's end.
Result<std::string> read_token(const HttpConfig& http) {
  if (http.token_file.empty())
    return std::string();
  const auto bytes = read_whole_file(http.token_file, kMostTokenBytes);
  if (!bytes)
    return bytes.error();
  std::string token(bytes->begin(), bytes->end());
  token.erase(token.find_last_not_of(" \t\r\n") + 1);
  if (token.empty())
    return Error{ErrorCode::value_invalid, "is empty", http.token_file.string(), "make one with: openssl rand -hex 16"};
  return token;
}

struct CameraRecording {
  const char* camera;
  std::unique_ptr<Recorder> recorder; ///< null: it is not recorded
  bool end_told = false;
};

/// From the start to the end, through any number of configurations.
class Daemon {
public:
  Daemon(const RunConfig& config, const LiveOptions& options, const std::function<void(const DrawnFrame&)>& report)
      : config_(config), options_(options), report_(report), editor_(desk_, options.config, config) {}

  Result<void> run() {
    auto loaded = LiveRun::load(config_, options_.backend, go_on);
    if (!loaded)
      return loaded.error();
    if (const auto writable = check_pictures(config_); !writable)
      return writable;
    if (const auto begun = begin_outputs(**loaded); !begun)
      return begun;
    run_ = std::move(*loaded);
    notify_service(ServiceState::ready, "waiting for the cameras");
    Result<void> ended;
    do {
      print_notes();
      ended = run_->run(surroundings());
    } while (ended && take_next());
    notify_service(ServiceState::stopping);
    const Result<void> recorded = end_recordings();
    if (ended && !window_open_)
      return window_open_.error();
    if (ended && *window_open_ && options_.frames > 0 && pictures_ < options_.frames)
      return interrupted_error("picture " + std::to_string(pictures_));
    return ended ? recorded : ended;
  }

private:
  /// Those that --frames asks for and that are still to be drawn.
  Result<void> check_pictures(const RunConfig& config) const {
    if (options_.frames == 0)
      return {};
    const OutputConfig& output = config.output;
    if (output.png.empty() && output.exr.empty() && output.mask.empty() && options_.record.empty())
      return Error{ErrorCode::value_invalid, "--frames writes pictures, and no file is named for them",
                   options_.config.string(), "add a section [output] with png, exr or mask, or give --record"};
    for (int k = pictures_; k < options_.frames; ++k)
      if (const auto writable = check_outputs(numbered(output, static_cast<std::size_t>(k)), options_.force); !writable)
        return writable;
    return {};
  }

  void print_notes() const {
    for (const std::string& note : run_->notes())
      say(note);
  }

  Result<void> begin_outputs(const LiveRun& loaded) {
    if (!options_.record.empty())
      for (CameraRecording& r : recordings_) {
        auto begun = Recorder::start(options_.record / r.camera);
        if (!begun)
          return begun.error();
        r.recorder = std::move(*begun);
      }
    if (options_.window || !options_.shared.empty()) {
      const auto [width, height] = loaded.photo_size();
      auto viewers = LocalViewers::open(board_, options_.window, options_.shared, width, height);
      if (!viewers)
        return viewers.error();
      viewers_ = std::move(*viewers);
    }
    if (!config_.http) {
      if (options_.frames == 0 && options_.record.empty() && !viewers_)
        return Error{ErrorCode::value_invalid, "nobody would see the pictures", options_.config.string(),
                     "add a section [http], or give --window, --share, --frames or --record"};
      return {};
    }
    return begin_server(*config_.http);
  }

  Result<void> begin_server(const HttpConfig& http) {
    const auto token = read_token(http);
    if (!token)
      return token.error();
    server_.reset(); // its port may be the new one
    auto server = HttpServer::start({http.address, http.port, *token}, routes());
    if (!server)
      return server.error();
    server_ = std::move(*server);
    say("http://" + http.address + ":" + std::to_string(server_->port()) + "/");
    return {};
  }

  std::vector<HttpRoute> routes() {
    auto routes = live_routes(board_, status_);
    for (auto& more : {page_files(), scene_routes(desk_, editor_)})
      routes.insert(routes.end(), more.begin(), more.end());
    return routes;
  }

  LiveSurroundings surroundings() {
    LiveSurroundings around{board_, status_};
    around.sky_recorder = recordings_[0].recorder.get();
    around.interior_recorder = recordings_[1].recorder.get();
    around.frames = options_.frames > 0 ? options_.frames - pictures_ : 0;
    around.drawn = [this](const DrawnFrame& frame) {
      ++pictures_;
      report_(frame);
    };
    around.state_changed = [this](const std::string& state) {
      if (!options_.quiet)
        say(state);
    };
    around.between_frames = [this](Session& session, const SkyImage* sky) { desk_.serve({session, sky}); };
    around.go_on = [this] {
      feed_watchdog();
      tell_ended_recordings();
      return !interrupted() && is_window_open() && !next_is_loaded();
    };
    return around;
  }

  /// Each once, as soon as it has ended.
  void tell_ended_recordings() {
    for (CameraRecording& r : recordings_) {
      const RecorderReport report = r.recorder ? r.recorder->report() : RecorderReport{};
      if (report.trouble.empty() || std::exchange(r.end_told, true))
        continue;
      say(fmt::format("the recording of the {} camera has ended after {} frames: {}", r.camera, report.recorded,
                      report.trouble));
    }
  }

  /// Error io: one ended before the run did.
  Result<void> end_recordings() {
    bool whole = true;
    std::string frames;
    for (const CameraRecording& r : recordings_)
      if (r.recorder) {
        const RecorderReport report = r.recorder->finish();
        whole = whole && report.trouble.empty();
        frames += fmt::format("{}{}: {} frames recorded, {} not", frames.empty() ? "" : "; ", r.camera, report.recorded,
                              report.dropped);
      }
    tell_ended_recordings();
    if (!whole)
      return Error{ErrorCode::io, "the recording ended before the run did (" + frames + ")", options_.record.string(),
                   "free space on the disk"};
    return {};
  }

  bool is_window_open() {
    if (viewers_ && window_open_ && *window_open_)
      window_open_ = viewers_->follow();
    return window_open_ && *window_open_;
  }

  /// While pictures are drawn, frames come that nobody wants to see, or the interior camera is away: to start again
  /// would not bring it back.
  void feed_watchdog() {
    if (wall_seconds() - last_fed_ < kFeedEvery_s)
      return;
    last_fed_ = wall_seconds();
    const LiveReport r = status_.report();
    const std::uint64_t flow = r.viewers > 0 ? r.drawn + r.untouched : r.interior.source.whole;
    if (flow != last_flow_ || !r.interior.source.connected)
      notify_service(ServiceState::picture, r.state);
    last_flow_ = flow;
  }

  /// SIGHUP has the configuration read and loaded beside the run, which goes on until all of it is there. Another one
  /// meanwhile waits until that is in use and the cameras of before are closed; any number of them are one.
  bool next_is_loaded() {
    if (!loading_.valid() && !is_camera_leaving() && reload_requested()) {
      notify_service(ServiceState::reloading);
      loading_ = std::async(std::launch::async, [this]() -> LoadedRun {
        auto config = read_run_config(options_.config);
        if (!config)
          return config.error();
        if (!config->is_live())
          return Error{ErrorCode::value_invalid, "it names no cameras any more", options_.config.string(), ""};
        next_config_ = std::move(*config);
        return LiveRun::load(next_config_, options_.backend, go_on);
      });
    }
    if (!loading_.valid() || loading_.wait_for(0ms) != std::future_status::ready)
      return false;
    auto loaded = loading_.get();
    notify_service(ServiceState::ready);
    if (!loaded) {
      refuse_reload(loaded.error().message());
      return false;
    }
    if (const auto writable = check_pictures(next_config_); !writable) {
      refuse_reload(writable.error().message());
      return false;
    }
    next_ = std::move(*loaded);
    return true;
  }

  void refuse_reload(const std::string& why) {
    say("the configuration in use stays: " + why);
    status_.reloaded(why);
  }

  /// False: there is none, the daemon ends.
  bool take_next() {
    const bool all_drawn = options_.frames > 0 && pictures_ >= options_.frames;
    if (!next_ || all_drawn || interrupted() || !is_window_open())
      return false;
    run_ = std::move(next_);
    editor_.reset(next_config_);
    const std::optional<HttpConfig> before = std::exchange(config_, next_config_).http;
    const bool same = before.has_value() == config_.http.has_value() &&
                      (!before || (before->port == config_.http->port && before->address == config_.http->address &&
                                   before->token_file == config_.http->token_file));
    std::string trouble;
    if (!same && !config_.http)
      server_.reset();
    else if (!same)
      if (const auto begun = begin_server(*config_.http); !begun)
        trouble = begun.error().message();
    if (trouble.empty())
      say("the new configuration is in use");
    else
      say("the new configuration is in use, but not its [http]: " + trouble);
    status_.reloaded(trouble);
    return true;
  }

  RunConfig config_, next_config_; ///< the next one: of the thread that loads it until it is done
  const LiveOptions options_;
  const std::function<void(const DrawnFrame&)> report_;
  PictureBoard board_;
  LiveStatus status_;
  std::array<CameraRecording, 2> recordings_{{{"sky", nullptr}, {"interior", nullptr}}};
  std::unique_ptr<LiveRun> run_, next_;
  std::future<LoadedRun> loading_;
  SessionDesk desk_;
  SceneEditor editor_;
  std::unique_ptr<LocalViewers> viewers_;
  Result<bool> window_open_ = true;    ///< an error: it cannot go on, nor can the run
  std::unique_ptr<HttpServer> server_; ///< after what it shows
  int pictures_ = 0;
  double last_fed_ = 0;
  std::uint64_t last_flow_ = 0;
};

} // namespace

Result<void> run_live(const RunConfig& config, const LiveOptions& options,
                      const std::function<void(const DrawnFrame&)>& report) {
  mallopt(M_ARENA_MAX, kMemoryArenas);
  return Daemon(config, options, report).run();
}

} // namespace daylit
