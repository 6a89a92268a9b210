#include "scene/config/config_sections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "scene/material/library.h"

namespace daylit::detail {

namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kFar = 1e9; // metres: nothing in a room is further from the origin

void check_rigid(TomlSection& section, const std::string& key, const glm::dmat4& m) {
  if (!is_rigid(m))
    section.problem(key, "expected a rotation and a translation (last row 0 0 0 1, no scale, no mirror image)");
}

void read_ground(TomlSection& sky, GroundFill& ground) {
  if (!sky.has("ground"))
    return;
  TomlSection table = sky.section_if_table("ground");
  if (!table) {
    std::string word;
    sky.read_word("ground", word, {"none"});
    return;
  }
  ground.kind = GroundFill::Kind::albedo;
  table.read("albedo", ground.albedo, {0.0, 1.0});
  table.finish();
}

} // namespace

bool is_rigid(const glm::dmat4& m) {
  const glm::dmat3 r(m);
  const glm::dmat3 product = glm::transpose(r) * r;
  double error = 0.0;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k)
      error = std::max(error, std::abs(product[c][k] - (c == k ? 1.0 : 0.0)));
  return error < 1e-4 && glm::determinant(r) > 0.0 && m[0][3] == 0.0 && m[1][3] == 0.0 && m[2][3] == 0.0 &&
         m[3][3] == 1.0;
}

const char* wrong_view(const glm::dvec3& position, const glm::dvec3& target) {
  const glm::dvec3 view = target - position;
  if (!(glm::length(view) > 1e-6))
    return "the camera looks at its own position: give a point before it";
  const bool vertical = !(std::hypot(view.x, view.y) > 1e-6 * (1.0 + std::abs(view.z)));
  return vertical ? "the view is vertical: give a point that is not straight above or below" : nullptr;
}

void read_sky_picture(TomlSection sky, SkyConfig& config) {
  read_camera(sky, config.camera);
  read_sky_measurement(sky, config);
  if (!sky.read("image", config.image) && !sky.has("image") && !sky.has("camera"))
    sky.problem("", "needs image, an EXR or Radiance .hdr file, or camera");
  if (sky.has("image") && sky.has("camera"))
    sky.problem("camera", "given together with image; keep one");
  sky.read_word("projection", config.projection, {"equirect", "angular", "fisheye"});
  sky.read("lens", config.lens);
  sky.read("fall_off", config.fall_off);
  double degrees = 0.0;
  if (sky.read("rotation", degrees, {-3600.0, 3600.0}))
    config.rotation = degrees * kRadians;
  read_ground(sky, config.ground);
  if (config.projection == "fisheye" && config.lens.empty())
    sky.problem("projection", "\"fisheye\" needs lens, the camera's YAML file");
  if (config.projection != "fisheye" && sky.has("illuminance"))
    sky.problem("illuminance", "is only used with projection = \"fisheye\"");
  for (const char* key : {"lens", "fall_off"})
    if (config.projection != "fisheye" && sky.has(key))
      sky.problem(key, "is only used with projection = \"fisheye\"");
  if (config.projection == "fisheye" && config.ground.kind == GroundFill::Kind::none)
    sky.problem("projection", "\"fisheye\" needs ground = { albedo = ... }: the lens does not see the whole sphere");
  if (config.projection != "fisheye" && config.ground.kind != GroundFill::Kind::none)
    sky.problem("ground", "has no effect: projection = \"" + config.projection + "\" shows the whole sphere");
  sky.finish();
}

void read_pose(TomlSection root, std::optional<glm::dmat4>& world_from_camera) {
  if (!root)
    return;
  glm::dmat4 matrix(1.0);
  glm::dvec3 position(0.0), target(0.0);
  const bool given = root.read("world_from_camera", matrix);
  const bool at = root.read("position", position, {-kFar, kFar});
  const bool towards = root.read("look_at", target, {-kFar, kFar});
  if (given) {
    check_rigid(root, "world_from_camera", matrix);
    world_from_camera = matrix;
    if (at || towards)
      root.problem("world_from_camera", "given together with position or look_at; keep one");
  } else if (at && towards) {
    if (const char* wrong = wrong_view(position, target))
      root.problem("look_at", std::string(wrong) + ", or give world_from_camera");
    else
      world_from_camera = look_at(position, target);
  } else {
    root.problem("", "needs world_from_camera (16 numbers), or position and look_at");
  }
  root.finish();
}

void read_marker(TomlSection root, std::optional<MarkerConfig>& marker) {
  if (!root)
    return;
  MarkerConfig m;
  root.read("dictionary", m.dictionary);
  if (!root.read("ids", m.ids, {0, 100000}) && !root.has("ids"))
    root.problem("", "needs ids, for example ids = [23]");
  for (auto id = m.ids.begin(); id != m.ids.end(); ++id)
    if (std::find(m.ids.begin(), id, *id) != id)
      root.problem("ids", fmt::format("{} stands there twice; a marker is at one place of the board", *id));
  root.read("size_m", m.size_m, {1e-4, 100.0});
  if (root.read("columns", m.columns, {1, 1000}) && m.ids.size() % static_cast<std::size_t>(m.columns) != 0)
    root.problem("columns", fmt::format("{} ids do not fill rows of {}", m.ids.size(), m.columns));
  if (root.read("gap_m", m.gap_m, {0.0, 100.0}) && !root.has("columns"))
    root.problem("gap_m", "is only used with columns");
  root.read("white_reflectance", m.white_reflectance, {0.01, 1.0});
  if (root.read("world_from_board", m.world_from_board))
    check_rigid(root, "world_from_board", m.world_from_board);
  root.finish();
  marker = m;
}

namespace {

/// on = "material" with position = [x, y] or none, or on = [x, y]. Without `on`, position = [x, y, z].
void read_place(TomlSection& section, ObjectConfig& object) {
  if (!section.has("on")) {
    section.read("position", object.position, {-kFar, kFar});
    return;
  }
  object.on.emplace();
  const bool positioned = section.has("position");
  std::array<double, 2> place{};
  if (section.is_text("on")) {
    if (section.read("on", object.on->surface) && object.on->surface.empty())
      section.problem("on", "names no surface; give a material of the room, or [x, y]");
    object.on->has_place = positioned;
    if (positioned && section.read_array("position", place, {-kFar, kFar}))
      object.position = {place[0], place[1], 0.0};
  } else if (section.read_array("on", place, {-kFar, kFar})) {
    object.position = {place[0], place[1], 0.0};
    if (positioned)
      section.problem("position", "given together with on = [x, y]; keep one");
  }
}

} // namespace

void read_objects(TomlSection& root, std::vector<ObjectConfig>& objects) {
  for (TomlSection section : root.sections("object")) {
    ObjectConfig object;
    if (!section.read("model", object.model) && !section.has("model"))
      section.problem("", "needs model, an OBJ, PLY or glTF file");
    read_place(section, object);
    section.read("rotation", object.rotation_deg, {-3600.0, 3600.0});
    section.read("scale", object.scale, {1e-6, 1e6});
    if (Rgb c(0.0f); section.read_rgb("reflectance", c, {0.0, 1.0}))
      object.reflectance = c;
    section.read_word("material", object.material, library_names());
    section.finish();
    objects.push_back(object);
  }
}

void read_glossy_room(TomlSection& room, RunConfig& config) {
  TomlSection glossy = room.section("glossy");
  for (const std::string& material : glossy.keys())
    glossy.read(material, config.glossy_room[material], {0.0, 1.0});
  glossy.finish();
}

void read_light(TomlSection root, RunConfig& config) {
  root.read("samples", config.light_samples, {1, 4096});
  root.read("indirect_shadow", config.indirect_shadow);
  if (std::string by; root.read_word("reflect_by", by, {"rays", "maps"}))
    config.reflect_by = by == "maps" ? ReflectBy::maps : ReflectBy::rays;
  root.finish();
}

void read_output(TomlSection root, OutputConfig& output) {
  root.read("png", output.png);
  root.read("exr", output.exr);
  root.read("mask", output.mask);
  root.read_size("size", output.width_px, output.height_px);
  root.finish();
}

std::string sky_picture_toml(const SkyConfig& sky) {
  std::string out = (sky.camera ? "[sky]\n" + camera_toml(sky.camera) + sky_measurement_toml(sky)
                                : fmt::format("[sky]\nimage = {}\n", quoted(sky.image.string()))) +
                    fmt::format("projection = {}\n", quoted(sky.projection));
  if (!sky.lens.empty())
    out += fmt::format("lens = {}\n", quoted(sky.lens.string()));
  if (!sky.fall_off.empty())
    out += fmt::format("fall_off = {}\n", quoted(sky.fall_off.string()));
  out += fmt::format("rotation = {}\n", text(sky.rotation / kRadians));
  if (sky.ground.kind != GroundFill::Kind::none)
    out += fmt::format("ground = {{ albedo = {} }}\n", sky.ground.albedo);
  return out;
}

std::string pose_toml(const std::optional<glm::dmat4>& world_from_camera) {
  return world_from_camera ? "\n[pose]\nworld_from_camera = " + text(*world_from_camera) : "";
}

std::string marker_toml(const std::optional<MarkerConfig>& marker) {
  if (!marker)
    return "";
  const std::string grid =
      marker->columns > 0 ? fmt::format("columns = {}\ngap_m = {}\n", marker->columns, text(marker->gap_m)) : "";
  return fmt::format("\n[marker]\ndictionary = {}\nids = [{}]\n{}size_m = {}\nwhite_reflectance = {}\n"
                     "world_from_board = {}",
                     quoted(marker->dictionary), fmt::join(marker->ids, ", "), grid, text(marker->size_m),
                     text(marker->white_reflectance), text(marker->world_from_board));
}

PlaceText place_text(const ObjectConfig& o) {
  if (!o.on)
    return {"position", text(o.position), {o.position.x, o.position.y, o.position.z}};
  if (!o.on->has_place)
    return {};
  return {o.on->surface.empty() ? "on" : "position",
          fmt::format("[{}, {}]", text(o.position.x), text(o.position.y)),
          {o.position.x, o.position.y}};
}

std::string objects_toml(const std::vector<ObjectConfig>& objects) {
  std::string out;
  for (const ObjectConfig& o : objects) {
    out += fmt::format("\n[[object]]\nmodel = {}\n", quoted(o.model.string()));
    if (o.on && !o.on->surface.empty())
      out += "on = " + quoted(o.on->surface) + "\n";
    if (const PlaceText place = place_text(o); !place.key.empty())
      out += place.key + " = " + place.value + "\n";
    out += fmt::format("rotation = {}\nscale = {}\n", text(o.rotation_deg), text(o.scale));
    if (o.reflectance)
      out += "reflectance = " + text(*o.reflectance) + "\n";
    if (!o.material.empty())
      out += "material = " + quoted(o.material) + "\n";
  }
  return out;
}

std::string glossy_room_toml(const std::map<std::string, double>& glossy) {
  std::string out;
  for (const auto& [material, reflectance] : glossy)
    out += fmt::format("{}{} = {}", out.empty() ? "glossy = { " : ", ", quoted(material), text(reflectance));
  return out.empty() ? out : out + " }\n";
}

std::string light_toml(const RunConfig& c) {
  return fmt::format("\n[light]\nsamples = {}\nindirect_shadow = {}\nreflect_by = \"{}\"\n", c.light_samples,
                     c.indirect_shadow, c.reflect_by == ReflectBy::maps ? "maps" : "rays");
}

std::string output_toml(const OutputConfig& output) {
  std::string out = "\n[output]\n";
  if (!output.png.empty())
    out += "png = " + quoted(output.png.string()) + "\n";
  if (!output.exr.empty())
    out += "exr = " + quoted(output.exr.string()) + "\n";
  if (!output.mask.empty())
    out += "mask = " + quoted(output.mask.string()) + "\n";
  if (output.width_px > 0)
    out += fmt::format("size = [{}, {}]\n", output.width_px, output.height_px);
  return out;
}

} // namespace daylit::detail
