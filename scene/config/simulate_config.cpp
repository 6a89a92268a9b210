#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>

#include <fmt/format.h>

#include "scene/config/config.h"
#include "scene/config/config_sections.h"
#include "scene/sky/sky_section.h"

namespace daylit {

namespace {

using detail::ConfigFile;
using detail::TomlSection;

constexpr double kRadians = std::numbers::pi / 180.0;

glm::dvec3 direction_of(double azimuth_deg, double elevation_deg) {
  const double a = azimuth_deg * kRadians, e = elevation_deg * kRadians;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

/// A picture as daylit-run takes it, or a sky in words.
void read_scene_sky(TomlSection sky, SimulateConfig& config) {
  if (sky.has("image")) {
    if (sky.has("model"))
      sky.problem("model", "given together with image; keep one");
    detail::read_sky_picture(sky, config.run.sky);
    return;
  }
  SkyDescription description;
  detail::read_sky_section(sky, description);
  config.sky_model = description.model;
  config.sky_notes = std::move(description.notes);
}

/// lens = "file" of a simulated camera; what it says of itself must not be said again.
void read_camera_lens(TomlSection& camera, std::initializer_list<const char*> excluded, std::filesystem::path& lens) {
  if (!camera.read("lens", lens))
    return;
  for (const char* key : excluded)
    if (camera.has(key))
      camera.problem(key, "given together with lens; keep one");
}

void read_cameras(TomlSection& root, SimulateConfig& config) {
  double degrees = 0.0;
  if (TomlSection fisheye = root.section("fisheye")) {
    if (config.has_sky_picture())
      fisheye.problem("", "has no effect: [sky] image is a picture already");
    fisheye.read_size("size", config.fisheye_width_px, config.fisheye_height_px);
    if (fisheye.read("fov", degrees, {10.0, 350.0}))
      config.fisheye_fov = degrees * kRadians;
    read_camera_lens(fisheye, {"fov", "size"}, config.run.sky.lens);
    fisheye.finish();
  }
  if (TomlSection interior = root.section("interior")) {
    if (interior.read("fov", degrees, {1.0, 170.0}))
      config.interior_fov = degrees * kRadians;
    read_camera_lens(interior, {"fov"}, config.run.interior.lens);
    interior.finish();
  }
  if (TomlSection simulate = root.section("simulate")) {
    simulate.read("samples", config.samples_per_pixel, {16, 1048576});
    simulate.read("sensor_noise", config.sensor_noise, {0.0, 1.0});
    simulate.read("marker_board", config.marker_board);
    simulate.finish();
  }
}

void read_path(TomlSection path, SimulateConfig& config) {
  if (!path)
    return;
  std::vector<double> n;
  if (path.read_rows("camera", 6, n, {-1e9, 1e9}))
    for (std::size_t k = 0; k < n.size(); k += 6) {
      config.camera_path.push_back({{n[k], n[k + 1], n[k + 2]}, {n[k + 3], n[k + 4], n[k + 5]}});
      if (const char* wrong = detail::wrong_view(config.camera_path.back().position, config.camera_path.back().target))
        path.problem("camera", fmt::format("key {}: {}", k / 6 + 1, wrong));
    }
  n.clear();
  if (path.read_rows("sun", 2, n, {-720.0, 720.0})) {
    for (std::size_t k = 0; k < n.size(); k += 2) {
      config.sun_path.push_back(direction_of(n[k], n[k + 1]));
      if (!(n[k + 1] > 0.3 && n[k + 1] <= 90.0))
        path.problem("sun", fmt::format("key {}: the sun touches the horizon; elevation 0.3 to 90", k / 2 + 1));
    }
    if (!config.sky_model.sun)
      path.problem("sun", "[sky] has no sun that could move");
  }
  path.finish();
}

/// [simulate] marker_board is known: that board is printed from a pattern built in.
void read_board(TomlSection section, SimulateConfig& config) {
  detail::read_marker(section, config.run.marker);
  config.marker_board = config.marker_board && config.run.marker.has_value();
  if (config.marker_board && config.run.marker->dictionary != "6X6_250")
    section.problem("dictionary", "only markers of 6X6_250 can be printed; leave it out, or set marker_board = false");
  else if (config.marker_board && !config.run.marker->ids.empty() && config.run.marker->ids != std::vector<int>{23})
    section.problem("ids", "only marker 23 can be printed; use ids = [23], or set marker_board = false");
}

/// Position of time t between keys: index of the key before, and the fraction of the next.
std::pair<std::size_t, double> between_keys(std::size_t keys, double t) {
  const double position = std::clamp(t, 0.0, 1.0) * static_cast<double>(keys - 1);
  const std::size_t before = std::min(static_cast<std::size_t>(position), keys > 1 ? keys - 2 : 0);
  return {before, position - static_cast<double>(before)};
}

} // namespace

SimulateConfig at_time(const SimulateConfig& config, double t) {
  SimulateConfig moment = config;
  if (const auto& keys = config.camera_path; !keys.empty()) {
    const auto [k, fraction] = between_keys(keys.size(), t);
    const CameraKey& next = keys[std::min(k + 1, keys.size() - 1)];
    moment.run.world_from_camera = look_at((1.0 - fraction) * keys[k].position + fraction * next.position,
                                           (1.0 - fraction) * keys[k].target + fraction * next.target);
  }
  if (const auto& keys = config.sun_path; !keys.empty() && config.sky_model.sun) {
    const auto [k, fraction] = between_keys(keys.size(), t);
    const glm::dvec3 next = keys[std::min(k + 1, keys.size() - 1)];
    moment.sky_model.sun->direction = glm::normalize((1.0 - fraction) * keys[k] + fraction * next);
  }
  return moment;
}

Result<SimulateConfig> read_simulate_config(const std::filesystem::path& path) {
  auto file = detail::parse_config_file(path);
  if (!file)
    return file.error();
  SimulateConfig config;
  TomlSection root(*file, &file->root, "");
  for (const char* required : {"sky", "room", "pose"})
    if (!root.has(required))
      file->report(1, fmt::format("section [{}] is missing", required));
  if (TomlSection sky = root.section("sky"))
    read_scene_sky(sky, config);
  read_cameras(root, config);
  if (TomlSection room = root.section("room")) {
    if (!room.read("model", config.run.room_model) && !room.has("model"))
      room.problem("", "needs model, an OBJ file");
    detail::read_glossy_room(room, config.run);
    room.finish();
  }
  read_path(root.section("path"), config);
  read_board(root.section("marker"), config);
  detail::read_pose(root.section("pose"), config.run.world_from_camera);
  detail::read_objects(root, config.run.objects);
  detail::read_light(root.section("light"), config.run);
  if (TomlSection output = root.section("output")) { // the files have names of their own
    output.read_size("size", config.run.output.width_px, config.run.output.height_px);
    output.finish();
  }
  root.finish();
  if (config.run.objects.empty() && !root.has("object"))
    file->report(1, "no [[object]]: the truth would show nothing");
  if (auto error = file->error())
    return *error;
  return config;
}

namespace {

std::string path_toml(const SimulateConfig& c) {
  std::string out = c.moves() ? "\n[path]\n" : "";
  const char* separator = "camera = [";
  for (const CameraKey& key : c.camera_path) {
    const glm::dvec3 &p = key.position, &q = key.target;
    out += fmt::format("{}[{}, {}, {}, {}, {}, {}]", separator, p.x, p.y, p.z, q.x, q.y, q.z);
    separator = ",\n          ";
  }
  out += c.camera_path.empty() ? "" : "]\n";
  separator = "sun = [";
  for (const glm::dvec3& d : c.sun_path) {
    out += fmt::format("{}[{}, {}]", separator, std::atan2(d.y, d.x) / kRadians,
                       std::asin(std::clamp(d.z, -1.0, 1.0)) / kRadians);
    separator = ", ";
  }
  return out + (c.sun_path.empty() ? "" : "]\n");
}

} // namespace

std::string to_toml(const SimulateConfig& c) {
  std::string out = c.has_sky_picture() ? detail::sky_picture_toml(c.run.sky) : detail::sky_toml(c.sky_model);
  if (!c.has_sky_picture())
    out += c.run.sky.lens.empty() ? fmt::format("\n[fisheye]\nsize = [{}, {}]\nfov = {}\n", c.fisheye_width_px,
                                                c.fisheye_height_px, detail::text(c.fisheye_fov / kRadians))
                                  : fmt::format("\n[fisheye]\nlens = {}\n", detail::quoted(c.run.sky.lens.string()));
  out += c.run.interior.lens.empty()
             ? fmt::format("\n[interior]\nfov = {}\n", detail::text(c.interior_fov / kRadians))
             : fmt::format("\n[interior]\nlens = {}\n", detail::quoted(c.run.interior.lens.string()));
  out += fmt::format("\n[simulate]\nsamples = {}\nsensor_noise = {}\nmarker_board = {}\n", c.samples_per_pixel,
                     detail::text(c.sensor_noise), c.marker_board);
  out += path_toml(c) + detail::marker_toml(c.run.marker) + detail::pose_toml(c.run.world_from_camera);
  out += fmt::format("\n[room]\nmodel = {}\n", detail::quoted(c.run.room_model.string()));
  out += detail::glossy_room_toml(c.run.glossy_room);
  out += detail::objects_toml(c.run.objects);
  out += detail::light_toml(c.run);
  return out + detail::output_toml(c.run.output);
}

} // namespace daylit
