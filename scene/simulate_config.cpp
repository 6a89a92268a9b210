#include <numbers>

#include <fmt/format.h>

#include "scene/config.h"
#include "scene/detail/config_sections.h"
#include "scene/detail/sky_section.h"

namespace daylit {

namespace {

using detail::ConfigFile;
using detail::TomlSection;

constexpr double kRadians = std::numbers::pi / 180.0;

void read_cameras(TomlSection& root, SimulateConfig& config) {
  double degrees = 0.0;
  if (TomlSection fisheye = root.section("fisheye")) {
    fisheye.read_size("size", config.fisheye_width_px, config.fisheye_height_px);
    if (fisheye.read("fov", degrees, {10.0, 350.0}))
      config.fisheye_fov = degrees * kRadians;
    fisheye.finish();
  }
  if (TomlSection interior = root.section("interior")) {
    if (interior.read("fov", degrees, {1.0, 170.0}))
      config.interior_fov = degrees * kRadians;
    interior.finish();
  }
  if (TomlSection simulate = root.section("simulate")) {
    simulate.read("samples", config.samples_per_pixel, {1, 1048576});
    simulate.read("sensor_noise", config.sensor_noise, {0.0, 1.0});
    simulate.read("marker_board", config.marker_board);
    simulate.finish();
  }
}

} // namespace

Result<SimulateConfig> read_simulate_config(const std::filesystem::path& path) {
  auto file = detail::parse_config_file(path);
  if (!file)
    return file.error();
  SimulateConfig config;
  TomlSection root(*file, &file->root, "");
  for (const char* required : {"sky", "room", "pose"})
    if (!root.has(required))
      file->report(1, fmt::format("section [{}] is missing", required));
  if (TomlSection sky = root.section("sky")) {
    SkyDescription description;
    detail::read_sky_section(sky, description);
    config.sky_model = description.model;
    config.sky_notes = std::move(description.notes);
  }
  read_cameras(root, config);
  if (TomlSection room = root.section("room")) {
    if (!room.read("model", config.run.room_model) && !room.has("model"))
      room.problem("", "needs model, an OBJ file");
    room.finish();
  }
  detail::read_marker(root.section("marker"), config.run.marker);
  detail::read_pose(root.section("pose"), config.run.world_from_camera);
  detail::read_objects(root, config.run.objects);
  detail::read_light(root.section("light"), config.run);
  detail::read_output(root.section("output"), config.run.output);
  root.finish();
  if (config.run.objects.empty() && !root.has("object"))
    file->report(1, "no [[object]]: the truth would show nothing");
  config.marker_board = config.marker_board && config.run.marker.has_value();
  if (auto error = file->error())
    return *error;
  return config;
}

std::string to_toml(const SimulateConfig& c) {
  std::string out = detail::sky_toml(c.sky_model);
  out +=
      fmt::format("\n[fisheye]\nsize = [{}, {}]\nfov = {}\n\n[interior]\nfov = {}\n", c.fisheye_width_px,
                  c.fisheye_height_px, detail::text(c.fisheye_fov / kRadians), detail::text(c.interior_fov / kRadians));
  out += fmt::format("\n[simulate]\nsamples = {}\nsensor_noise = {}\nmarker_board = {}\n", c.samples_per_pixel,
                     detail::text(c.sensor_noise), c.marker_board);
  out += detail::marker_toml(c.run.marker) + detail::pose_toml(c.run.world_from_camera);
  out += fmt::format("\n[room]\nmodel = {}\n", detail::quoted(c.run.room_model.string()));
  out += detail::objects_toml(c.run.objects);
  out += fmt::format("\n[light]\nsamples = {}\n", c.run.light_samples);
  return out + detail::output_toml(c.run.output);
}

} // namespace daylit
