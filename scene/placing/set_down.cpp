#include "scene/placing/set_down.h"

#include <algorithm>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/vec4.hpp>

#include "scene/placing/surface_below.h"

namespace daylit {

namespace {

std::string name_of(const ObjectConfig& object) { return object.model.filename().string(); }

constexpr double kTouch_m = 3e-3, kTouchPart = 5e-3;

constexpr double kFlat_m = 1e-4;   // a face whose corners are no higher lies on what is below,
constexpr double kLift_m = 0.5e-3; // and is seen from above only if it lies that far before it

/// An open mesh lies on a face of its own: a sheet of paper, a box without a lid.
bool lies_on_a_sheet(const WeighedMesh& object, const glm::dmat4& transform, double lowest) {
  const auto is_low = [&](std::uint32_t v) {
    return (transform * glm::dvec4(glm::dvec3(object.mesh.positions[v]), 1.0)).z < lowest + kFlat_m;
  };
  return !object.weight.closed &&
         std::ranges::any_of(object.mesh.triangles, [&](const auto& t) { return std::ranges::all_of(t, is_low); });
}

/// Takes 3 mm, or 0.5 % of its size, from every side of a box: what touches a wall or the floor is not cut by it.
glm::dmat4 shrunk(const Bounds& box) {
  const glm::dvec3 size = glm::max(box.size(), glm::dvec3(1e-9));
  const glm::dvec3 scale = 1.0 - glm::min(2.0 * glm::max(glm::dvec3(kTouch_m), kTouchPart * size) / size, 0.5);
  return glm::translate(glm::scale(glm::translate(glm::dmat4(1.0), box.centre()), scale), -box.centre());
}

double longest(const Bounds& box) {
  const glm::dvec3 size = box.size();
  return std::max({size.x, size.y, size.z});
}

/// Empty for an object that fits into the room.
std::string other_unit(const Bounds& object, const Room& room) {
  const double length = longest(object), most = longest(room.bounds());
  return length <= most ? ""
                        : fmt::format("it is {:.3g} m long, the room {:.3g} m: a model in millimetres needs scale = "
                                      "0.001, one in centimetres 0.01",
                                      length, most);
}

Error named(Error error, const ObjectConfig& object, const Bounds& box, const Room& room) {
  error.where = name_of(object) + ", on, " + error.where;
  if (std::string hint = other_unit(box, room); !hint.empty())
    error.hint = std::move(hint);
  return error;
}

/// x and y of the object's origin for which its centre of mass is above a place.
glm::dvec2 origin_above(const glm::dvec2& place, const ObjectConfig& object, const WeighedMesh& mesh) {
  const glm::dvec4 mass = object_transform(object) * glm::dvec4(mesh.weight.centre_of_mass, 1.0);
  return place - glm::dvec2(mass) + glm::dvec2(object.position);
}

} // namespace

Result<ObjectConfig> set_down(const ObjectConfig& object, const WeighedMesh& mesh, const Room& room,
                              const RayScene& rays) {
  if (!object.on || mesh.mesh.positions.empty())
    return object;
  ObjectConfig placed = object;
  if (!object.on->has_place) {
    const Bounds there = placed_bounds(mesh.mesh, object_transform(object));
    const auto middle = middle_of(room, rays, object.on->surface, there.size().z);
    if (!middle)
      return named(middle.error(), object, there, room);
    placed.position = {origin_above(*middle, placed, mesh), 0.0};
    placed.on = StandsOn{object.on->surface, true};
  }
  const glm::dmat4 transform = object_transform(placed);
  const Bounds box = placed_bounds(mesh.mesh, transform);
  const glm::dvec2 mass(transform * glm::dvec4(mesh.weight.centre_of_mass, 1.0));
  const auto surface = surface_below(room, rays, mass, placed.on->surface, box.size().z);
  if (!surface)
    return named({surface.error().code, surface.error().what, "its centre of mass " + surface.error().where,
                  surface.error().hint},
                 object, box, room);
  const double lift = lies_on_a_sheet(mesh, transform, box.min.z) ? kLift_m : 0.0;
  placed.position.z += surface->height_m + lift - box.min.z;
  return placed;
}

std::vector<std::string> standing_warnings(const ObjectConfig& object, const WeighedMesh& mesh, const Room& room,
                                           const RayScene& rays) {
  if (mesh.mesh.positions.empty())
    return {};
  const glm::dmat4 transform = object_transform(object);
  const Bounds box = placed_bounds(mesh.mesh, transform);
  if (const std::string hint = other_unit(box, room); !hint.empty())
    return {name_of(object) + " is larger than the room: " + hint};
  if (object.on) {
    auto lines =
        standing_warnings(name_of(object), check_standing(mesh, transform, room, rays), glm::length(box.size()));
    if (!object.on->surface.empty() && box.min.z > room.bounds().max.z - kTouch_m)
      lines.push_back(fmt::format("{} stands on the highest surface of the model, which may be its roof: \"{}\" has no "
                                  "place below a ceiling there; give the material of a surface inside, or on = [x, y]",
                                  name_of(object), object.on->surface));
    return lines;
  }
  Standing free = check_standing(mesh, shrunk(box) * transform, room, rays);
  free.supported = true; // it may hang, or be held
  free.beyond_m = 0.0;
  return standing_warnings(name_of(object), free, glm::length(box.size()));
}

} // namespace daylit
