// daylit-bench frame: table 1 of Grosch, Eble, Mueller 2007 again, every time beside its error.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <tbb/parallel_invoke.h>

#include "bench/command.h"
#include "bench/flicker.h"
#include "bench/frame_scene.h"
#include "bench/timing.h"
#include "capture/markers/marker_pose.h"
#include "capture/markers/marker_tracker.h"

namespace daylit::bench {

namespace {

constexpr int kPhotos = 12;

struct Arguments {
  std::string folder = "out/bench-frame";
  std::vector<std::string> objects{"teapot", "blob"}, skies{"overcast", "sun"}, renderers{"rays", "gl"};
  std::vector<int> samples{16, 64, 256}, map_texels{RenderSettings{}.map_texels};
  std::vector<int> reflections{ShownParts{}.reflections};
  bool without_shadows = false;
  std::string reflect_by = "rays";
  int frames = 20, flicker_frames = 100, reference_samples = 4096;
};

/// Medians over frames.
struct Timing {
  std::vector<double> wall_ms, cpu_ms;
  std::map<std::string, std::vector<double>> stages;
  std::vector<double> shadow_rays, glossy_pixels, glossy_rays;
  void add(double wall, double cpu, const FrameReport& report) {
    wall_ms.push_back(1e3 * wall);
    cpu_ms.push_back(1e3 * cpu);
    for (const auto& [name, ms] : report.stage_ms)
      stages[name].push_back(ms);
    shadow_rays.push_back(static_cast<double>(report.shadow_rays));
    glossy_pixels.push_back(static_cast<double>(report.glossy_pixels));
    glossy_rays.push_back(static_cast<double>(report.glossy_rays));
  }
};

nlohmann::json to_json(const Timing& t) {
  nlohmann::json j{
      {"wall_ms", median(t.wall_ms)},         {"wall_ms_best", *std::min_element(t.wall_ms.begin(), t.wall_ms.end())},
      {"cpu_ms", median(t.cpu_ms)},           {"frames_per_second", 1e3 / median(t.wall_ms)},
      {"shadow_rays", median(t.shadow_rays)}, {"glossy_pixels", median(t.glossy_pixels)},
      {"glossy_rays", median(t.glossy_rays)}};
  for (const auto& [name, ms] : t.stages)
    j["stage_ms"][name] = median(ms);
  return j;
}

enum class Motion { everything, object, nothing };

const char* name_of(Motion m) {
  return m == Motion::everything ? "moving" : m == Motion::object ? "object moving" : "nothing changed";
}

Result<MarkerPose> find_pose(const FrameScene& scene, MarkerTracker& tracker, const Rgb8Image& picture) {
  const auto seen = tracker.find(picture);
  if (!seen)
    return seen.error();
  return marker_pose(*seen, scene.interior_lens, tracker.board(), scene.config.marker->world_from_board);
}

/// One frame as a live system does it. Everything: a new sky, a new camera picture, the marker found in it.
Result<void> one_frame(const FrameScene& scene, Session& session, MarkerTracker& tracker, Motion motion, int k,
                       Timing& timing) {
  const double cpu = process_seconds(), wall = wall_seconds();
  const std::size_t which = motion == Motion::everything ? static_cast<std::size_t>(k) % scene.photos.size() : 0;
  double marker_ms = 0.0;
  if (motion == Motion::everything) {
    Result<MarkerPose> pose = Error{};
    tbb::parallel_invoke([&] { session.measure_sky(scene.skies[which], which + 1); },
                         [&] {
                           pose = find_pose(scene, tracker, scene.photo_bytes[which]);
                           marker_ms = 1e3 * (wall_seconds() - wall);
                         });
    if (!pose)
      return pose.error();
    if (const auto r = session.set_pose(pose->world_from_camera); !r)
      return r;
  } else if (motion == Motion::object) {
    ObjectConfig placement = scene.config.objects[0];
    placement.position.x += 0.002 * (k % 8);
    placement.rotation_deg.z += 3.0 * (k % 8);
    if (const auto r = session.set_placement(0, placement); !r)
      return r;
  }
  const auto frame = session.render({scene.skies[which], scene.photos[which], which + 1, which + 1});
  if (!frame)
    return frame.error();
  FrameReport report = (*frame)->report;
  if (motion == Motion::everything)
    report.stage_ms.emplace_back("marker", marker_ms);
  timing.add(wall_seconds() - wall, process_seconds() - cpu, report);
  return {};
}

Result<nlohmann::json> time_motion(const FrameScene& scene, Session& session, Motion motion, int frames) {
  Timing warm_up, timing;
  const MarkerConfig& marker = *scene.config.marker;
  MarkerTracker tracker(BoardLayout::single(marker.dictionary, marker.ids.at(0), marker.size_m));
  for (int k = 0; k < frames + 2; ++k)
    if (const auto r = one_frame(scene, session, tracker, motion, k, k < 2 ? warm_up : timing); !r)
      return r.error();
  return to_json(timing);
}

/// RMS of the difference over the object's pixels, by the mean of the reference there.
double object_error(const Composite& tested, const Composite& reference) {
  double square = 0.0, mean = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < reference.touched.size(); ++i) {
    if (reference.touched[i] != 2 || tested.touched[i] != 2)
      continue;
    for (int c = 0; c < 3; ++c) {
      const double t = static_cast<double>(reference.picture.texels[i][c]);
      const double d = static_cast<double>(tested.picture.texels[i][c]) - t;
      square += d * d;
      mean += t;
      ++count;
    }
  }
  return count ? std::sqrt(square / static_cast<double>(count)) / (mean / static_cast<double>(count)) : 0.0;
}

Result<Composite> still_picture(const FrameScene& scene, Session& session, int samples) {
  session.set_light_samples(samples);
  if (const auto r = session.set_pose(*scene.config.world_from_camera); !r)
    return r.error();
  if (const auto r = session.set_placement(0, scene.config.objects[0]); !r)
    return r.error();
  const auto frame = session.render({scene.skies[0], scene.photos[0], 1, 1});
  if (!frame)
    return frame.error();
  return (*frame)->composite;
}

/// `map_texels`: of a shadow map by OpenGL. "exact": every pixel traces every light.
Result<Session> open(const FrameScene& scene, const std::string& renderer, int map_texels) {
  const Backend backend = renderer == "gl"      ? Backend::opengl
                          : renderer == "exact" ? Backend::rays_reference
                                                : Backend::rays;
  return Session::open(scene.config, kFrameWidth, kFrameHeight,
                       [](const std::string&, double) { return !interrupted(); }, backend, {.map_texels = map_texels});
}

void print(const nlohmann::json& row) {
  std::printf("%-8s %-9s %-5s %4d", row["object"].get<std::string>().c_str(), row["sky"].get<std::string>().c_str(),
              row["renderer"].get<std::string>().c_str(), row["samples"].get<int>());
  for (const Motion m : {Motion::everything, Motion::object, Motion::nothing})
    std::printf(" %8.2f/%7.2f", row[name_of(m)]["wall_ms"].get<double>(), row[name_of(m)]["cpu_ms"].get<double>());
  std::printf(" %8.2f %9.3f %6.1f %7.0f\n", 100 * row["error"].get<double>(), 100 * row["flicker"].get<double>(),
              100 * row["object_fraction"].get<double>(), row["moving"]["glossy_rays"].get<double>());
}

std::vector<std::pair<int, int>> pairs_of(const std::vector<int>& first, const std::vector<int>& second) {
  std::vector<std::pair<int, int>> pairs;
  for (const int a : first)
    for (const int b : second)
      pairs.emplace_back(a, b);
  return pairs;
}

Result<void> measure(const Arguments& a, const FrameScene& scene, const std::string& renderer, int map_texels,
                     const Composite& reference, const nlohmann::json& head, const CommonOptions& options,
                     nlohmann::json& document) {
  auto session = open(scene, renderer, map_texels);
  if (!session)
    return session.error();
  for (const auto& [samples, reflections] : pairs_of(a.samples, a.reflections)) {
    session->show({.differential = !a.without_shadows, .reflections = reflections});
    const auto picture = still_picture(scene, *session, samples);
    if (!picture)
      return picture.error();
    nlohmann::json row = head;
    row["renderer"] = renderer;
    row["description"] = session->renderer_description();
    row["samples"] = samples;
    row["reflections"] = reflections;
    row["reflect_by"] = a.reflect_by;
    row["shadows_on_room"] = !a.without_shadows;
    if (renderer == "gl")
      row["map_texels"] = map_texels;
    row["error"] = object_error(*picture, reference);
    const auto noise = measure_flicker(scene, *session, a.flicker_frames);
    if (!noise)
      return noise.error();
    row["flicker"] = noise->object;
    row["object_fraction"] = static_cast<double>(picture->object_pixels) / (kFrameWidth * kFrameHeight);
    row["shadow_share"] = static_cast<double>(picture->shadow_pixels) / (kFrameWidth * kFrameHeight);
    for (const Motion m : {Motion::everything, Motion::object, Motion::nothing}) {
      if (interrupted())
        return interrupted_error("frame");
      auto timed = time_motion(scene, *session, m, a.frames);
      if (!timed)
        return timed.error();
      row[name_of(m)] = std::move(*timed);
    }
    if (!options.json)
      print(row);
    document["rows"].push_back(std::move(row));
  }
  return {};
}

std::filesystem::path folder_of(const std::filesystem::path& all, std::string name) {
  std::ranges::replace(name, ':', '-');
  return all / name;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  nlohmann::json document = {{"machine", machine()},
                             {"picture", {kFrameWidth, kFrameHeight}},
                             {"error", "RMS over object pixels of the difference to every pixel tracing " +
                                           std::to_string(a.reference_samples) +
                                           " lights, by the mean (direct + indirect)"},
                             {"frames", a.frames}};
  document["machine"]["clock"] = "wall clock and CPU time of all threads, medians";
  if (!options.json)
    std::printf("ms wall/CPU                    moving           object moving    nothing changed   error %%  flicker "
                "%%  share %%  mirrored rays\n");
  for (const std::string& object : a.objects)
    for (const std::string& sky : a.skies) {
      ProgressLine progress(options.quiet || options.json);
      auto scene = make_frame_scene(folder_of(a.folder, object + "-" + sky), object, sky,
                                    std::max(kPhotos, a.flicker_frames), kPhotos, progress.callback());
      progress.clear();
      if (!scene)
        return scene.error();
      scene->config.reflect_by = a.reflect_by == "maps" ? ReflectBy::maps : ReflectBy::rays;
      auto session = open(*scene, "exact", a.map_texels.front());
      if (!session)
        return session.error();
      const auto reference = still_picture(*scene, *session, a.reference_samples);
      if (!reference)
        return reference.error();
      for (const std::string& renderer : a.renderers)
        for (std::size_t k = 0; k < (renderer == "gl" ? a.map_texels.size() : 1); ++k)
          if (const auto r = measure(a, *scene, renderer, a.map_texels[k], *reference,
                                     {{"object", object}, {"sky", sky}}, options, document);
              !r)
            return r;
    }
  return deliver(document, options);
}

} // namespace

Command add_frame(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("frame", "time of an augmented frame against its error");
  parser->add_option("--folder", a->folder, "where the scenes are written and kept")->capture_default_str();
  parser
      ->add_option("--objects", a->objects,
                   "teapot, blob, folds; few, many (three); five; each with :MATERIAL, as in teapot:chrome")
      ->delimiter(',')
      ->capture_default_str();
  parser->add_option("--skies", a->skies, "overcast, sun, shade")->delimiter(',')->capture_default_str();
  parser->add_option("--renderers", a->renderers, "rays, gl")->delimiter(',')->capture_default_str();
  parser->add_option("--samples", a->samples, "lights per frame")->delimiter(',')->capture_default_str();
  parser->add_option("--reflections", a->reflections, "rays one after the other in mirrors and glass, at most")
      ->delimiter(',')
      ->check(CLI::Range(0, 64))
      ->capture_default_str();
  parser->add_flag("--without-shadows", a->without_shadows, "the objects leave the room as it is");
  parser->add_option("--reflect-by", a->reflect_by, "[light] reflect_by: rays, maps")
      ->check(CLI::IsMember({"rays", "maps"}))
      ->capture_default_str();
  parser->add_option("--map-texels", a->map_texels, "side of a shadow map by OpenGL")
      ->delimiter(',')
      ->check(CLI::Range(8, 2048))
      ->expected(1, 16)
      ->capture_default_str();
  parser->add_option("--frames", a->frames, "timed frames each")->check(CLI::Range(1, 10000))->capture_default_str();
  parser->add_option("--flicker-frames", a->flicker_frames, "skies with fresh noise")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  parser->add_option("--reference-samples", a->reference_samples)->check(CLI::Range(64, 65536))->capture_default_str();
  return {parser, [a](const CommonOptions& options) { return run(*a, options); }};
}

} // namespace daylit::bench
