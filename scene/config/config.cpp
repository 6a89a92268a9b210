#include "scene/config/config.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "scene/config/config_sections.h"

namespace daylit {

namespace {

using detail::ConfigFile;
using detail::TomlSection;

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kMostBlur_px = 16.0;

void read_scale(TomlSection& interior, InteriorConfig& config) {
  if (!interior.has("scale"))
    return;
  if (interior.is_number("scale")) {
    interior.read("scale", config.scale, {1e-30, 1e30});
    return;
  }
  std::string word;
  config.scale_from_marker = interior.read_word("scale", word, {"marker"});
  if (config.scale_from_marker && config.camera)
    interior.problem("scale", "= \"marker\" is for single pictures: draw one with it, which prints scale and "
                              "colour_matrix to be given here");
}

void read_noise(TomlSection& interior, CameraNoise& noise) {
  if (!interior.has("noise"))
    return;
  if (TomlSection table = interior.section_if_table("noise")) {
    table.read("floor", noise.floor, {0.0, 1e30});
    table.read("photon", noise.photon, {0.0, 1e30});
    table.read("relative", noise.relative, {0.0, 1.0});
    table.finish();
  } else {
    interior.read("noise", noise.relative, {0.0, 1.0});
  }
}

void read_depth(TomlSection& interior, InteriorConfig& config) {
  interior.read("depth", config.depth);
  if (interior.has("depth") && interior.has("camera"))
    interior.problem("depth", "belongs to one picture: a camera's frames have none; leave it out");
  for (const char* key : {"depth_unit_m", "depth_noise_m"})
    if (interior.has(key) && !interior.has("depth"))
      interior.problem(key, "is only used with depth");
  interior.read("depth_unit_m", config.depth_unit_m, {1e-6, 1.0});
  interior.read("depth_noise_m", config.depth_noise_m, {0.0, 1.0});
}

void read_interior_section(TomlSection interior, InteriorConfig& config) {
  detail::read_camera(interior, config.camera);
  if (!interior.read("image", config.image) && !interior.has("image") && !interior.has("camera"))
    interior.problem("", "needs image, the camera picture, or camera");
  if (interior.has("image") && interior.has("camera"))
    interior.problem("camera", "given together with image; keep one");
  if (!interior.read("lens", config.lens) && !interior.has("lens"))
    interior.problem("", "needs lens, the camera's YAML file");
  detail::read_response(interior, config.response);
  read_scale(interior, config);
  interior.read("colour_matrix", config.colour_matrix);
  if (std::abs(glm::determinant(config.colour_matrix)) < 1e-9)
    interior.problem("colour_matrix", "has no inverse");
  interior.read("blur_px", config.blur_px, {0.0, kMostBlur_px});
  read_noise(interior, config.noise);
  read_depth(interior, config);
  interior.finish();
}

enum class Use { run, view };

void read_room_section(TomlSection room, Use use, RunConfig& config) {
  room.read("model", config.room_model);
  if (!room.read("volume", config.volume) && !room.has("volume") && use == Use::run)
    room.problem("", "needs volume, made by daylit-precompute");
  if (!room.has("model") && use == Use::view)
    room.problem("", "needs model, the OBJ or glTF file");
  detail::read_glossy_room(room, config);
  room.finish();
}

RunConfig read_sections(TomlSection& root, ConfigFile& file, Use use) {
  RunConfig config;
  for (const char* required : {"sky", "interior", "room"})
    if (!root.has(required))
      file.report(1, fmt::format("section [{}] is missing", required));
  if (TomlSection sky = root.section("sky"))
    detail::read_sky_picture(sky, config.sky);
  if (TomlSection interior = root.section("interior")) {
    read_interior_section(interior, config.interior);
    if (config.sky.camera && config.interior.camera && config.sky.camera->camera == config.interior.camera->camera)
      interior.problem("camera",
                       "is that of [sky] too: two cameras are needed; of two with the same id give addresses");
  }
  detail::read_marker(root.section("marker"), config.marker);
  detail::read_pose(root.section("pose"), config.world_from_camera);
  if (TomlSection room = root.section("room"))
    read_room_section(room, use, config);
  detail::read_objects(root, config.objects);
  detail::read_light(root.section("light"), config);
  detail::read_output(root.section("output"), config.output);
  detail::read_http(root.section("http"), config.http);
  root.finish();
  return config;
}

} // namespace

Result<RunConfig> read_run_config(const std::filesystem::path& path) {
  auto file = detail::parse_config_file(path);
  if (!file)
    return file.error();
  TomlSection root(*file, &file->root, "");
  const RunConfig config = read_sections(root, *file, Use::run);
  if (!root.has("marker") && !root.has("pose"))
    file->report(1, "neither [marker] nor [pose]: the camera's pose is not known");
  if (config.sky.camera.has_value() != config.interior.camera.has_value())
    file->report(1, fmt::format("[{}] has a camera and [{}] has none: give both a camera, or both an image",
                                config.sky.camera ? "sky" : "interior", config.sky.camera ? "interior" : "sky"));
  if (config.http && !config.is_live())
    root.problem("http", "has no effect without [sky] camera and [interior] camera");
  if (config.interior.scale_from_marker && !config.marker)
    file->report(1, "[interior] scale = \"marker\" needs a [marker] section");
  if (config.marker && config.world_from_camera && !config.interior.scale_from_marker)
    root.problem("marker", "has no effect beside [pose]; keep one of them, or set [interior] scale = \"marker\"");
  if (config.objects.empty() && !root.has("object"))
    file->report(1, "no [[object]]: there is nothing to draw");
  if (auto error = file->error())
    return *error;
  return config;
}

Result<RunConfig> read_view_config(const std::filesystem::path& path) {
  auto file = detail::parse_config_file(path);
  if (!file)
    return file.error();
  TomlSection root(*file, &file->root, "");
  const RunConfig config = read_sections(root, *file, Use::view);
  if (config.sky.camera || config.interior.camera)
    file->report(1, "a live camera is no picture: give [sky] image and [interior] image");
  if (auto error = file->error())
    return *error;
  return config;
}

std::string to_toml(const RunConfig& c) {
  std::string out = detail::sky_picture_toml(c.sky);
  out +=
      "\n[interior]\n" + (c.interior.camera ? detail::camera_toml(c.interior.camera)
                                            : fmt::format("image = {}\n", detail::quoted(c.interior.image.string())));
  out += fmt::format("lens = {}\nresponse = {}\nscale = {}\n", detail::quoted(c.interior.lens.string()),
                     detail::quoted(c.interior.response),
                     c.interior.scale_from_marker ? "\"marker\"" : detail::text(c.interior.scale));
  if (c.interior.colour_matrix != glm::dmat3(1.0)) {
    const glm::dmat3 m = glm::transpose(c.interior.colour_matrix);
    out += fmt::format("colour_matrix = [{}, {}, {}]\n", detail::text(m[0]), detail::text(m[1]), detail::text(m[2]));
  }
  if (c.interior.blur_px > 0.0)
    out += fmt::format("blur_px = {}\n", detail::text(c.interior.blur_px));
  if (const CameraNoise& n = c.interior.noise; n.any())
    out += fmt::format("noise = {{ floor = {}, photon = {}, relative = {} }}\n", detail::text(n.floor),
                       detail::text(n.photon), detail::text(n.relative));
  if (!c.interior.depth.empty())
    out += fmt::format("depth = {}\ndepth_unit_m = {}\ndepth_noise_m = {}\n", detail::quoted(c.interior.depth.string()),
                       detail::text(c.interior.depth_unit_m), detail::text(c.interior.depth_noise_m));
  out += detail::marker_toml(c.marker) + detail::pose_toml(c.world_from_camera);
  out += "\n[room]\n";
  if (!c.room_model.empty())
    out += fmt::format("model = {}\n", detail::quoted(c.room_model.string()));
  out += fmt::format("volume = {}\n", detail::quoted(c.volume.string()));
  out += detail::glossy_room_toml(c.glossy_room);
  out += detail::objects_toml(c.objects);
  out += detail::light_toml(c);
  return out + detail::output_toml(c.output) + detail::http_toml(c.http);
}

Result<SkyImage> read_sky(const SkyConfig& sky, std::vector<std::string>* notes) {
  const std::string projection = sky.projection == "fisheye" ? "fisheye:" + sky.lens.string() : sky.projection;
  const auto parsed = parse_projection(projection, sky.rotation, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0});
  if (!parsed)
    return parsed.error();
  const auto fall_off = sky.fall_off.empty() ? Result<FallOff>(FallOff{}) : read_fall_off(sky.fall_off);
  if (!fall_off)
    return fall_off.error();
  return read_sky(sky.image, *parsed, sky.ground, notes, *fall_off);
}

glm::dmat4 look_at(const glm::dvec3& position, const glm::dvec3& target) {
  const glm::dvec3 forward = glm::normalize(target - position);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0.0, 0.0, 1.0)));
  const glm::dvec3 down = glm::cross(forward, right);
  return {glm::dvec4(right, 0.0), glm::dvec4(down, 0.0), glm::dvec4(forward, 0.0), glm::dvec4(position, 1.0)};
}

glm::dmat4 object_transform(const ObjectConfig& object) {
  const glm::dvec3 angle = object.rotation_deg * kRadians;
  const glm::dvec3 s = glm::sin(angle), c = glm::cos(angle);
  const glm::dmat3 about_x(1, 0, 0, 0, c.x, s.x, 0, -s.x, c.x);
  const glm::dmat3 about_y(c.y, 0, -s.y, 0, 1, 0, s.y, 0, c.y);
  const glm::dmat3 about_z(c.z, s.z, 0, -s.z, c.z, 0, 0, 0, 1);
  const glm::dmat3 linear = about_z * about_y * about_x * object.scale;
  return {glm::dvec4(linear[0], 0.0), glm::dvec4(linear[1], 0.0), glm::dvec4(linear[2], 0.0),
          glm::dvec4(object.position, 1.0)};
}

} // namespace daylit
