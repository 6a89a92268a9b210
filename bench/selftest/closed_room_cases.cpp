#include <array>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "bench/selftest/reference.h"
#include "bench/selftest/test_room.h"

namespace daylit::bench {

namespace {

using List = std::vector<Comparison>;
using Points = std::vector<SurfacePoint>;
constexpr double kHuge_m = 500.0; // the larger ground of CIE 171

/// Compares irradiances at points with one formula per point.
Result<List> compare_points(const SolvedRoom& room, const radiosity::Radiosity& light, const Points& points,
                            const std::vector<Comparison>& expected, const Progress& progress) {
  const auto e = room.irradiance(points, light, progress);
  if (!e)
    return e.error();
  List list = expected;
  for (std::size_t i = 0; i < list.size(); ++i)
    list[i].result = (*e)[i];
  return list;
}

/// The radiosity of a room in which only the floor sends out light, `value` everywhere.
Result<radiosity::Radiosity> lit_floor(SolvedRoom& room, float irradiance, float reflectance,
                                       const Progress& progress) {
  room.set_reflectance(0.0f);
  room.set_reflectance(kFloor, reflectance);
  radiosity::FirstBounce light;
  light.patches = room.set.patches.size();
  light.region = {0};
  light.opening.assign(light.patches, 0.0f);
  for (const Rgb& e : room.per_material(kFloor, irradiance))
    light.irradiance.insert(light.irradiance.end(), {e.r, e.g, e.b});
  return radiosity::solve_radiosity(room.set, room.exchange, light, {}, progress);
}

/// 5.3: the floor of a black room emits M evenly: E = M F.
Result<List> area_source(const SelftestQuality& q, const Progress& progress) {
  const auto room = SolvedRoom::closed(box_room({4, 4, 3}), {2, 2, 1.5}, q, progress);
  if (!room)
    return room.error();
  const auto light = room->solve(room->per_material(kFloor, 100.0f), progress);
  if (!light)
    return light.error();
  return compare_points(
      *room, *light,
      {{{0, 2, 2}, {1, 0, 0}}, {{0, 0.5, 0.25}, {1, 0, 0}}, {{2, 2, 3}, {0, 0, -1}}, {{0.5, 3, 3}, {0, 0, -1}}},
      {{"wall, 2 m up, middle", 100 * perpendicular_factor({0, 4}, {-2, 2}, 2)},
       {"wall, 0.25 m up, 0.5 m from the corner", 100 * perpendicular_factor({0, 4}, {-0.5, 3.5}, 0.25)},
       {"ceiling, middle", 100 * parallel_factor({-2, 2}, {-2, 2}, 3)},
       {"ceiling, near the corner", 100 * parallel_factor({-0.5, 3.5}, {-3, 1}, 3)}},
      progress);
}

/// 5.6: a floor of reflectance rho under an even irradiance E_h: E = rho E_h F.
Result<List> diffuse_reflection(const SelftestQuality& q, const Progress& progress) {
  List all;
  for (const double side : {4.0, kHuge_m}) {
    auto room = SolvedRoom::closed(box_room({side, side, 3}), {side / 2, side / 2, 1.5}, q, progress);
    if (!room)
      return room.error();
    const auto light = lit_floor(*room, 1000.0f, 0.3f, progress);
    if (!light)
      return light.error();
    const Span half{-side / 2, side / 2};
    const auto list = compare_points(
        *room, *light, {{{0, side / 2, 2}, {1, 0, 0}}, {{side / 2, side / 2, 3}, {0, 0, -1}}},
        {{fmt::format("{:g} m floor: wall, 2 m up", side), 300 * perpendicular_factor({0, side}, half, 2)},
         {fmt::format("{:g} m floor: ceiling, middle", side), 300 * parallel_factor(half, half, 3)}},
        progress);
    if (!list)
      return list;
    all.insert(all.end(), list->begin(), list->end());
  }
  return all;
}

Span clipped(double low, double high) { return {std::clamp(low, 0.0, 4.0), std::clamp(high, 0.0, 4.0)}; }

/// 5.7: the same floor, partly hidden by a black board 1.5 m up over [1.4, 2.6]^2. From a point at height z the board
/// covers its central projection on the floor, x0 + (x - x0) z / (z - 1.5), cut at the walls.
Result<List> hidden_floor(const SelftestQuality& q, const Progress& progress) {
  constexpr double lo = 1.4, hi = 2.6, board = 1.5;
  Room model = box_room({4, 4, 3});
  add_quad(model, {lo, lo, board}, {hi, lo, board}, {hi, hi, board}, {lo, hi, board}, kFurniture);
  auto room = SolvedRoom::closed(model, {0.5, 0.5, 1.5}, q, progress);
  if (!room)
    return room.error();
  const auto light = lit_floor(*room, 1000.0f, 0.3f, progress);
  if (!light)
    return light.error();
  const auto shadow = [&](const glm::dvec3& p, int axis) {
    const double stretch = p.z / (p.z - board);
    return clipped(p[axis] + (lo - p[axis]) * stretch, p[axis] + (hi - p[axis]) * stretch);
  };
  const auto seen = [&](const glm::dvec3& p, bool wall) {
    const auto factor = [&](const Span& x, const Span& y) {
      const Span from_x{x.low - p.x, x.high - p.x}, from_y{y.low - p.y, y.high - p.y};
      return wall ? perpendicular_factor(from_x, from_y, p.z) : parallel_factor(from_x, from_y, p.z);
    };
    return 300 * (factor({0, 4}, {0, 4}) - factor(shadow(p, 0), shadow(p, 1)));
  };
  const glm::dvec3 middle(2, 2, 3), side(1, 2, 3), corner(0.3, 0.4, 3), wall(0, 2, 2.6);
  return compare_points(*room, *light,
                        {{middle, {0, 0, -1}}, {side, {0, 0, -1}}, {corner, {0, 0, -1}}, {wall, {1, 0, 0}}},
                        {{"ceiling, middle", seen(middle, false)},
                         {"ceiling, 1 m off", seen(side, false)},
                         {"ceiling, corner", seen(corner, false)},
                         {"wall, 2.6 m up", seen(wall, true)}},
                        progress);
}

/// One patch sends out 10,000 lm. Whatever the form of a closed room of even reflectance: every lumen is absorbed
/// in the end, sum (1 - rho) E A = Phi, so the area mean of E is Phi / (S (1 - rho)); without the light that comes
/// straight from the lamp, rho Phi / (S (1 - rho)).
Result<List> closed_room_means(SolvedRoom& room, const std::vector<float>& reflectances, const std::string& label,
                               const Progress& progress) {
  const double flux = 10000, area = room.area_m2();
  std::vector<Rgb> exitance(room.set.patches.size(), Rgb(0.0f));
  const std::size_t lamp = exitance.size() / 3;
  exitance[lamp] = Rgb(static_cast<float>(flux / room.set.patches[lamp].area_m2));
  const auto straight = emitted_light(room.set, room.exchange, exitance);
  if (!straight)
    return straight.error();
  List list;
  for (const float rho : reflectances) {
    room.set_reflectance(rho);
    const auto b = room.solve(exitance, progress);
    if (!b)
      return b.error();
    const double r = static_cast<double>(rho), mean = flux / (area * (1 - r));
    double indirect = 0;
    for (std::size_t i = 0; i < exitance.size(); ++i) {
      const double e = static_cast<double>(b->row(i)[1] - exitance[i].g) / r;
      indirect += room.set.patches[i].area_m2 * (e - static_cast<double>(straight->row(i, 1)[0])) / area;
    }
    list.push_back({fmt::format("{}reflectance {:g}, mean indirect illuminance", label, rho), r * mean, indirect});
  }
  return list;
}

/// 5.8: the 4 m cube.
Result<List> internal_reflection(const SelftestQuality& q, const Progress& progress) {
  auto room = SolvedRoom::closed(box_room({4, 4, 4}), {2, 2, 2}, q, progress);
  if (!room)
    return room.error();
  return closed_room_means(*room, {0.1f, 0.3f, 0.5f, 0.7f, 0.9f, 0.95f}, "", progress);
}

/// Every surface emits 1: E = 1 + rho E, at every point.
Result<List> furnace(const SelftestQuality& q, const Progress& progress) {
  auto room = SolvedRoom::closed(box_room({2, 3, 2.5}), {1, 1.5, 1}, q, progress);
  if (!room)
    return room.error();
  const std::vector<Rgb> exitance(room->set.patches.size(), Rgb(1.0f));
  const Points points = {{{1, 1.5, 0}, {0, 0, 1}}, {{0.02, 0.03, 0}, {0, 0, 1}}, {{0, 1, 1}, {1, 0, 0}}};
  List all;
  for (const float rho : {0.2f, 0.5f, 0.9f, 0.99f, 0.999f}) {
    room->set_reflectance(rho);
    const auto light = room->solve(exitance, progress);
    if (!light)
      return light.error();
    const double e = 1 / (1 - static_cast<double>(rho));
    const auto list = compare_points(*room, *light, points,
                                     {{fmt::format("reflectance {:g}: floor, middle", rho), e},
                                      {fmt::format("reflectance {:g}: floor, corner", rho), e},
                                      {fmt::format("reflectance {:g}: wall", rho), e}},
                                     progress);
    if (!list)
      return list;
    all.insert(all.end(), list->begin(), list->end());
  }
  return all;
}

/// Rectangles across a room and at a right angle: mean form factors of the faces of a box.
Result<List> box_faces(const SelftestQuality& q, const Progress& progress) {
  const auto room = SolvedRoom::closed(box_room({4, 3, 2.5}), {2, 1.5, 1}, q, progress);
  if (!room)
    return room.error();
  return List{{"floor to ceiling", opposed_rectangles(4, 3, 2.5), room->exchange_area_m2(kFloor, kCeiling) / 12},
              {"south to north", opposed_rectangles(4, 2.5, 3), room->exchange_area_m2(kSouth, kNorth) / 10},
              {"floor to south wall", hinged_rectangles(4, 3, 2.5), room->exchange_area_m2(kFloor, kSouth) / 12},
              {"west to south wall", hinged_rectangles(2.5, 3, 4), room->exchange_area_m2(kWest, kSouth) / 7.5}};
}

/// Plates without end: the floor emits M, rho_f and rho_c send it to and fro: E_c = M / (1 - rho_f rho_c), E_f = rho_c
/// times that. 3 m apart and 2 km wide: what is missing beyond the rim counts for (3 / 1000)^2 in the middle.
Result<List> endless_plates(const SelftestQuality& q, const Progress& progress) {
  auto room = SolvedRoom::closed(box_room({2000, 2000, 3}), {1000, 1000, 1}, q, progress);
  if (!room)
    return room.error();
  room->set_reflectance(kFloor, 0.5f);
  room->set_reflectance(kCeiling, 0.7f);
  const auto light = room->solve(room->per_material(kFloor, 100.0f), progress);
  if (!light)
    return light.error();
  const double ceiling = 100 / (1 - 0.5 * 0.7);
  return compare_points(*room, *light, {{{1000, 1000, 3}, {0, 0, -1}}, {{1000, 1000, 0}, {0, 0, 1}}},
                        {{"ceiling", ceiling}, {"floor", 0.7 * ceiling}}, progress);
}

/// A convex box in a closed one sees nothing but it: F_io = 1, F_oi = A_i / A_o, F_oo = 1 - A_i / A_o.
Result<List> box_in_box(const SelftestQuality& q, const Progress& progress) {
  Room model = box_room({4, 4, 4});
  add_furniture(model, {1.2, 1.2, 1.2}, {2.8, 2.8, 2.8});
  auto room = SolvedRoom::closed(model, {0.5, 0.5, 0.5}, q, progress);
  if (!room)
    return room.error();
  const double inner = 6 * 1.6 * 1.6, outer = 6 * 16;
  double to_outer = 0, among_outer = 0;
  for (std::uint32_t f = 0; f < kFurniture; ++f) {
    to_outer += room->exchange_area_m2(kFurniture, f);
    for (std::uint32_t g = 0; g < kFurniture; ++g)
      among_outer += room->exchange_area_m2(f, g);
  }
  List list = {{"inner to outer", 1, to_outer / inner},
               {"outer to inner", inner / outer, to_outer / outer},
               {"outer to itself", 1 - inner / outer, among_outer / outer}};
  const auto means = closed_room_means(*room, {0.5f, 0.8f}, "both boxes, ", progress);
  if (!means)
    return means;
  list.insert(list.end(), means->begin(), means->end());
  return list;
}

/// Hottel's crossed strings in a duct of sides 3, 4, 5 m: F_12 = (L1 + L2 - L3) / (2 L1). The mean over side 1 at
/// mid-length is taken with a Gauss rule; ends 50 m away count for 3e-5.
Result<List> triangular_duct(const SelftestQuality& q, const Progress& progress) {
  constexpr double length = 100;
  Room model = box_room(glm::dvec3(1.0), 0);
  const std::array<glm::dvec3, 3> near = {glm::dvec3(0, 0, 0), {3, 0, 0}, {0, 0, 4}};
  const glm::dvec3 along(0, length, 0);
  add_quad(model, near[0], near[1], near[1] + along, near[0] + along, kFloor);
  add_quad(model, near[0], near[2], near[2] + along, near[0] + along, kWest);
  add_quad(model, near[1], near[2], near[2] + along, near[1] + along, kEast);
  for (const glm::dvec3& end : {glm::dvec3(0.0), along}) {
    const auto first = static_cast<std::uint32_t>(model.vertices.size());
    model.vertices.insert(model.vertices.end(), {near[0] + end, near[1] + end, near[2] + end});
    model.triangles.push_back({{first, first + 1, first + 2}, kFurniture});
  }
  const auto room = SolvedRoom::closed(model, {0.5, length / 2, 0.5}, q, progress);
  if (!room)
    return room.error();
  List list = {{"side of 3 m to side of 4 m", (3 + 4 - 5) / (2 * 3.0)},
               {"side of 3 m to side of 5 m", (3 + 5 - 4) / (2 * 3.0)}};
  const GaussRule& rule = gauss_rule();
  Points points;
  for (const double s : rule.node)
    points.push_back({{3 * s, length / 2, 0}, {0, 0, 1}});
  for (std::size_t k = 0; k < 2; ++k) {
    const auto light = room->solve(room->per_material(k == 0 ? kWest : kEast, 1.0f), progress);
    if (!light)
      return light.error();
    const auto e = room->irradiance(points, *light, progress);
    if (!e)
      return e.error();
    for (std::size_t i = 0; i < points.size(); ++i)
      list[k].result += rule.weight[i] * (*e)[i];
  }
  return list;
}

constexpr std::array<ClosedFormCase, 9> kCases = {{
    {"CIE 171 5.3", "area source", area_source},
    {"CIE 171 5.6", "reflection over a diffuse floor", diffuse_reflection},
    {"CIE 171 5.7", "the same behind an obstruction", hidden_floor},
    {"CIE 171 5.8", "interreflection in a closed cube", internal_reflection},
    {"furnace", "every surface emits 1", furnace},
    {"box faces", "parallel and perpendicular rectangles", box_faces},
    {"endless plates", "two parallel plates", endless_plates},
    {"box in box", "concentric boxes", box_in_box},
    {"crossed strings", "long triangular duct", triangular_duct},
}};

} // namespace

std::span<const ClosedFormCase> closed_room_cases() { return kCases; }

} // namespace daylit::bench
