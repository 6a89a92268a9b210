#include "scene/placing/surface_below.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/lower_case.h"

namespace daylit {

namespace {

constexpr int kWalks = 256, kSteps = 64; // through a window of 1 % of the walls one of 16,384 steps leads surely
constexpr double kApart_m = 1e-4;        // faces closer than that are one surface: the upper one
constexpr double kLevel = 0.94;          // cosine of 20 degrees: level enough to stand on
constexpr float kFar = std::numeric_limits<float>::max();

glm::vec3 sphere_direction(float u, float v) {
  const float z = 1.0f - 2.0f * u, r = std::sqrt(std::max(0.0f, 1.0f - z * z)),
              a = 2.0f * std::numbers::pi_v<float> * v;
  return {r * std::cos(a), r * std::sin(a), z};
}

/// Everything that a vertical line meets, from above; faces on faces once.
std::vector<SurfaceBelow> surfaces_along(const RayScene& rays, const Bounds& bounds, const glm::dvec2& place) {
  std::vector<SurfaceBelow> found;
  const glm::vec3 top = rays.to_local({place, bounds.max.z + 1.0}), down(0.0f, 0.0f, -1.0f);
  RayHit hit;
  for (float from = 0.0f; rays.closest(top, down, from, kFar, hit);
       from = std::nextafter(hit.distance + static_cast<float>(kApart_m), kFar))
    found.push_back({bounds.max.z + 1.0 - static_cast<double>(hit.distance), hit.triangle});
  return found;
}

const std::string& name_of(const Room& room, const SurfaceBelow& s) {
  return room.material(room.triangles[s.triangle]).name;
}

bool has_material(const Room& room, const std::string& name) {
  return std::ranges::any_of(room.materials,
                             [&](const Material& m) { return same_name(m.name, name) && !m.is_window; });
}

/// "below are ..."
std::string said_below(const Room& room, const std::vector<SurfaceBelow>& surfaces) {
  std::vector<std::string> names;
  for (const SurfaceBelow& s : surfaces)
    if (std::ranges::find(names, name_of(room, s)) == names.end())
      names.push_back(name_of(room, s));
  return names.size() == 1 ? fmt::format("below is \"{}\"", names[0])
                           : fmt::format("below are \"{}\"", fmt::join(names, "\", \""));
}

/// On the border of the model rounding decides whether a vertical line meets it: such a place counts as just inside.
glm::dvec2 off_the_border(const glm::dvec2& place, const Bounds& bounds) {
  const glm::dvec2 inside = glm::clamp(place, glm::dvec2(bounds.min) + kApart_m, glm::dvec2(bounds.max) - kApart_m);
  return glm::length(inside - place) < 2.0 * kApart_m ? inside : place;
}

/// Surfaces of one vertical line on which something can stand, highest first.
class StandingPlaces {
public:
  StandingPlaces(const Room& room, const RayScene& rays, const glm::dvec2& place, double free_m)
      : room_(room), rays_(rays), place_(off_the_border(place, room.bounds())), free_m_(free_m),
        all_(surfaces_along(rays, room.bounds(), place_)) {}

  const std::vector<SurfaceBelow>& all() const { return all_; }
  /// Is there air of the wanted height above surface k? Above the first one is the sky.
  bool usable(std::size_t k) const {
    const double height = k == 0 ? std::numeric_limits<double>::infinity() : all_[k - 1].height_m - all_[k].height_m;
    const double middle = all_[k].height_m + 0.5 * std::min(height, std::max(free_m_, 2 * kApart_m));
    return height >= free_m_ - kApart_m && (k == 0 || is_in_air(room_, rays_, rays_.to_local({place_, middle})));
  }

private:
  const Room& room_;
  const RayScene& rays_;
  glm::dvec2 place_;
  double free_m_;
  std::vector<SurfaceBelow> all_;
};

} // namespace

/// Light walks as it does between diffuse surfaces: new directions weighted by the cosine, as a normal plus a point of
/// the unit sphere.
bool is_in_air(const Room& room, const RayScene& rays, const glm::vec3& point) {
  std::mt19937 random(1);
  const auto uniform = [&random] { return static_cast<float>(random()) * 0x1p-32f; };
  for (int walk = 0; walk < kWalks; ++walk) {
    glm::vec3 at = point, way = sphere_direction(uniform(), uniform());
    for (int step = 0; step < kSteps; ++step) {
      RayHit hit;
      if (!rays.closest(at, way, 0.0f, kFar, hit))
        return true;
      glm::vec3 normal(glm::normalize(area_normal(room, room.triangles[hit.triangle])));
      if (glm::dot(normal, way) > 0.0f)
        normal = -normal;
      at += hit.distance * way + rays.surface_offset() * normal;
      const glm::vec3 next = normal + 0.999f * sphere_direction(uniform(), uniform());
      way = glm::normalize(next);
    }
  }
  return false;
}

Result<SurfaceBelow> surface_below(const Room& room, const RayScene& rays, const glm::dvec2& place,
                                   const std::string& name, double free_m) {
  const StandingPlaces line(room, rays, place, free_m);
  const bool lowest = same_name(name, "floor") && !has_material(room, name), any = name.empty() || lowest;
  const auto wanted = [&](std::size_t k) { return any || same_name(name_of(room, line.all()[k]), name); };
  std::vector<std::size_t> order;
  for (std::size_t k = 1; k < line.all().size(); ++k)
    if (wanted(k))
      order.push_back(k);
  if (lowest)
    std::ranges::reverse(order);
  // Above the first is the sky: a room without a ceiling, whose walls are higher, or a roof, on which nothing stands.
  if (!line.all().empty() && wanted(0) &&
      (!any || line.all().size() == 1 || line.all()[0].height_m < room.bounds().max.z - kApart_m))
    order.push_back(0);
  for (const std::size_t k : order)
    if (line.usable(k))
      return line.all()[k];
  const std::string where = fmt::format("({:.2f}, {:.2f})", place.x, place.y);
  if (!order.empty())
    return Error{ErrorCode::not_found,
                 fmt::format("nothing {:.2f} m high can stand on {} there", free_m, name.empty() ? "a surface" : name),
                 where, "what is above is too low, or the place lies inside furniture: move or scale the object"};
  return Error{ErrorCode::not_found,
               name.empty() ? "nothing of the room is below" : fmt::format("no surface \"{}\" is below", name), where,
               line.all().empty() ? "give a place above a surface of the room"
                                  : said_below(room, line.all()) + ": give another place, or the name of a material"};
}

namespace {

/// Faces of one height.
struct Level {
  double height_m = 0.0, area = 0.0;
  glm::dvec2 sum{0.0}; ///< of their middles, weighted by area
  glm::dvec2 middle() const { return sum / area; }
};

/// Of the level faces of that material, highest first.
std::vector<Level> levels_of(const Room& room, const std::string& name) {
  std::vector<Level> faces, levels;
  for (const RoomTriangle& t : room.triangles) {
    const glm::dvec3 n = area_normal(room, t),
                     middle = (room.corner(t, 0) + room.corner(t, 1) + room.corner(t, 2)) / 3.0;
    const double size = glm::length(n);
    if (same_name(room.material(t).name, name) && !room.is_window(t) && std::abs(n.z) > kLevel * size)
      faces.push_back({middle.z, size, size * glm::dvec2(middle)});
  }
  std::ranges::stable_sort(faces, std::greater(), &Level::height_m);
  for (const Level& face : faces)
    if (levels.empty() || face.height_m < levels.back().height_m - kApart_m) {
      levels.push_back(face);
    } else {
      levels.back().area += face.area;
      levels.back().sum += face.sum;
    }
  return levels;
}

} // namespace

/// A roof and the back of a ceiling are levels too, and often of the material of the walls.
Result<glm::dvec2> middle_of(const Room& room, const RayScene& rays, const std::string& name, double free_m) {
  const std::vector<Level> levels = levels_of(room, name);
  if (levels.empty())
    return Error{ErrorCode::not_found, fmt::format("the room has no level face of the material \"{}\"", name), name,
                 "give the name of a material of the room, or on = [x, y]"};
  for (const Level& level : levels) {
    const StandingPlaces line(room, rays, level.middle(), free_m);
    for (std::size_t k = 1; k < line.all().size(); ++k)
      if (std::abs(line.all()[k].height_m - level.height_m) < kApart_m && line.usable(k))
        return level.middle();
  }
  return levels.front().middle();
}

} // namespace daylit
