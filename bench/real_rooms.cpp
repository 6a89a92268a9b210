#include "bench/real_rooms.h"

#include <algorithm>
#include <cstdint>

#include "bench/chance.h"
#include "scene/room/ray_scene.h"

namespace daylit::bench {

namespace {

constexpr int kTriesPerPoint = 1000;

/// Another one for each place: rooms alike have other points.
std::uint32_t seed_of(const RealRoom& room, const Place& place) {
  const auto at = std::ranges::find(room.places, place.name, &Place::name);
  return 1 + static_cast<std::uint32_t>(at - room.places.begin());
}

bool is_filled(const RealRoom& room, const glm::dvec3& p) {
  for (const Space& s : room.model.filled())
    if (p.x >= s.low.x && p.y >= s.low.y && p.z >= s.low.z && p.x <= s.high.x && p.y <= s.high.y && p.z <= s.high.z)
      return true;
  return false;
}

} // namespace

std::vector<RealRoom> real_rooms() {
  std::vector<RealRoom> rooms;
  for (const auto make : {school_wing, hall, home, louvred_classroom, atrium, furnished_living_room, dim_side_room})
    rooms.push_back(make());
  return rooms;
}

std::string real_rooms_mtl() {
  return "newmtl white\nKd 0.78 0.78 0.76\nnewmtl ceiling\nKd 0.84 0.84 0.84\nnewmtl floor\nKd 0.34 0.26 0.2\n"
         "newmtl wood\nKd 0.5 0.36 0.22\nnewmtl cloth\nKd 0.25 0.3 0.42\nnewmtl leaf\nKd 0.12 0.3 0.08\n"
         "newmtl facade\nKd 0.42 0.38 0.34\nnewmtl ground\nKd 0.2 0.2 0.19\nnewmtl metal\nKd 0.55 0.55 0.56\n"
         "newmtl window\nKd 0 0 0\nTf 0.75 0.77 0.75\n";
}

Result<std::vector<glm::dvec3>> points_in(const RealRoom& room, const Room& geometry, const Place& place,
                                          double clearance_m) {
  const auto rays = RayScene::build(geometry);
  if (!rays)
    return rays.error();
  Chance chance(seed_of(room, place));
  const glm::dvec3 low = place.air.low + clearance_m, size = place.air.high - place.air.low - 2 * clearance_m;
  std::vector<glm::dvec3> points;
  for (int i = 0; i < kTriesPerPoint * place.points && std::ssize(points) < place.points; ++i) {
    const double x = chance.between(0, 1), y = chance.between(0, 1), z = chance.between(0, 1);
    const glm::dvec3 p = low + size * glm::dvec3(x, y, z);
    const auto reach = static_cast<float>(clearance_m);
    if (!is_filled(room, p) && rays->distance(rays->to_local(p), reach) >= reach)
      points.push_back(p);
  }
  if (std::ssize(points) < place.points)
    return Error{ErrorCode::geometry_invalid, "too little air for points", room.name + ", " + place.name, ""};
  return points;
}

} // namespace daylit::bench
