#include "simulate/simulate_command.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "scene/config/config.h"
#include "scene/core/atomic_file.h"
#include "scene/core/output_file.h"
#include "scene/image/image_formats.h"
#include "simulate/build_scene.h"
#include "simulate/low_discrepancy.h"
#include "simulate/picture.h"
#include "simulate/picture_error.h"
#include "simulate/sample_scene.h"

namespace daylit {

namespace {

constexpr int kBaseSamples = 32;
constexpr std::uint32_t kSensorSeed = 0x53454E53u, kDepthKey = 0x44455054u;

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string frame_suffix(int number) { return number == 0 ? "" : fmt::format("_{:04}", number); }

std::filesystem::path seen_from(const std::filesystem::path& folder, const std::filesystem::path& file) {
  std::error_code ec;
  const auto relative = std::filesystem::relative(file, folder, ec);
  return ec || relative.empty() ? std::filesystem::absolute(file) : relative;
}

/// The picture that the scene names; else what the sky camera records.
SkyConfig sky_config(const SimulateConfig& config, const std::filesystem::path& folder, int frame) {
  SkyConfig sky = config.run.sky;
  if (!config.has_sky_picture())
    return {.image = "sky" + frame_suffix(frame) + ".exr",
            .camera = {},
            .projection = "fisheye",
            .lens = "sky.yaml",
            .ground = {GroundFill::Kind::albedo, std::max(0.0f, config.sky_model.ground_albedo)}};
  sky.image = seen_from(folder, sky.image);
  if (!sky.lens.empty())
    sky.lens = seen_from(folder, sky.lens);
  if (!sky.fall_off.empty())
    sky.fall_off = seen_from(folder, sky.fall_off);
  return sky;
}

std::string depth_name(const SimulateArguments& a, int frame) { return "depth" + frame_suffix(frame) + "." + a.depth; }

/// What daylit-run draws a frame from.
RunConfig run_config(const SimulateConfig& config, const SimulateArguments& a, int frame) {
  const std::filesystem::path& folder = a.folder;
  RunConfig run = config.run;
  run.sky = sky_config(config, folder, frame);
  run.marker.reset(); // the pose is known
  run.interior.image = "interior.exr";
  run.interior.lens = "interior.yaml";
  if (!a.depth.empty()) {
    run.interior.depth = depth_name(a, frame);
    run.interior.depth_noise_m = a.depth_noise_m;
  }
  run.room_model = seen_from(folder, run.room_model);
  run.volume = "room.volume";
  for (ObjectConfig& object : run.objects)
    object.model = seen_from(folder, object.model);
  run.output.png = "result.png";
  run.output.exr = "result.exr";
  run.output.mask = "result-mask.exr";
  for (auto* path : {&run.interior.image, &run.output.png, &run.output.exr, &run.output.mask})
    *path = path->stem().string() + frame_suffix(frame) + path->extension().string();
  return run;
}

struct Frame {
  std::optional<DepthPicture> depth; ///< of the room without the object, where it is asked for
  std::optional<RgbImage> sky;       ///< what the sky camera records; none where the scene's sky is a picture already
  InteriorPictures interior;
};

constexpr FileKind kConfigKind{"a configuration written by daylit-simulate", "# Written by daylit-simulate\n"};

Result<void> write_frame(const Frame& frame, const std::filesystem::path& folder, int number) {
  const std::string suffix = frame_suffix(number);
  const auto& p = frame.interior;
  const float exposure = preview_exposure(p.room);
  Rgb8Image mask{p.coverage.width, p.coverage.height, {}};
  for (const Rgb& c : p.coverage.texels)
    mask.bytes.insert(mask.bytes.end(), 3, static_cast<std::uint8_t>(std::lround(255.0f * c.r)));
  std::vector<std::pair<const char*, const RgbImage*>> exr = {
      {"interior", &p.room}, {"truth", &p.truth}, {"se", &p.truth_standard_error}, {"mask", &p.coverage}};
  std::vector<std::pair<const char*, Rgb8Image>> png = {
      {"interior", to_srgb8(p.room, exposure)}, {"truth", to_srgb8(p.truth, exposure)}, {"mask", std::move(mask)}};
  if (frame.sky) {
    exr.emplace_back("sky", &*frame.sky);
    png.emplace_back("sky", to_srgb8(*frame.sky, preview_exposure(*frame.sky)));
  }
  for (const auto& [name, image] : exr)
    if (const auto done = write_exr(folder / (name + suffix + ".exr"), *image); !done)
      return done;
  for (const auto& [name, image] : png)
    if (const auto done = write_png(folder / (name + suffix + ".png"), image); !done)
      return done;
  return {};
}

/// All that write_moment() and write_lenses() will write; the folder is there.
Result<void> check_outputs(const SimulateConfig& config, const SimulateArguments& a) {
  std::vector<const char*> exr = {"interior", "truth", "se", "mask"}, png = {"interior", "truth", "mask"},
                           lenses = {"interior.yaml"};
  if (!config.has_sky_picture()) {
    exr.push_back("sky");
    png.push_back("sky");
    lenses.push_back("sky.yaml");
  }
  std::vector<std::pair<std::string, const FileKind*>> files;
  for (const char* name : lenses)
    files.emplace_back(name, &kLensKind);
  for (int frame = 0; frame < a.frames; ++frame) {
    const std::string suffix = frame_suffix(frame);
    files.emplace_back("CONFIG" + suffix + ".toml", &kConfigKind);
    if (!a.depth.empty())
      files.emplace_back(depth_name(a, frame), a.depth == "png" ? &kPngKind : &kExrKind);
    for (const char* name : exr)
      files.emplace_back(name + suffix + ".exr", &kExrKind);
    for (const char* name : png)
      files.emplace_back(name + suffix + ".png", &kPngKind);
  }
  for (const auto& [name, kind] : files)
    if (const auto writable = check_output(a.folder / name, *kind, a.force); !writable)
      return writable;
  return {};
}

void report(const InteriorPictures& p, double seconds, bool json) {
  double cover = 0.0, square = 0.0, level = 0.0;
  for (std::size_t i = 0; i < p.coverage.texels.size(); ++i) {
    cover += static_cast<double>(p.coverage.texels[i].r);
    if (p.coverage.texels[i].r < 1.0f)
      continue;
    for (int c = 0; c < 3; ++c) {
      square += std::pow(static_cast<double>(p.truth_standard_error.texels[i][c]), 2);
      level += static_cast<double>(p.truth.texels[i][c]);
    }
  }
  std::size_t full = 0;
  for (const Rgb& c : p.coverage.texels)
    full += c.r >= 1.0f ? 3 : 0;
  const double n = static_cast<double>(p.coverage.texels.size()), m = std::max<double>(1.0, static_cast<double>(full));
  const double error = level > 0.0 ? 100.0 * std::sqrt(square / m) / (level / m) : 0.0;
  const double cover_percent = 100.0 * cover / n, sampled_percent = 100.0 * p.influenced_fraction;
  if (json)
    std::printf("{\"seconds\":%.2f,\"object_percent\":%.2f,\"influenced_percent\":%.2f,\"truth_se_percent\":%.3f}\n",
                seconds, cover_percent, sampled_percent, error);
  else
    std::fprintf(stderr,
                 "simulated in %.1f s: the object covers %.1f %%, it shows on %.1f %% of the picture, standard error "
                 "of the truth on the object %.2f %%\n",
                 seconds, cover_percent, sampled_percent, error);
}

} // namespace

namespace {

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes)
    std::fprintf(stderr, "%s\n", note.c_str());
}

/// Called when there is something to write: a bad scene leaves no empty folder.
Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return Error{ErrorCode::io, "cannot create the folder: " + failed.message(), folder.string(),
                 "give another folder to -o"};
  return {};
}

/// The scene file, written first for a --demo.
Result<SimulateConfig> read_scene_config(const SimulateArguments& a) {
  if (a.demo.empty())
    return read_simulate_config(a.scene);
  if (const auto made = make_folder(a.folder); !made)
    return made.error();
  const auto written = write_sample_scene(a.demo, a.folder, a.size[0], a.size[1], a.force);
  if (!written)
    return written.error();
  return read_simulate_config(*written);
}

/// One moment of a scene and what its cameras see.
struct Moment {
  SimulateConfig config;
  Frame frame;
};

/// What the lenses of the scene's cameras see; the sky camera looks up.
struct Cameras {
  LensModel sky, interior;
};

/// Of a lens file; ideal without one.
Result<LensModel> camera_lens(const std::filesystem::path& file, const LensModel& ideal) {
  if (file.empty())
    return ideal;
  const auto lens = read_lens(file);
  if (lens && lens->width_px == 0)
    return Error{ErrorCode::value_invalid, "a simulated camera needs image_width and image_height", file.string(),
                 "add both to the lens file"};
  return lens;
}

/// The lens file decides how large the photograph is; daylit-run draws it at [output] size, of the same shape.
Result<void> check_shape(const SimulateConfig& c, const LensModel& lens) {
  const OutputConfig& out = c.run.output;
  if (c.run.interior.lens.empty() || out.width_px == 0 ||
      std::abs(out.height_px - static_cast<double>(out.width_px) * lens.height_px / lens.width_px) <= 1.0)
    return {};
  return Error{ErrorCode::value_invalid,
               fmt::format("[output] size {} x {} is not of the shape of {}, {} x {}", out.width_px, out.height_px,
                           c.run.interior.lens.filename().string(), lens.width_px, lens.height_px),
               "[interior] lens", "give the size of the lens file, or leave [output] size out"};
}

Result<Cameras> cameras_of(const SimulateConfig& c) {
  const OutputConfig& out = c.run.output;
  const auto interior =
      camera_lens(c.run.interior.lens, ideal_pinhole(out.width_px > 0 ? out.width_px : 512,
                                                     out.height_px > 0 ? out.height_px : 496, c.interior_fov));
  if (!interior)
    return interior.error();
  if (const auto good = check_shape(c, *interior); !good)
    return good.error();
  const auto sky = camera_lens(c.has_sky_picture() ? "" : c.run.sky.lens,
                               ideal_fisheye(c.fisheye_width_px, c.fisheye_height_px, c.fisheye_fov));
  if (!sky)
    return sky.error();
  return Cameras{*sky, *interior};
}

/// Once, when the inputs are known.
Result<void> begin_output(const SimulateConfig& config, const SimulateArguments& a,
                          const std::vector<std::string>& warnings) {
  print_notes(warnings);
  const auto made = make_folder(a.folder);
  return made ? check_outputs(config, a) : made;
}

Result<Moment> record(const SimulateConfig& config, const Cameras& cameras, const SimulateArguments& a, bool first,
                      ProgressLine& line) {
  std::vector<std::string> warnings;
  const auto scene = build_scene(config, &warnings);
  if (!scene)
    return scene.error();
  if (const auto begun = first ? begin_output(config, a, warnings) : Result<void>(); !begun)
    return begun.error();
  Moment moment{config, {}};
  if (!config.has_sky_picture()) {
    auto sky = render_sky_frame(AnalyticSky(config.sky_model), cameras.sky);
    if (!sky)
      return sky.error();
    moment.frame.sky = std::move(*sky);
  }
  const PictureSettings settings{a.samples > 0 ? a.samples : config.samples_per_pixel, kBaseSamples, a.seed};
  auto pictures = render_interior(*scene, cameras.interior, *config.run.world_from_camera, settings, line.callback());
  if (!pictures)
    return pictures.error();
  moment.frame.interior = std::move(*pictures);
  if (!a.depth.empty())
    moment.frame.depth = render_depth(*scene, cameras.interior, *config.run.world_from_camera);
  return moment;
}

Result<void> write_moment(const Moment& moment, const SimulateArguments& a, int number) {
  Frame noisy = moment.frame;
  const double noise = moment.config.sensor_noise;
  const auto key = [&](int k) { return combine_keys(a.seed ^ kSensorSeed, static_cast<std::uint32_t>(k)); };
  if (noisy.depth)
    add_depth_noise(*noisy.depth, a.depth_noise_m, combine_keys(key(number), kDepthKey));
  if (noisy.sky)
    add_sensor_noise(*noisy.sky, noise, key(2 * number));
  add_sensor_noise(noisy.interior.room, noise, key(2 * number + 1));
  if (const auto done = write_frame(noisy, a.folder, number); !done)
    return done;
  if (noisy.depth)
    if (const auto done = write_depth_picture(a.folder / depth_name(a, number), *noisy.depth); !done)
      return done;
  return write_file_atomically(a.folder / ("CONFIG" + frame_suffix(number) + ".toml"),
                               std::string(kConfigKind.start) + to_toml(run_config(moment.config, a, number)));
}

Result<void> write_lenses(const SimulateConfig& config, const Cameras& cameras, const std::filesystem::path& folder) {
  if (!config.has_sky_picture())
    if (const auto done = write_lens(folder / "sky.yaml", cameras.sky); !done)
      return done;
  return write_lens(folder / "interior.yaml", cameras.interior);
}

} // namespace

Result<void> run_simulate(const SimulateArguments& a) {
  const auto config = read_scene_config(a);
  if (!config)
    return config.error();
  print_notes(config->sky_notes);
  const auto cameras = cameras_of(*config);
  if (!cameras)
    return cameras.error();
  ProgressLine line(a.quiet);
  const auto start = Clock::now();
  std::optional<Moment> moment;
  for (int frame = 0; frame < a.frames; ++frame) {
    if (frame == 0 || config->moves()) {
      const double t = a.frames > 1 ? static_cast<double>(frame) / (a.frames - 1) : 0.0;
      auto recorded = record(a.frames > 1 ? at_time(*config, t) : *config, *cameras, a, frame == 0, line);
      if (!recorded)
        return recorded.error();
      moment.emplace(std::move(*recorded));
    }
    if (const auto done = write_moment(*moment, a, frame); !done)
      return done;
  }
  if (const auto done = write_lenses(*config, *cameras, a.folder); !done)
    return done;
  line.clear();
  if (!a.quiet || a.json)
    report(moment->frame.interior, seconds_since(start), a.json);
  return {};
}

} // namespace daylit
