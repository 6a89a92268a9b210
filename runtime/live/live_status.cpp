#include "runtime/live/live_status.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/input/camera_pose.h"

namespace daylit {

namespace {

using namespace std::chrono_literals;

constexpr auto kWindow = 5s;
constexpr std::size_t kMostLatencies = 1000, kMostTimes = 5000;

double seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

std::string without_digits(std::string text) {
  std::erase_if(text, [](char c) { return c >= '0' && c <= '9'; });
  return text;
}

/// The value that the fraction `q` of all does not exceed; 0 of none.
double quantile(std::vector<double> values, double q) {
  if (values.empty())
    return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

} // namespace

void LiveStatus::picture(const DrawnFrame& frame, const FrameReport& stages, double latency_s) {
  const std::lock_guard lock(mutex_);
  last_picture_ = Clock::now();
  times_.push_back(last_picture_);
  if (times_.size() > kMostTimes)
    times_.pop_front();
  latencies_s_.push_back(latency_s);
  if (latencies_s_.size() > kMostLatencies)
    latencies_s_.pop_front();
  report_.latency_sum_s += latency_s;
  ++(frame.drawn ? report_.drawn : report_.untouched);
  report_.last = frame;
  if (frame.drawn)
    report_.stages = stages;
}

void LiveStatus::reloaded(const std::string& refused) {
  const std::lock_guard lock(mutex_);
  ++(refused.empty() ? report_.reloads : report_.reloads_refused);
  report_.last_reload = refused;
}

bool LiveStatus::set(const std::string& state, double sky_age_s, int viewers, const CameraReport& sky,
                     const CameraReport& interior, const std::optional<RecorderReport>& sky_recording,
                     const std::optional<RecorderReport>& interior_recording) {
  const std::lock_guard lock(mutex_);
  last_set_ = Clock::now();
  const bool other = without_digits(report_.state) != without_digits(state);
  report_.state = state;
  report_.sky_age_s = sky_age_s;
  report_.viewers = viewers;
  report_.sky = sky;
  report_.interior = interior;
  report_.sky_recording = sky_recording;
  report_.interior_recording = interior_recording;
  return other;
}

LiveReport LiveStatus::report() const {
  std::unique_lock lock(mutex_);
  LiveReport r = report_;
  const std::vector<double> latencies(latencies_s_.begin(), latencies_s_.end());
  const auto now = Clock::now();
  const auto recent = std::count_if(times_.begin(), times_.end(), [&](auto t) { return now - t < kWindow; });
  r.picture_age_s = last_picture_ == Clock::time_point() ? -1 : seconds(now - last_picture_);
  r.uptime_s = seconds(now - start_);
  lock.unlock();
  r.pictures_per_s = static_cast<double>(recent) / std::min(seconds(kWindow), std::max(r.uptime_s, 1e-3));
  r.latency_median_ms = 1e3 * quantile(latencies, 0.5);
  r.latency_99_ms = 1e3 * quantile(latencies, 0.99);
  return r;
}

double LiveStatus::silence_s() const {
  const std::lock_guard lock(mutex_);
  return seconds(Clock::now() - last_set_);
}

namespace {

using Json = nlohmann::ordered_json;

Json or_null(double age_s) { return age_s < 0 ? Json() : Json(age_s); }

Json to_json(const CameraReport& c) {
  return {{"connected", c.source.connected},
          {"trouble", c.trouble},
          {"frame_age_s", or_null(c.frame_age_s)},
          {"frozen", c.frozen},
          {"whole", c.source.whole},
          {"superseded", c.source.superseded},
          {"damaged", c.source.damaged},
          {"missing", c.source.missing},
          {"used", c.used},
          {"refused", c.refused},
          {"black", c.black},
          {"connections", c.source.connections},
          {"likely_cause", c.likely_cause}};
}

Json to_json(const Rgb& rgb) { return {rgb.r, rgb.g, rgb.b}; }
Json or_null(const std::optional<Rgb>& rgb) { return rgb ? to_json(*rgb) : Json(); }

const char* sun_of(const SkyBalance& sky) {
  return sky.sun_restored ? "restored" : sky.sun_lost ? "lost" : sky.unexplained > 0 ? "over range" : "in range";
}

Json frame_json(const DrawnFrame& f) {
  const SkyBalance& sky = f.sky_balance;
  return {{"frame", f.index},
          {"interior_id", f.interior_id},
          {"sky_id", f.sky_id},
          {"sky_age_s", f.sky_age_s},
          {"sky_irradiance", to_json(sky.irradiance)},
          {"sky_irradiance_at_most", or_null(sky.irradiance_at_most())},
          {"sky_over_range", sky.over_range},
          {"sun", sun_of(sky)},
          {"no_reading", sky.no_reading},
          {"tracking", name_of(f.tracking)},
          {"drawn", f.drawn},
          {"total_ms", f.total_ms}};
}

Json to_json(const std::optional<RecorderReport>& r) {
  return r ? Json{{"recorded", r->recorded}, {"dropped", r->dropped}, {"trouble", r->trouble}} : Json();
}

struct Metric {
  std::string_view name, help, type;
};

void add(std::string& out, const Metric& m, double value) {
  out += fmt::format("# HELP daylit_{0} {1}\n# TYPE daylit_{0} {2}\ndaylit_{0} {3}\n", m.name, m.help, m.type, value);
}

using C = CameraReport;

struct CameraMetric {
  Metric metric;
  double (*value)(const C& c);
};

constexpr CameraMetric kCameraMetrics[] = {
    {{"camera_connected", "1: the camera is there", "gauge"},
     [](const C& c) { return c.source.connected ? 1.0 : 0.0; }},
    {{"camera_frozen", "1: the same picture for five seconds", "gauge"},
     [](const C& c) { return c.frozen ? 1.0 : 0.0; }},
    {{"camera_frames_whole_total", "Frames that arrived undamaged", "counter"},
     [](const C& c) { return static_cast<double>(c.source.whole); }},
    {{"camera_frames_used_total", "Frames made ready to draw from", "counter"},
     [](const C& c) { return static_cast<double>(c.used); }},
    {{"camera_frames_superseded_total", "Whole frames replaced by a newer one", "counter"},
     [](const C& c) { return static_cast<double>(c.source.superseded); }},
    {{"camera_frames_damaged_total", "Frames with packets lost, never used", "counter"},
     [](const C& c) { return static_cast<double>(c.source.damaged); }},
    {{"camera_frames_missing_total", "Gaps in the camera's counter", "counter"},
     [](const C& c) { return static_cast<double>(c.source.missing); }},
    {{"camera_frames_refused_total", "Frames of another size or format", "counter"},
     [](const C& c) { return static_cast<double>(c.refused); }},
    {{"camera_frames_black_total", "Sky frames without light, not used", "counter"},
     [](const C& c) { return static_cast<double>(c.black); }},
    {{"camera_connections_total", "How often the camera was opened", "counter"},
     [](const C& c) { return static_cast<double>(c.source.connections); }}};

void add_cameras(std::string& out, const LiveReport& r) {
  for (const auto& [m, value] : kCameraMetrics)
    out += fmt::format("# HELP daylit_{0} {1}\n# TYPE daylit_{0} {2}\ndaylit_{0}{{camera=\"sky\"}} {3}\n"
                       "daylit_{0}{{camera=\"interior\"}} {4}\n",
                       m.name, m.help, m.type, value(r.sky), value(r.interior));
}

void add_latency(std::string& out, const LiveReport& r) {
  out += fmt::format("# HELP daylit_latency_seconds From the camera's time stamp to the picture\n"
                     "# TYPE daylit_latency_seconds summary\n"
                     "daylit_latency_seconds{{quantile=\"0.5\"}} {}\ndaylit_latency_seconds{{quantile=\"0.99\"}} {}\n"
                     "daylit_latency_seconds_sum {}\ndaylit_latency_seconds_count {}\n",
                     1e-3 * r.latency_median_ms, 1e-3 * r.latency_99_ms, r.latency_sum_s, r.drawn + r.untouched);
}

void add_stages(std::string& out, const LiveReport& r) {
  out += "# HELP daylit_stage_seconds Time of a stage of the last picture\n# TYPE daylit_stage_seconds gauge\n";
  for (const auto& [name, ms] : r.stages.stage_ms)
    out += fmt::format("daylit_stage_seconds{{stage=\"{}\"}} {}\n", name, 1e-3 * ms);
}

struct RecordingMetric {
  Metric metric;
  double (*value)(const RecorderReport& r);
};

constexpr RecordingMetric kRecordingMetrics[] = {
    {{"recording_frames_total", "Frames on the disk", "counter"},
     [](const RecorderReport& r) { return static_cast<double>(r.recorded); }},
    {{"recording_dropped_total", "Frames that were not recorded: the disk is too slow, or full", "counter"},
     [](const RecorderReport& r) { return static_cast<double>(r.dropped); }},
    {{"recording_ended", "1: nothing more is recorded, after an error", "gauge"},
     [](const RecorderReport& r) { return r.trouble.empty() ? 0.0 : 1.0; }}};

/// Only of cameras that are recorded.
void add_recordings(std::string& out, const LiveReport& r) {
  if (!r.sky_recording && !r.interior_recording)
    return;
  for (const auto& [m, value] : kRecordingMetrics) {
    out += fmt::format("# HELP daylit_{0} {1}\n# TYPE daylit_{0} {2}\n", m.name, m.help, m.type);
    for (const auto& [camera, recording] : {std::pair{"sky", &r.sky_recording}, {"interior", &r.interior_recording}})
      if (*recording)
        out += fmt::format("daylit_{}{{camera=\"{}\"}} {}\n", m.name, camera, value(**recording));
  }
}

} // namespace

std::string to_json(const DrawnFrame& frame) { return frame_json(frame).dump(); }

std::string to_json(const LiveReport& r) {
  Json stages = Json::object();
  for (const auto& [name, ms] : r.stages.stage_ms)
    stages[name] = ms;
  stages["total"] = r.stages.total_ms;
  const Json json{{"state", r.state},
                  {"uptime_s", r.uptime_s},
                  {"drawn", r.drawn},
                  {"untouched", r.untouched},
                  {"pictures_per_s", r.pictures_per_s},
                  {"latency_ms", {{"median", r.latency_median_ms}, {"p99", r.latency_99_ms}}},
                  {"sky_age_s", or_null(r.sky_age_s)},
                  {"picture_age_s", or_null(r.picture_age_s)},
                  {"tracking", name_of(r.last.tracking)},
                  {"last", frame_json(r.last)},
                  {"stage_ms", stages},
                  {"viewers", r.viewers},
                  {"sky", to_json(r.sky)},
                  {"interior", to_json(r.interior)},
                  {"sky_recording", to_json(r.sky_recording)},
                  {"interior_recording", to_json(r.interior_recording)},
                  {"reloads", {{"done", r.reloads}, {"refused", r.reloads_refused}, {"trouble", r.last_reload}}},
                  {"warnings", r.stages.warnings}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string to_prometheus(const LiveReport& r) {
  std::string out;
  add(out, {"uptime_seconds", "Since the start", "gauge"}, r.uptime_s);
  add(out, {"pictures_drawn_total", "Pictures with the virtual objects", "counter"}, static_cast<double>(r.drawn));
  add(out, {"pictures_untouched_total", "Pictures left as they are: no pose or no sky", "counter"},
      static_cast<double>(r.untouched));
  add(out, {"pictures_per_second", "Over the last five seconds", "gauge"}, r.pictures_per_s);
  add_latency(out, r);
  add(out, {"sky_age_seconds", "Age of the sky in use, -1: there is none", "gauge"}, r.sky_age_s);
  add(out, {"sky_over_range_pixels", "Pixels of the sky that are brighter than the camera can show", "gauge"},
      static_cast<double>(r.last.sky_balance.over_range));
  add(out, {"picture_age_seconds", "Since the last picture, -1: there was none", "gauge"}, r.picture_age_s);
  add(out, {"tracking_lost", "1: the last picture had no pose", "gauge"}, r.last.tracking == TrackingState::lost);
  add(out, {"viewers", "Who want to see pictures", "gauge"}, r.viewers);
  add_stages(out, r);
  add_cameras(out, r);
  add_recordings(out, r);
  return out;
}

} // namespace daylit
