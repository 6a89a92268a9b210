#include "precompute/standing_faces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <glm/geometric.hpp>

#include "scene/room/ray_scene.h"

namespace daylit::precompute {

namespace {

constexpr double kLevel = 0.99;      ///< |normal z| of a face on which things stand
constexpr double kSameHeight = 2e-3; ///< metres
constexpr double kFreeHeight = 0.10; ///< metres of air above
constexpr double kLeastArea_m2 = 0.05;
constexpr double kLowest = 0.01, kHighest = 0.30;            ///< metres above a face: where objects are
constexpr float kClear = 0.009f;                             ///< metres from everything: nothing touches a wall
constexpr std::array<double, 3> kHeights{0.015, 0.08, 0.25}; ///< metres of planes above a face
constexpr std::array<double, 3> kInside{0.015, 0.045, 0.1};  ///< metres from an edge
constexpr std::array<double, 2> kBefore{0.015, 0.06};        ///< metres before the sides of furniture,
constexpr std::array<double, 2> kLower{0.015, 0.08};         ///< and there, metres below its top
constexpr double kSides = 0.12;                              ///< metres before a side: so far these are wanted
constexpr double kNarrow = 0.5;                              ///< metres, of a shelf or a sill
constexpr double kShared = 0.3;               ///< so far, of its distance from a face or wall, may a plane be elsewhere
constexpr double kSharedEdge = 0.02;          ///< metres, the same inside an edge
constexpr double kRectangle = 0.98;           ///< area / that of the box around it
constexpr double kBeside = 0.6, kReach = 0.5; ///< metres around a face: so far its planes are wanted
constexpr std::size_t kMostPlanes = 48;       ///< per axis

bool is_level(const Room& room, const RoomTriangle& t) {
  const glm::dvec3 n = area_normal(room, t);
  return !room.is_window(t) && std::abs(n.z) > kLevel * glm::length(n);
}

/// Above the middle, or halfway from it to a corner: something may stand on a table already.
bool has_air_above(const Room& room, const RayScene& rays, const RoomTriangle& t) {
  const glm::dvec3 middle = (room.corner(t, 0) + room.corner(t, 1) + room.corner(t, 2)) / 3.0;
  const float off = std::max(1e-3f, 4.0f * rays.surface_offset());
  const auto free = [&](const glm::dvec3& p) {
    return !rays.occluded(rays.to_local(p), {0.0f, 0.0f, 1.0f}, off, static_cast<float>(kFreeHeight));
  };
  return free(middle) || free(0.5 * (middle + room.corner(t, 0))) || free(0.5 * (middle + room.corner(t, 1))) ||
         free(0.5 * (middle + room.corner(t, 2)));
}

/// Union-find over corners that lie at one place.
class Joined {
public:
  std::size_t place(const glm::dvec3& p) {
    const auto key =
        std::array{std::llround(p.x / kSameHeight), std::llround(p.y / kSameHeight), std::llround(p.z / kSameHeight)};
    const auto [found, added] = places_.try_emplace(key, parent_.size());
    if (added)
      parent_.push_back(parent_.size());
    return found->second;
  }
  std::size_t root(std::size_t i) const {
    while (parent_[i] != i)
      i = parent_[i];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parent_[root(a)] = root(b); }

private:
  std::map<std::array<long long, 3>, std::size_t> places_;
  std::vector<std::size_t> parent_;
};

void include(const Room& room, const RoomTriangle& t, StandingFace& face) {
  face.area_m2 += area_m2(room, t);
  for (int k = 0; k < 3; ++k)
    face.box.include(room.corner(t, k));
  face.triangles.push_back(t);
}

bool is_rectangle(const StandingFace& face) {
  const glm::dvec3 size = face.box.size();
  return face.area_m2 > kRectangle * size.x * size.y;
}

/// The air above a face where its own planes are wanted. Beside one without planes at its
/// edges the first probes that a point above it is interpolated from may stand as far off as probes are apart.
Bounds above(const StandingFace& face, double height_m) {
  Bounds air = face.box;
  const double beside = is_rectangle(face) ? kSharedEdge : kBeside;
  for (int k = 0; k < 2; ++k) {
    air.min[k] -= beside;
    air.max[k] += beside;
  }

  air.max.z += height_m;
  return air;
}

/// Planes beside both ends of a rectangle: inside an edge that objects can stand at, or off a wall of the room, where
/// the outermost probes stand anyway. What is close to an edge is most of a sill or shelf, little of a floor, and
/// beside a pane light falls off within centimetres: their planes stand off walls, too.
void add_beside_edges(const StandingFace& face, const Bounds& room, int axis, std::vector<ProbePlane>& planes) {
  const Bounds near = above(face, kReach), high = above(face, room.max.z - face.box.max.z);
  const bool narrow = face.box.size()[axis] < kNarrow;
  const Bounds& inside = narrow ? high : near;
  for (const double inwards : {1.0, -1.0}) {
    const double edge = inwards > 0 ? face.box.min[axis] : face.box.max[axis],
                 wall = inwards > 0 ? room.min[axis] : room.max[axis];
    const bool at_wall = std::abs(edge - wall) < kSharedEdge;
    if (!at_wall || narrow)
      add_plane(planes, edge + inwards * kInside[0], kSharedEdge, inside);
    if (narrow)
      add_plane(planes, edge + inwards * kInside[1], kSharedEdge, inside);
    add_plane(planes, edge + inwards * kInside[2], at_wall ? kShared * kInside[2] : kSharedEdge,
              at_wall ? high : inside);
  }
}

/// The air before a side of what ends in the face.
Bounds before_side(const StandingFace& face, int axis, double outwards) {
  Bounds air = face.box;
  for (int k = 0; k < 2; ++k) {
    air.min[k] -= k == axis ? kSides : kSharedEdge;
    air.max[k] += k == axis ? kSides : kSharedEdge;
  }
  (outwards > 0 ? air.min : air.max)[axis] = outwards > 0 ? face.box.max[axis] : face.box.min[axis];
  air.min.z -= kReach;
  air.max.z += kSides;
  return air;
}

void add_beside(std::vector<ProbePlane>& planes, double at, double distance_m, const Bounds& air) {
  const auto known =
      std::ranges::find_if(planes, [&](const ProbePlane& p) { return std::abs(p.at - at) <= kShared * distance_m; });
  if (known != planes.end())
    known->beside.push_back(air);
  else if (planes.size() < kMostPlanes)
    planes.push_back({at, {air}, {}, true});
}

void add_before_sides(const StandingFace& face, const Bounds& room, Planes& planes) {
  for (int axis = 0; axis < 2; ++axis)
    for (const double outwards : {1.0, -1.0}) {
      const double side = outwards > 0 ? face.box.max[axis] : face.box.min[axis],
                   wall = outwards > 0 ? room.max[axis] : room.min[axis];
      if (std::abs(side - wall) < kSharedEdge)
        continue;
      const Bounds air = before_side(face, axis, outwards);
      for (const double d : kBefore)
        add_beside(planes[static_cast<std::size_t>(axis)], side + outwards * d, d, air);
      for (const double h : kLower)
        add_beside(planes[2], face.box.max.z - h, h, air);
    }
}

/// Triangle of a place `u` in 0..1 along the summed areas.
const RoomTriangle& triangle_at(const Room& room, const std::vector<StandingFace>& faces, double u) {
  double total = 0;
  for (const StandingFace& f : faces)
    total += f.area_m2;
  double left = u * total;
  for (const StandingFace& f : faces)
    for (const RoomTriangle& t : f.triangles)
      if ((left -= area_m2(room, t)) <= 0.0)
        return t;
  return faces.back().triangles.back();
}

} // namespace

/// Level triangles with air above, joined where they share a corner.
Result<std::vector<StandingFace>> standing_faces(const Room& room, const std::string& material) {
  const Result<RayScene> rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  Joined corners;
  std::vector<const RoomTriangle*> level;
  for (const RoomTriangle& t : room.triangles)
    if (is_level(room, t) && (material.empty() || room.material(t).name == material) && has_air_above(room, *rays, t)) {
      level.push_back(&t);
      const std::size_t first = corners.place(room.corner(t, 0));
      corners.join(first, corners.place(room.corner(t, 1)));
      corners.join(first, corners.place(room.corner(t, 2)));
    }
  std::map<std::size_t, StandingFace> joined;
  for (const RoomTriangle* t : level)
    include(room, *t, joined[corners.root(corners.place(room.corner(*t, 0)))]);
  std::vector<StandingFace> faces;
  const double top = room.bounds().max.z - kHighest; // a ceiling has air above it, too
  for (auto& [root, face] : joined)
    if (face.area_m2 >= kLeastArea_m2 && face.box.max.z < top)
      faces.push_back(std::move(face));
  if (faces.empty() && !material.empty())
    return Error{ErrorCode::value_invalid, "no level face of at least 0.05 m2 has the material '" + material + "'",
                 "--stand-on", "name the material of a floor, a table top or a shelf"};
  std::ranges::stable_sort(faces, [](const auto& a, const auto& b) { return a.area_m2 > b.area_m2; });
  return faces;
}

void add_plane(std::vector<ProbePlane>& planes, double at, double tolerance, const Bounds& where) {
  const auto known =
      std::ranges::find_if(planes, [&](const ProbePlane& p) { return std::abs(p.at - at) <= tolerance; });
  if (known != planes.end())
    known->where.push_back(where);
  else if (planes.size() < kMostPlanes)
    planes.push_back({at, {where}});
}

/// z: 1.5, 8 and 25 cm above each face. x and y: 1.5, 4.5 and 10 cm inside rectangles (docs/notes/bake.md
/// says what was measured).
Planes planes_near(const std::vector<StandingFace>& faces, const Bounds& room) {
  Planes planes;
  for (const StandingFace& f : faces) {
    for (const double h : kHeights)
      add_plane(planes[2], f.box.max.z + h, kShared * h, above(f, kReach));
    for (int axis = 0; axis < 2 && is_rectangle(f); ++axis)
      add_beside_edges(f, room, axis, planes[static_cast<std::size_t>(axis)]);
  }
  for (std::vector<ProbePlane>& along : planes)
    std::ranges::sort(along, {}, &ProbePlane::at);
  return planes;
}

void add_planes_beside(const std::vector<StandingFace>& faces, const Bounds& room, Planes& planes) {
  for (const StandingFace& f : faces)
    if (is_rectangle(f))
      add_before_sides(f, room, planes);
  for (std::vector<ProbePlane>& along : planes)
    std::ranges::sort(along, {}, &ProbePlane::at);
}

/// Point k of the R3 sequence: place in the summed areas, place in the triangle, height kLowest (kHighest / kLowest)^u.
Result<std::vector<glm::dvec3>> points_above(const Room& room, const std::vector<StandingFace>& faces,
                                             std::size_t count) {
  constexpr std::array<double, 4> kStep{0.8566748838545029, 0.7338918566271260, 0.6287067210378087,
                                        0.5385972572236101}; // 1/g .. 1/g^4, g^5 = g + 1
  const Result<RayScene> rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  std::vector<glm::dvec3> points;
  for (std::size_t k = 1; k <= count && !faces.empty(); ++k) {
    std::array<double, 4> u;
    for (std::size_t i = 0; i < 4; ++i) {
      const double x = 0.5 + static_cast<double>(k) * kStep[i];
      u[i] = x - std::floor(x);
    }
    const RoomTriangle& t = triangle_at(room, faces, u[0]);
    const double s = std::sqrt(u[1]); // uniform over the triangle (Turk 1990)
    const glm::dvec3 on =
        (1.0 - s) * room.corner(t, 0) + s * (1.0 - u[2]) * room.corner(t, 1) + s * u[2] * room.corner(t, 2);
    const glm::dvec3 p = on + glm::dvec3(0.0, 0.0, kLowest * std::pow(kHighest / kLowest, u[3]));
    if (rays->distance(rays->to_local(p), kClear) >= kClear)
      points.push_back(p);
  }
  return points;
}

} // namespace daylit::precompute
