#include "scene/placing/set_down.h"

#include <algorithm>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "scene/placing/surface_below.h"

namespace daylit {

namespace {

std::string name_of(const ObjectConfig& object) { return object.model.filename().string(); }

Error named(Error error, const ObjectConfig& object) {
  error.where = name_of(object) + ", on, " + error.where;
  return error;
}

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
    const auto middle = middle_of(room, object.on->surface);
    if (!middle)
      return named(middle.error(), object);
    placed.position = {origin_above(*middle, placed, mesh), 0.0};
    placed.on = StandsOn{object.on->surface, true};
  }
  const glm::dmat4 transform = object_transform(placed);
  const Bounds box = placed_bounds(mesh.mesh, transform);
  const glm::dvec2 mass(transform * glm::dvec4(mesh.weight.centre_of_mass, 1.0));
  const auto surface = surface_below(room, rays, mass, placed.on->surface, box.size().z);
  if (!surface)
    return named(surface.error(), object);
  const double lift = lies_on_a_sheet(mesh, transform, box.min.z) ? kLift_m : 0.0;
  placed.position.z += surface->height_m + lift - box.min.z;
  return placed;
}

std::vector<std::string> standing_warnings(const ObjectConfig& object, const WeighedMesh& mesh, const Room& room,
                                           const RayScene& rays) {
  if (!object.on || mesh.mesh.positions.empty())
    return {};
  const glm::dmat4 transform = object_transform(object);
  return standing_warnings(name_of(object), check_standing(mesh, transform, room, rays),
                           glm::length(placed_bounds(mesh.mesh, transform).size()));
}

} // namespace daylit
