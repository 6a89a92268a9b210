// daylit-bench direct: error of an object's direct light against rays to every part of the panes, over the number of
// lights, and what clipping the samples to the windows saves (Grosch, Eble, Mueller 2007, figure 6).

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include <CLI/CLI.hpp>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/direct_reference.h"
#include "bench/frame_scene.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/trace/traced_renderer.h"
#include "scene/core/parallel.h"
#include "scene/volume/volume_file.h"

namespace daylit::bench {

namespace {

constexpr int kPointsPerPixelSide = 4;

struct Arguments {
  std::string folder = "out/bench-frame";
  std::vector<std::string> objects{"teapot", "blob"};
  std::vector<int> samples{16, 32, 64, 128, 256, 512};
  int stride = 4, side = 16, clipping_samples = 1000000;
};

/// One object in one room under one sky, ready to be lit.
struct Lit {
  FrameScene frame;
  BasisVolume volume;
  VirtualObjects objects;
  RenderCamera camera;
  SkyMap map, map_with_sun; ///< of the measured picture, noise included
  std::optional<DetectedSun> sun;
  std::vector<SeenPixel> pixels;
  std::vector<double> total; ///< direct + indirect radiance of the pixels, green, by the session
};

Result<Lit> prepare(const Arguments& a, const std::string& object, const std::string& sky, const Progress& progress) {
  const std::filesystem::path folder = std::filesystem::path(a.folder) / (object + "-" + sky);
  auto frame = make_frame_scene(folder, object, sky, 1, 1, progress);
  if (!frame)
    return frame.error();
  Lit lit{std::move(*frame), {}, {}, {}, {}, {}, {}, {}, {}};
  auto volume = read_volume(lit.frame.config.volume);
  auto objects = load_virtual_objects(lit.frame.config.objects, folder, progress);
  auto camera =
      make_render_camera(lit.frame.interior_lens, *lit.frame.config.world_from_camera, kFrameWidth, kFrameHeight);
  if (!volume || !objects || !camera)
    return !volume ? volume.error() : !objects ? objects.error() : camera.error();
  lit.volume = std::move(*volume);
  lit.objects = std::move(*objects);
  lit.camera = std::move(*camera);
  const SkyImage& image = lit.frame.skies[0];
  const SkyResampler resampler = SkyResampler::make(image);
  lit.sun = find_sun(image, resampler.pixel_directions());
  resampler.resample(image, lit.sun ? &*lit.sun : nullptr, lit.map);
  resampler.resample(image, nullptr, lit.map_with_sun);
  return lit;
}

Result<void> find_points(const Arguments& a, const DirectLightReference& reference, Lit& lit) {
  auto session = Session::open(
      lit.frame.config, kFrameWidth, kFrameHeight, [](const std::string&, double) { return !interrupted(); },
      Backend::rays);
  if (!session)
    return session.error();
  const auto frame = session->render({lit.frame.skies[0], lit.frame.photos[0], 1, 1});
  if (!frame)
    return frame.error();
  for (SeenPixel& p : reference.seen_pixels(lit.camera, a.stride, kPointsPerPixelSide))
    if ((*frame)->composite.coverage[static_cast<std::size_t>(p.y) * kFrameWidth + p.x] > 0.999f) {
      lit.total.push_back(static_cast<double>((*frame)->composite.picture.at(p.x, p.y).g) /
                          lit.frame.config.interior.scale);
      lit.pixels.push_back(std::move(p));
    }
  return {};
}

/// Direct radiance of the pixels, as the renderer draws it.
Result<std::vector<double>> drawn(Lit& lit, TracedRenderer& renderer, int samples) {
  const ObjectSurface& surface = lit.objects.surface;
  const BoundingSphere sphere = surface.bounds();
  const auto pyramid = sky_map_pyramid(lit.map);
  const auto cells = aperture_cells(lit.volume.apertures, sphere, pyramid);
  const std::vector<Rgb> open = open_sky_irradiance(pyramid, cells, surface.positions, surface.normals);
  std::vector<VertexLight> light(open.size());
  for (std::size_t i = 0; i < open.size(); ++i)
    light[i].open_sky_front = open[i];
  RenderedFrame frame;
  for (const auto& step : {renderer.set_camera(lit.camera), renderer.set_objects(surface),
                           renderer.set_lights(sample_lights(lit.map, {}, lit.volume.apertures, sphere, samples)),
                           renderer.set_vertex_light(every_vertex(light.size()), light), renderer.draw(frame)})
    if (!step)
      return step.error();
  std::vector<double> radiance;
  for (const SeenPixel& p : lit.pixels)
    radiance.push_back(static_cast<double>(frame.at(p.x, p.y).object.y));
  return radiance;
}

double rms(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(a.size(), 1)));
}

double mean(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v)
    sum += x;
  return sum / static_cast<double>(std::max<std::size_t>(v.size(), 1));
}

/// Mean radiance of the pixels; `irradiance` of a point and a number that is its own.
template <class F>
std::vector<double> of_pixels(const std::vector<SeenPixel>& pixels, F irradiance) {
  std::vector<double> radiance(pixels.size(), 0.0);
  parallel_for(std::size_t{0}, pixels.size(), [&](std::size_t i) {
    const auto& points = pixels[i].points;
    for (std::size_t k = 0; k < points.size(); ++k)
      radiance[i] += static_cast<double>(points[k].reflectance.g *
                                         irradiance(points[k], static_cast<std::uint32_t>(i * points.size() + k)).g) *
                     std::numbers::inv_pi / static_cast<double>(points.size());
  });
  return radiance;
}

Result<void> measure_error(const Arguments& a, const std::string& object, const CommonOptions& options,
                           nlohmann::json& document) {
  ProgressLine progress(options.quiet || options.json);
  auto lit = prepare(a, object, "overcast", progress.callback());
  progress.clear();
  if (!lit)
    return lit.error();
  const auto reference = DirectLightReference::make(lit->volume.room, lit->volume.apertures, lit->objects.surface);
  auto renderer = TracedRenderer::make(lit->volume.room, lit->volume.apertures);
  if (!reference || !renderer)
    return reference ? renderer.error() : reference.error();
  if (const auto r = find_points(a, *reference, *lit); !r)
    return r;
  const AnalyticSky sky(lit->frame.sky_model);
  const auto exact = of_pixels(
      lit->pixels, [&](const SeenPoint& p, std::uint32_t seed) { return reference->irradiance(p, sky, a.side, seed); });
  const double whole = mean(lit->total);
  for (const int samples : a.samples) {
    const auto tested = drawn(*lit, *renderer, samples);
    if (!tested)
      return tested.error();
    const double error = rms(*tested, exact) / whole;
    if (!options.json)
      std::printf("%-8s overcast %5d lights: error %6.2f %% (%zu pixels)\n", object.c_str(), samples, 100 * error,
                  exact.size());
    document["overcast"].push_back({{"object", object}, {"samples", samples}, {"error", error}});
  }
  return {};
}

/// Samples of the whole picture in proportion to radiance, the sun among them.
std::vector<DirectionalLight> whole_picture_lights(const SkyMap& map, int count) {
  std::vector<double> cumulative;
  double total = 0.0;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x)
      cumulative.push_back(total += static_cast<double>(luminance(map.at(x, y))) * map.solid_angle_sr(y));
  std::vector<DirectionalLight> lights;
  for (int j = 0; j < count; ++j) {
    const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), total * (j + 0.5) / count);
    const int i = static_cast<int>(found - cumulative.begin()), y = i / map.width, x = i % map.width;
    const double place = (j + 0.5) * (std::numbers::phi - 1.0), s = place - std::floor(place);
    const Rgb& radiance = map.at(x, y);
    lights.push_back({map.direction(x + s, y + 0.5),
                      radiance * static_cast<float>(total / (count * static_cast<double>(luminance(radiance))))});
  }
  return lights;
}

Result<void> measure_clipping(const Arguments& a, const std::string& object, const CommonOptions& options,
                              nlohmann::json& document) {
  constexpr int kSamples = 64;
  ProgressLine progress(options.quiet || options.json);
  auto lit = prepare(a, object, "shade", progress.callback());
  progress.clear();
  if (!lit)
    return lit.error();
  const auto reference = DirectLightReference::make(lit->volume.room, lit->volume.apertures, lit->objects.surface);
  if (!reference)
    return reference.error();
  const std::vector<SeenPixel> pixels = reference->seen_pixels(lit->camera, 2 * a.stride, 1);
  const BoundingSphere sphere = lit->objects.surface.bounds();
  // Of a million samples only those that some point of the object could see through a window are asked.
  const WindowCone cone(lit->volume.apertures, sphere);
  std::vector<DirectionalLight> many = whole_picture_lights(lit->map_with_sun, a.clipping_samples);
  std::erase_if(many, [&](const DirectionalLight& l) { return !cone.allows(l.direction); });
  const auto exact =
      of_pixels(pixels, [&](const SeenPoint& p, std::uint32_t) { return reference->irradiance(p, many); });
  const LightSet clipped = sample_lights(lit->map, lit->sun, lit->volume.apertures, sphere, kSamples);
  std::vector<DirectionalLight> lights = clipped.sky;
  lights.insert(lights.end(), clipped.sun.begin(), clipped.sun.end());
  const auto whole_lights = whole_picture_lights(lit->map_with_sun, kSamples);
  const auto with =
      of_pixels(pixels, [&](const SeenPoint& p, std::uint32_t) { return reference->irradiance(p, lights); });
  const auto without =
      of_pixels(pixels, [&](const SeenPoint& p, std::uint32_t) { return reference->irradiance(p, whole_lights); });
  const double level = mean(exact), error = rms(with, exact) / level, error_whole = rms(without, exact) / level;
  if (!options.json)
    std::printf("%-8s in the room's shadow, %d lights: error %6.2f %% clipped to the windows, %6.2f %% of the whole "
                "picture, ratio %.3f\n",
                object.c_str(), kSamples, 100 * error, 100 * error_whole, error / error_whole);
  document["clipping"].push_back(
      {{"object", object}, {"samples", kSamples}, {"clipped", error}, {"whole_picture", error_whole}});
  return {};
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  nlohmann::json document = {
      {"machine", machine()},
      {"measure", "RMS over the object's pixels, eroded by two, by the mean of direct + indirect"},
      {"reference", std::to_string(kPointsPerPixelSide * kPointsPerPixelSide) + " points per pixel, " +
                        std::to_string(a.side * a.side) + " per pane for each"}};
  for (const std::string& object : a.objects) {
    if (const auto r = measure_error(a, object, options, document); !r)
      return r;
    if (const auto r = measure_clipping(a, object, options, document); !r)
      return r;
  }
  return deliver(document, options);
}

} // namespace

Command add_direct(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("direct", "error of the direct light over the number of lights");
  parser->add_option("--folder", a->folder, "where the scenes are written and kept")->capture_default_str();
  parser->add_option("--objects", a->objects, "teapot, blob")->delimiter(',')->capture_default_str();
  parser->add_option("--samples", a->samples, "lights per frame")->delimiter(',')->capture_default_str();
  parser->add_option("--stride", a->stride, "pixels between those compared")->check(CLI::Range(1, 64));
  parser->add_option("--side", a->side, "square root of the points per pane")->check(CLI::Range(2, 512));
  parser->add_option("--clipping-samples", a->clipping_samples, "of the reference for clipping")
      ->check(CLI::Range(1000, 100000000));
  return {parser, [a](const CommonOptions& options) { return run(*a, options); }};
}

} // namespace daylit::bench
