// daylit-probe: light at points of a room, from its volume and a sky. Needs neither CGAL nor the radiosity solver.

#include <atomic>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>

#include "precompute/probe_matrix.h"
#include "precompute/probe_text.h"
#include "scene/core/command_line.h"
#include "scene/core/parallel.h"
#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"
#include "scene/room/dark_room.h"
#include "scene/sky/direct_sky.h"
#include "scene/sky/sky.h"
#include "scene/volume/indirect_light.h"
#include "scene/volume/volume_file.h"

namespace {

using namespace daylit;
using namespace daylit::precompute;

constexpr std::size_t kBlock_lines = 4096;

struct Arguments {
  std::filesystem::path volume;
  SkyArguments sky;
  double ground_albedo = -1, efficacy = 0; ///< efficacy: 0 prints irradiance
  bool coefficients = false, band4 = false, total = false, info = false, positions = false, quiet = false, json = false;
  std::optional<ShLayout> layout; ///< of the coefficients
  std::string matrix;             ///< sky patches of the matrix that is wanted
  MatrixFormat format = MatrixFormat::ascii;
  std::string command_line;
  int threads = 0;
};

/// Notes about the sky go to stderr.
Result<Sky> read_sky(const Arguments& a) {
  SkyArguments arguments = a.sky;
  if (a.ground_albedo >= 0)
    arguments.ground_albedo = a.ground_albedo;
  Result<OpenedSky> opened = open_sky(arguments);
  if (!opened)
    return opened.error();
  for (const std::string& note : a.quiet ? std::vector<std::string>{} : opened->notes)
    std::fprintf(stderr, "daylit-probe: %s\n", note.c_str());
  return std::move(opened->sky);
}

/// Everything that one point needs; queries are thread-safe.
struct Probe {
  IndirectLight indirect;
  const BasisVolume& volume;
  const RayScene& scene;
  std::optional<DirectSky> direct = {};
  /// Points whose coefficients rang below zero, and what ending that changed at most.
  mutable std::atomic<std::size_t> windowed{0};
  mutable std::atomic<double> bias{0};

  /// Zero in a closed room that no light enters; empty outside and in furniture.
  std::optional<ShRadiance> light_at(const glm::dvec3& p) const {
    const std::optional<ShRadiance> light = indirect.at(p);
    return light || !is_in_dark_room(scene, volume.room, volume.apertures, p) ? light : ShRadiance{};
  }
  std::optional<Sh9Rgb> nine_at(const glm::dvec3& p) const {
    const std::optional<ShRadiance> light = light_at(p);
    return light ? std::optional(light->nine) : std::nullopt;
  }

  std::optional<Rgb> irradiance_at(const ProbePoint& at) const {
    const std::optional<ShRadiance> sh = light_at(at.position);
    if (!sh)
      return std::nullopt;
    const NonNegativeLight light = without_ringing(*sh);
    if (light.windowed_channels > 0) {
      windowed.fetch_add(1, std::memory_order_relaxed);
      double seen = bias.load();
      while (seen < light.bias && !bias.compare_exchange_weak(seen, light.bias)) {
      }
    }
    const Rgb reflected = glm::max(irradiance(light.radiance, glm::vec3(at.normal)), Rgb(0.0f)); // rounding
    return direct ? reflected + direct->irradiance(at.position, at.normal) : reflected;
  }
};

/// Answers the lines of stdin in order, in blocks; a block ends early when no more input is waiting, so that a program
/// at the other end of the pipe gets its answer to every line.
Result<void> answer_lines(const Arguments& a, const Probe& probe) {
  std::ios::sync_with_stdio(false);
  std::vector<ProbePoint> points;
  std::vector<std::string> answers;
  std::size_t line_number = 0, outside = 0;
  std::string line;
  const auto flush = [&] {
    answers.assign(points.size(), {});
    parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
      if (a.layout)
        answers[i] = layout_text(probe.nine_at(points[i].position), *a.layout, a.json);
      else if (a.band4)
        answers[i] = order4_text(probe.light_at(points[i].position), a.json);
      else if (a.coefficients)
        answers[i] = coefficients_text(probe.nine_at(points[i].position), a.json);
      else if (a.efficacy > 0)
        answers[i] = illuminance_text(probe.irradiance_at(points[i]), a.efficacy, a.json);
      else
        answers[i] = irradiance_text(probe.irradiance_at(points[i]), a.json);
    });
    for (const std::string& answer : answers) {
      outside += is_outside(answer, a.json) ? 1 : 0;
      std::fputs(answer.c_str(), stdout);
    }
    std::fflush(stdout);
    points.clear();
  };
  while (!interrupted() && std::getline(std::cin, line)) {
    const Result<ProbePoint> point = parse_probe_point(line, ++line_number, !a.coefficients);
    if (!point) {
      flush();
      return point.error();
    }
    points.push_back(*point);
    if (points.size() >= kBlock_lines || std::cin.rdbuf()->in_avail() <= 0)
      flush();
  }
  flush();
  if (interrupted())
    return interrupted_error("stdin");
  if (outside > 0 && !a.quiet)
    std::fprintf(stderr, "daylit-probe: %zu of %zu points are outdoors, outside of the model or inside furniture\n",
                 outside, line_number);
  if (probe.windowed > 0 && !a.quiet)
    std::fprintf(
        stderr,
        "daylit-probe: %zu of %zu points windowed against ringing, irradiance changed by at most %.2f %% of its "
        "mean (rms over normals)\n",
        probe.windowed.load(), line_number, 100 * probe.bias.load());
  return {};
}

/// "tregenza" or "reinhart:K", in the order and orientation of Radiance.
Result<ReinhartPatches> parse_patches(const std::string& text) {
  const std::string prefix = "reinhart:";
  int k = text == "tregenza" ? 1 : 0;
  if (text.starts_with(prefix))
    std::from_chars(text.data() + prefix.size(), text.data() + text.size(), k);
  if (text != "tregenza" && text != prefix + std::to_string(k))
    return Error{ErrorCode::usage, "\"" + text + "\" is no subdivision of the sky", "--mtx", "tregenza or reinhart:K"};
  return ReinhartPatches::make(k);
}

/// All points are read before the first column is computed: a matrix has one row per point.
Result<void> print_matrix(const Arguments& a, const BasisVolume& volume, const RayScene& scene) {
  const Result<LightFieldSampler> sampler = LightFieldSampler::make(volume);
  if (!sampler)
    return sampler.error();
  const Result<ReinhartPatches> patches = parse_patches(a.matrix);
  if (!patches)
    return patches.error();
  std::vector<ProbePoint> points;
  for (std::string line; std::getline(std::cin, line);) {
    const Result<ProbePoint> point = parse_probe_point(line, points.size() + 1, !a.coefficients);
    if (!point)
      return point.error();
    points.push_back(*point);
  }
  ProgressLine progress(a.quiet);
  const Result<RadianceMatrix> matrix =
      daylight_matrix(volume, *sampler, scene, points, *patches, {a.coefficients, a.total}, progress.callback());
  if (!matrix)
    return matrix.error();
  progress.clear();
  const std::string text = matrix_text(*matrix, a.format, a.command_line);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    return Error{ErrorCode::io, "the matrix could not be written", "stdout", ""};
  return {};
}

/// World metres, nine digits.
void print_positions(const ProbeSet& probes) {
  for (std::size_t i = 0; i < probes.size(); ++i)
    if (probes.valid[i]) {
      const glm::dvec3 p = probes.origin + glm::dvec3(probes.positions[i]);
      std::printf("%.9g %.9g %.9g\n", p.x, p.y, p.z);
    }
}

/// Volume, then what needs no sky, then the field under the sky and the answers.
Result<void> run(const Arguments& a) {
  set_thread_count(a.threads);
  const Result<BasisVolume> volume = read_volume(a.volume);
  if (!volume)
    return volume.error();
  if (a.info)
    std::printf("%s\n", volume_info(*volume).c_str());
  if (a.positions)
    print_positions(volume->probes);
  if (a.info || a.positions)
    return {};
  const Result<RayScene> scene = RayScene::build(volume->room);
  if (!scene)
    return scene.error();
  if (!a.matrix.empty())
    return print_matrix(a, *volume, *scene);
  const Result<Sky> sky = read_sky(a);
  if (!sky)
    return sky.error();
  const Result<RayScene> surfaces = rays_of_light(*volume);
  if (!surfaces)
    return surfaces.error();
  Result<IndirectLight> indirect = IndirectLight::make(*volume, *surfaces, *sky);
  if (!indirect)
    return indirect.error();
  Probe probe{std::move(*indirect), *volume, *scene};
  if (a.total)
    probe.direct.emplace(volume->room, volume->apertures, *scene, *sky);
  return answer_lines(a, probe);
}

/// The sky, as all programs read it.
void add_sky_options(CLI::App& app, Arguments& a) {
  app.add_option("--sky", a.sky.file,
                 "sky picture (EXR, Radiance .hdr), sky in words (.toml), or weather tape (.epw, .wea)");
  app.add_option("--time", a.sky.time, "weather tapes: \"06-21 12:30\", local standard time");
  app.add_option("--projection", a.sky.projection, "equirect, angular or fisheye:LENS.yaml")->capture_default_str();
  app.add_option("--sky-rotation", a.sky.rotation_deg, "turns the sky counter-clockwise about z, degrees");
  app.add_option("--forward", a.sky.forward, "angular maps: direction of the centre, x,y,z")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--sky-up", a.sky.up, "angular maps: direction up in the image, x,y,z")->delimiter(',')->expected(3);
  app.add_option("--ground-albedo", a.ground_albedo,
                 "fills what the sky picture does not cover; ground of a sky in words")
      ->check(CLI::Range(0.0, 1.0));
}

/// What is printed for each point.
void add_output_options(CLI::App& app, Arguments& a) {
  auto* sh = app.add_flag("--sh", a.coefficients, "reads `x y z`, prints the nine coefficients, 27 values");
  auto* total =
      app.add_flag("--total", a.total, "adds the light that comes straight through the windows")->excludes(sh);
  auto* lux = app.add_option_function<double>(
                     "--lux", [&a](double efficacy) { a.efficacy = efficacy > 0 ? efficacy : kLumensPerWatt; },
                     "prints illuminance in lx, one value; lumens per watt of the sky (179 if none is given; 1 for a "
                     "sky in cd/m2)")
                  ->expected(0, 1)
                  ->check(positive_number())
                  ->excludes(sh);
  const std::vector<std::pair<std::string, ShLayout>> layouts{
      {"unity", ShLayout::unity}, {"unreal", ShLayout::unreal}, {"three", ShLayout::three}};
  auto* layout = app.add_option("--layout", a.layout,
                                "reads `x y z`, prints the 27 values of an engine: unity, unreal or three (docs/"
                                "interchange.md)")
                     ->transform(one_of(layouts))
                     ->excludes(sh)
                     ->excludes(lux)
                     ->excludes(total);
  const std::vector<std::pair<std::string, MatrixFormat>> formats{
      {"ascii", MatrixFormat::ascii}, {"float", MatrixFormat::float32}, {"double", MatrixFormat::float64}};
  auto* matrix = app.add_option("--mtx", a.matrix,
                                "prints the daylight coefficients of all points as a Radiance matrix, for the patches "
                                "tregenza or reinhart:K; needs no sky")
                     ->excludes(layout)
                     ->excludes(lux);
  app.add_flag("--band4", a.band4,
               "with --sh: 27 values more, the coefficients of l = 4 (m = -4 to 4), zeros if the volume has none")
      ->needs(sh)
      ->excludes(layout)
      ->excludes(matrix);
  app.add_option("--format", a.format, "of the matrix: ascii, float or double")
      ->transform(one_of(formats))
      ->needs(matrix);
  app.add_flag("--info", a.info, "prints what the volume holds, as JSON, and ends");
  app.add_flag("--positions", a.positions, "prints `x y z` of the valid probes and ends");
}

} // namespace

int main(int argc, char** argv) {
  watch_for_interrupt(); // first: an interrupt may come at once
  Arguments a;
  CLI::App app{
      "Light at points of a room under a sky. Reads `x y z nx ny nz` per line (metres, z up) and prints the\n"
      "indirect irradiance `r g b`; 0 in a closed room without light, `nan nan nan` outside and inside furniture.\n"
      "Example: echo 2 3 0.8  0 0 1 | daylit-probe room.volume --sky sky.exr"};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.add_option("VOLUME", a.volume, "made by daylit-precompute")->required();
  add_sky_options(app, a);
  add_output_options(app, a);
  add_threads_option(app, a.threads);
  app.add_flag("--quiet", a.quiet, "does not count points outside on stderr");
  app.add_flag("--json", a.json, "one JSON object per line");
  const auto code = parse_command_line(app, argc, argv, [&] {
    if (a.sky.file.empty() && !a.info && !a.positions && a.matrix.empty())
      throw CLI::RequiredError("--sky");
  });
  if (code)
    return *code;
  a.coefficients = a.coefficients || a.layout;
  for (int i = 0; i < argc; ++i)
    a.command_line += (i > 0 ? " " : "") + std::string(argv[i]);
  const PromptExit at_interrupt;
  return run_program("daylit-probe", a.json, [&] { return run(a); });
}
