#include "precompute/room_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "precompute/probes.h"
#include "precompute/room_around.h"
#include "scene/room/aperture.h"

namespace daylit::precompute {

namespace {

constexpr std::array<double, 4> kOffSurfaces_m{0.1, 0.2, 0.5, 1e9}; ///< borders of the strata
constexpr std::size_t kStrata = kOffSurfaces_m.size() - 1, kOfStratum = 40, kMostRooms = 64, kTries = 16384;
constexpr std::size_t kCounted = 1024; ///< of the candidates, that tell how much of the air is in each stratum
constexpr std::size_t kLookers = 32;   ///< of the points in a room's air, from which others are looked for
constexpr double kSame = 0.8;          ///< of the smaller of two boxes lies in both: they may be of one room,
constexpr double kSimilar = 0.67;      ///< if it is so much of the larger, too
constexpr double kSection = 0.7;       ///< of the larger size along two axes: pieces of a passage, whose ends are too
                                       ///< small to be seen from one another, may be of one room
constexpr double kFilled = 0.85;       ///< of a box, by others of which none holds kSame of it
constexpr double kOneAir = 0.6;        ///< of the points of one that see a point of the other: they are one room
constexpr std::size_t kPairs = 256;    ///< of points of two rooms

bool contains(const Bounds& box, const glm::dvec3& p) {
  return glm::all(glm::greaterThanEqual(p, box.min)) && glm::all(glm::lessThanEqual(p, box.max));
}

/// A room, and those of the points in its air that are in no earlier one.
struct Found {
  Bounds box;
  std::vector<glm::dvec3> air;
};

/// The box around p, and from nearer its middle twice more: a far end is too small there to be seen from the other.
std::optional<Bounds> box_around(const Room& room, glm::dvec3 p, const std::vector<glm::dvec3>& in_air) {
  const glm::dvec3 first = p;
  std::optional<Bounds> found;
  for (int pass = 0; pass < 3; ++pass) {
    const Result<Bounds> box = room_around(room, p);
    if (!box || !contains(*box, first))
      break;
    found = *box;
    const glm::dvec3 middle = box->centre();
    for (const glm::dvec3& q : in_air)
      if (contains(*box, q) && glm::distance(q, middle) < glm::distance(p, middle))
        p = q;
  }
  return found;
}

using Sees = std::function<bool(const glm::dvec3&, const glm::dvec3&)>;

/// Whether most of the points of a room are.
bool seen(const Found& room, const std::function<bool(const glm::dvec3&)>& is_seen) {
  return static_cast<double>(std::ranges::count_if(room.air, is_seen)) >=
         kOneAir * static_cast<double>(room.air.size());
}

glm::dvec3 nearest(const std::vector<glm::dvec3>& points, const glm::dvec3& p) {
  return *std::ranges::min_element(points, {}, [&](const glm::dvec3& q) { return glm::distance(p, q); });
}

/// Nearly the same box, as from a place that sees into a niche; most points of one see the nearest one of the other.
bool are_same(const Found& a, const Found& b, const glm::dvec3& common, const Sees& sees) {
  const double both = common.x * common.y * common.z, of_a = volume(a.box), of_b = volume(b.box);
  return both >= kSame * std::min(of_a, of_b) && both >= kSimilar * std::max(of_a, of_b) &&
         seen(b, [&](const glm::dvec3& p) { return sees(p, nearest(a.air, p)); });
}

/// One behind the other along a passage, or b a part of it: most of its points see the middle of a.
bool are_pieces(const Found& a, const Found& b, const glm::dvec3& common, const Sees& sees) {
  const glm::dvec3 larger = glm::max(a.box.size(), b.box.size());
  for (int along = 0; along < 3; ++along) {
    const int u = (along + 1) % 3, v = (along + 2) % 3;
    if (common[u] >= kSection * larger[u] && common[v] >= kSection * larger[v] &&
        common[along] >= -std::max(larger[u], larger[v]) && common[along] < kSame * a.box.size()[along])
      return seen(b, [&](const glm::dvec3& p) { return sees(p, nearest(a.air, a.box.centre())); });
  }
  return false;
}

/// Point k: low + size frac(1/2 + k / g^(1..3)), g the root of x^4 = x + 1 (Roberts 2018).
glm::dvec3 candidate(const Bounds& box, std::size_t k) {
  const glm::dvec3 step(0.8191725133961645, 0.6710436067037893, 0.5497004779019703);
  return box.min + box.size() * glm::fract(0.5 + static_cast<double>(k) * step);
}

/// Pairs of points, one in the box of each: in one room in which furniture stands at least half of them see each
/// other, through a door few.
bool see_each_other(const Found& a, const Found& b, const Sees& sees) {
  std::size_t seen = 0;
  for (std::size_t k = 1; k <= kPairs; ++k)
    seen += sees(candidate(a.box, k), candidate(b.box, kPairs + k)) ? 1 : 0;
  return 2 * seen >= kPairs;
}

/// Behind a wall lie other rooms, whatever the boxes.
bool are_one(const Found& a, const Found& b, const Sees& sees) {
  const glm::dvec3 common = glm::min(a.box.max, b.box.max) - glm::max(a.box.min, b.box.min);
  return are_same(a, b, glm::max(common, 0.0), sees) || are_pieces(a, b, common, sees) || see_each_other(a, b, sees);
}

/// `rooms`: those with most points first. Again until none is joined: pieces of a passage meet at last.
std::vector<Found> joined(std::vector<Found> rooms, const Sees& sees) {
  std::vector<Found> out;
  for (Found& room : rooms) {
    const auto same = std::ranges::find_if(out, [&](const Found& r) { return are_one(r, room, sees); });
    if (same == out.end()) {
      out.push_back(std::move(room));
      continue;
    }
    same->air.insert(same->air.end(), room.air.begin(), room.air.end());
    same->box.include(room.box.min);
    same->box.include(room.box.max);
  }
  return out.size() < rooms.size() ? joined(std::move(out), sees) : out;
}

/// Part of a box that lies in one of others.
double filled(const Bounds& box, std::span<const Bounds> others) {
  std::size_t inside = 0;
  for (std::size_t k = 1; k <= kCounted; ++k)
    inside += std::ranges::any_of(others, [&](const Bounds& o) { return contains(o, candidate(box, k)); }) ? 1 : 0;
  return static_cast<double>(inside) / static_cast<double>(kCounted);
}

/// A box from a doorway, where one sees parts of two rooms, is no room of its own: these fill it. `rooms`: those with
/// most points first; a room in the box of a hall from which it is seen stays.
void drop_doorways(std::vector<Found>& rooms) {
  for (std::size_t r = rooms.size(); r-- > 0;) {
    std::vector<Bounds> parts;
    for (std::size_t o = 0; o < r; ++o)
      if (filled(rooms[r].box, {&rooms[o].box, 1}) < kSame)
        parts.push_back(rooms[o].box);
    if (filled(rooms[r].box, parts) >= kFilled)
      rooms.erase(rooms.begin() + std::ptrdiff_t(r));
  }
}

std::vector<Found> find_rooms(const Room& room, const std::vector<glm::dvec3>& in_air, const Sees& sees) {
  std::vector<Found> rooms;
  for (const glm::dvec3& p : in_air) {
    auto in = std::ranges::find_if(rooms, [&](const Found& r) { return contains(r.box, p); });
    if (in == rooms.end() && rooms.size() < kMostRooms)
      if (const auto box = box_around(room, p, in_air))
        in = rooms.insert(rooms.end(), Found{*box, {}});
    if (in != rooms.end())
      in->air.push_back(p);
  }
  const auto drop = [&] {
    std::ranges::stable_sort(rooms, [](const Found& a, const Found& b) { return a.air.size() > b.air.size(); });
    drop_doorways(rooms);
  };
  drop();
  rooms = joined(std::move(rooms), sees);
  drop();
  return rooms;
}

/// The stratum of a distance to the nearest surface; none where it is closer than all.
std::ptrdiff_t stratum(double off_m) {
  return std::ranges::upper_bound(kOffSurfaces_m, off_m) - kOffSurfaces_m.begin() - 1;
}

/// Stratified sampling (Cochran 1977, ch. 5): a point of stratum s, of which n_s were taken, weighs N_s / n_s, N_s: the
/// candidates in it.
RoomPoints spread_over_strata(const Bounds& box, const RayScene& rays,
                              const std::function<bool(const glm::dvec3&)>& seen) {
  RoomPoints points;
  std::array<std::size_t, kStrata> have{}, counted{};
  std::vector<std::size_t> stratum_of;
  for (std::size_t k = 1; k <= kTries && (k <= kCounted || points.points.size() < kOfStratum * kStrata); ++k) {
    const glm::dvec3 p = candidate(box, k);
    const std::ptrdiff_t found = stratum(static_cast<double>(rays.distance(rays.to_local(p), 1.0f)));
    const auto s = static_cast<std::size_t>(found);
    if (found < 0 || (k > kCounted && have[s] == kOfStratum) || !seen(p))
      continue;
    counted[s] += k <= kCounted ? 1 : 0;
    if (have[s] == kOfStratum)
      continue;
    ++have[s];
    points.points.push_back(p);
    stratum_of.push_back(s);
  }
  for (const std::size_t s : stratum_of)
    points.weight.push_back(std::max(1.0, static_cast<double>(counted[s])) / static_cast<double>(have[s]));
  return points;
}

} // namespace

Result<std::vector<RoomPoints>> points_by_room(const Room& room, const Bounds& bounds,
                                               const std::vector<glm::dvec3>& in_air) {
  const Result<RayScene> rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const Result<Apertures> apertures = find_apertures(room, *rays);
  if (!apertures)
    return apertures.error();
  std::vector<RoomPoints> out;
  const Sees sees = [&](const glm::dvec3& a, const glm::dvec3& p) {
    return open_between(a, p, *rays, apertures->list);
  };
  for (const Found& found : find_rooms(room, in_air, sees)) {
    const Bounds box{glm::max(found.box.min, bounds.min), glm::min(found.box.max, bounds.max)};
    const auto seen = [&](const glm::dvec3& p) {
      return std::ranges::any_of(found.air.begin(),
                                 found.air.begin() + std::ptrdiff_t(std::min(kLookers, found.air.size())),
                                 [&](const glm::dvec3& a) { return sees(a, p); });
    };
    RoomPoints points = spread_over_strata(box, *rays, seen);
    points.box = found.box;
    out.push_back(std::move(points));
  }
  return out;
}

} // namespace daylit::precompute
