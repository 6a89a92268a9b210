// daylit-bench flicker: the picture under a still sky with sensor noise, and under a sky that changes at once when a
// cloud comes. A picture may be kept steady by leaning on earlier frames only as long as it does not lag behind.

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/flicker.h"
#include "simulate/picture.h"
#include "simulate/sample_scene.h"

namespace daylit::bench {

namespace {

struct Arguments {
  std::string folder = "out/bench-frame", renderer = "rays";
  std::vector<std::string> objects{"teapot"}, skies{"overcast", "sun", "shade"};
  int frames = 100;
};

constexpr double kNoise = 0.01, kWhole = 0.99;
constexpr int kAfterStep = 12; // frames
constexpr float kDimmedSun = 0.5f, kDimmedSky = 0.7f;

Result<Session> open(const FrameScene& scene, const std::string& renderer) {
  return Session::open(
      scene.config, kFrameWidth, kFrameHeight, [](const std::string&, double) { return !interrupted(); },
      renderer == "gl" ? Backend::opengl : Backend::rays);
}

/// The scene's sky behind a cloud, `count` times with fresh noise.
Result<std::vector<SkyImage>> clouded(const FrameScene& scene, const std::string& name, int count) {
  const auto sample = sample_scene(name, kFrameWidth, kFrameHeight);
  if (!sample)
    return sample.error();
  SkyModel model = scene.sky_model;
  model.zenith_radiance *= kDimmedSky;
  if (model.sun)
    model.sun->normal_irradiance *= kDimmedSun;
  const LensModel lens = ideal_fisheye(sample->fisheye_width_px, sample->fisheye_height_px, sample->fisheye_fov);
  const auto clean = render_sky_frame(AnalyticSky(model), lens);
  if (!clean)
    return clean.error();
  std::vector<SkyImage> skies;
  for (int k = 0; k < count; ++k) {
    RgbImage image = *clean;
    add_sensor_noise(image, kNoise, static_cast<std::uint32_t>(50001 + k));
    auto sky = SkyImage::make(std::move(image), scene.skies[0].geometry(), {GroundFill::Kind::albedo, 0.2f});
    if (!sky)
      return sky.error();
    skies.push_back(std::move(*sky));
  }
  return skies;
}

/// Mean of the object's pixels.
double object_mean(const Composite& c) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < c.touched.size(); ++i)
    if (c.touched[i] == 2) {
      sum += static_cast<double>(c.picture.texels[i].g);
      ++count;
    }
  return sum / static_cast<double>(std::max<std::size_t>(count, 1));
}

/// Fraction of a sudden change of the sky that each frame after it shows; the whole is what a session shows that never
/// saw the sky before.
Result<std::vector<double>> response(const FrameScene& scene, const std::string& name, const std::string& renderer,
                                     Session& session) {
  const auto skies = clouded(scene, name, kAfterStep);
  if (!skies)
    return skies.error();
  auto fresh = open(scene, renderer);
  if (!fresh)
    return fresh.error();
  std::uint64_t number = 5000;
  const auto mean_under = [&](Session& of, const SkyImage& sky) -> Result<double> {
    const auto frame = of.render({sky, scene.photos[0], ++number, 1});
    return frame ? Result<double>(object_mean((*frame)->composite)) : frame.error();
  };
  const auto before = mean_under(session, scene.skies.back()), after = mean_under(*fresh, (*skies)[0]);
  if (!before || !after)
    return (before ? after : before).error();
  std::vector<double> fractions;
  for (const SkyImage& sky : *skies) {
    const auto now = mean_under(session, sky);
    if (!now)
      return now.error();
    fractions.push_back((*now - *before) / (*after - *before));
  }
  return fractions;
}

Result<nlohmann::ordered_json> one_row(const Arguments& a, const std::string& object, const std::string& sky,
                                       const CommonOptions& options) {
  ProgressLine progress(options.quiet || options.json);
  auto scene = make_frame_scene(std::filesystem::path(a.folder) / (object + "-" + sky), object, sky, a.frames, 1,
                                progress.callback());
  progress.clear();
  if (!scene)
    return scene.error();
  auto session = open(*scene, a.renderer);
  if (!session)
    return session.error();
  const auto flicker = measure_flicker(*scene, *session, a.frames);
  if (!flicker)
    return flicker.error();
  const auto fractions = response(*scene, sky, a.renderer, *session);
  if (!fractions)
    return fractions.error();
  const auto whole =
      std::find_if(fractions->begin(), fractions->end(), [](double s) { return s >= kWhole && s <= 2.0 - kWhole; });
  return nlohmann::ordered_json{{"object", object},
                                {"sky", sky},
                                {"flicker_object", flicker->object},
                                {"flicker_shadow", flicker->shadow},
                                {"frames_to_99_percent", 1 + static_cast<int>(whole - fractions->begin())},
                                {"response", *fractions}};
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  nlohmann::ordered_json document{{"machine", machine()},
                                  {"renderer", a.renderer},
                                  {"frames", a.frames},
                                  {"sensor_noise", kNoise},
                                  {"rows", nlohmann::json::array()}};
  if (!options.json)
    std::printf(
        "object   sky        flicker %%: object   shadow   a step of the sky: first frame, within 1 %% after\n");
  for (const std::string& object : a.objects)
    for (const std::string& sky : a.skies) {
      const auto row = one_row(a, object, sky, options);
      if (!row)
        return row.error();
      if (!options.json)
        std::printf("%-8s %-9s %17.3f %8.3f %27.1f %% %5d frame(s)\n", object.c_str(), sky.c_str(),
                    100.0 * (*row)["flicker_object"].get<double>(), 100.0 * (*row)["flicker_shadow"].get<double>(),
                    100.0 * (*row)["response"][0].get<double>(), (*row)["frames_to_99_percent"].get<int>());
      document["rows"].push_back(*row);
    }
  return deliver(document, options);
}

} // namespace

Command add_flicker(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("flicker", "steadiness under sensor noise, and how soon a change of the sky shows");
  parser->add_option("--folder", a->folder, "where the scenes are written and kept")->capture_default_str();
  parser->add_option("--objects", a->objects, "teapot, blob")->delimiter(',')->capture_default_str();
  parser->add_option("--skies", a->skies, "overcast, sun, shade")->delimiter(',')->capture_default_str();
  parser->add_option("--renderer", a->renderer, "rays or gl")->check(CLI::IsMember({"rays", "gl"}));
  parser->add_option("--frames", a->frames, "skies with fresh noise")->check(CLI::Range(2, 1000));
  return {parser, [a](const CommonOptions& options) { return run(*a, options); }};
}

} // namespace daylit::bench
