#include "calibration/room_plan.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/format/toml_section.h"

namespace daylit::calibration {

namespace {

constexpr double kDiagonal = 0.01;   ///< relative: 6 cm in 6 m
constexpr double kDiagonal_m = 0.02; ///< and at least so much
constexpr double kLowest_m = 1.5, kHighest_m = 20.0, kLargest_m = 100.0;
constexpr double kTouch_m = 1e-6;

void read_window(detail::TomlSection section, RoomPlan& plan) {
  PlanWindow window;
  const std::vector<std::string> names(kWallNames.begin(), kWallNames.end());
  if (!section.read_word("wall", window.wall, names) && !section.has("wall"))
    section.problem("", "needs wall, one of y0, x1, y1, x0, cut_x, cut_y");
  if (std::array<double, 2> ids{}; section.read_array("markers", ids, {0, 1e5}))
    window.markers = {static_cast<int>(ids[0]), static_cast<int>(ids[1])};
  for (const auto& [key, value] : {std::pair<const char*, double*>{"left", &window.left_m},
                                   {"sill", &window.sill_m},
                                   {"width", &window.width_m},
                                   {"height", &window.height_m}})
    if (!section.read(key, *value,
                      {key == std::string("left") || key == std::string("sill") ? 0.0 : 0.01, kLargest_m}) &&
        !section.has(key) && !window.markers)
      section.problem("", std::string("needs ") + key + ", metres");
    else if (section.has(key) && window.markers)
      section.problem(key, "given together with markers; keep one");
  section.read("transmittance", window.transmittance, {0.0, 1.0});
  section.finish();
  plan.windows.push_back(window);
}

void read_photographs(detail::TomlSection& root, RoomPlan& plan) {
  detail::TomlSection section = root.section("photographs");
  PlanPhotographs photographs;
  for (detail::TomlSection& one : root.sections("photograph")) {
    if (!one.read("image", photographs.images.emplace_back()))
      one.problem("", "needs image");
    one.finish();
  }
  for (detail::TomlSection& one : root.sections("marker")) {
    int id = -1;
    std::string on;
    if (!one.read("id", id, {0, 1e5}) || !one.read_word("on", on, {kSurfaceNames.begin(), kSurfaceNames.end()}))
      one.problem("", "needs id and on, one of floor, ceiling, x0, x1, y0, y1, cut_x, cut_y");
    else if (!photographs.markers.on.emplace(id, on).second)
      one.problem("id", "given twice");
    one.finish();
  }
  if (!section) {
    if (!photographs.images.empty() || !photographs.markers.on.empty())
      root.problem("", "photographs of markers need a section [photographs] with lens and side");
    return;
  }
  section.read("lens", photographs.lens);
  section.read("dictionary", photographs.markers.dictionary);
  section.read("side", photographs.markers.side_m, {0.001, 10.0});
  section.read("margin", photographs.markers.margin_m, {0.0, 1.0});
  if (photographs.lens.empty() || !(photographs.markers.side_m > 0) || photographs.images.empty())
    section.problem("", "needs lens, side (of a marker's black square, metres), and [[photograph]] image");
  section.finish();
  root.read("height", plan.size_m.z, {0.1, 1e3});
  plan.photographs = std::move(photographs);
}

void read_block(detail::TomlSection section, RoomPlan& plan) {
  PlanBlock block;
  if (!section.read("name", block.name) || block.name.empty() || is_window_name(block.name))
    section.problem("name", "needs name, which is no window's");
  std::array<double, 2> corner{};
  if (!section.read_array("corner", corner, {0.0, kLargest_m}) && !section.has("corner"))
    section.problem("", "needs corner = [x, y], metres");
  block.corner_m = {corner[0], corner[1]};
  if (!section.read("size", block.size_m, {0.001, kLargest_m}) && !section.has("size"))
    section.problem("", "needs size = [x, y, z], metres");
  section.read("below", block.below_m, {0.0, kLargest_m});
  section.read_rgb("reflectance", block.reflectance, {0.0, 1.0});
  section.finish();
  plan.blocks.push_back(block);
}

/// Cuts of an interval at the borders of the windows in it.
std::vector<double> cuts(double end, std::vector<double> at) {
  at.push_back(0.0);
  at.push_back(end);
  std::ranges::sort(at);
  const auto again = std::ranges::unique(at, [](double a, double b) { return b - a < kTouch_m; });
  at.erase(again.begin(), again.end());
  return at;
}

class RoomBuilder {
public:
  std::uint32_t material(const std::string& name, const Rgb& reflectance) {
    for (std::uint32_t m = 0; m < room.materials.size(); ++m)
      if (room.materials[m].name == name)
        return m;
    room.materials.push_back({.name = name, .reflectance = reflectance});
    return static_cast<std::uint32_t>(room.materials.size() - 1);
  }
  std::uint32_t pane(const std::string& name, double transmittance) {
    room.materials.push_back({.name = name,
                              .reflectance = Rgb(0.0f),
                              .transmittance = Rgb(static_cast<float>(transmittance)),
                              .is_window = true});
    return static_cast<std::uint32_t>(room.materials.size() - 1);
  }
  /// Counter-clockwise seen from the side that counts.
  void quad(std::uint32_t material, const std::array<glm::dvec3, 4>& corner) {
    std::array<std::uint32_t, 4> v{};
    for (std::size_t k = 0; k < 4; ++k)
      v[k] = vertex(corner[k]);
    room.triangles.push_back({{v[0], v[1], v[2]}, material});
    room.triangles.push_back({{v[0], v[2], v[3]}, material});
  }
  Room room;

private:
  std::uint32_t vertex(const glm::dvec3& p) {
    const auto found = std::ranges::find(room.vertices, p);
    if (found != room.vertices.end())
      return static_cast<std::uint32_t>(found - room.vertices.begin());
    room.vertices.push_back(p);
    return static_cast<std::uint32_t>(room.vertices.size() - 1);
  }
};

/// A window along a wall, from the wall's first end.
std::array<double, 2> extent(const PlanWindow& w, double length) {
  return {length - w.left_m - w.width_m, length - w.left_m}; // seen from inside, the left end is the second one
}

/// The wall as fields between the borders of its windows; those inside a window are pane.
void add_wall(const RoomPlan& plan, const std::string& name, RoomBuilder& out) {
  const auto ends = plan.wall(name);
  const double length = glm::length((*ends)[1] - (*ends)[0]);
  const glm::dvec2 along = ((*ends)[1] - (*ends)[0]) / length;
  std::vector<double> across, up;
  std::vector<std::pair<const PlanWindow*, std::uint32_t>> panes;
  const std::uint32_t wall = out.material("wall_" + name, plan.walls);
  for (std::size_t k = 0; k < plan.windows.size(); ++k) {
    const PlanWindow& w = plan.windows[k];
    if (w.wall != name)
      continue;
    panes.emplace_back(&w, out.pane(fmt::format("window_{}", k + 1), w.transmittance));
    for (const double x : extent(w, length))
      across.push_back(x);
    up.insert(up.end(), {w.sill_m, w.sill_m + w.height_m});
  }
  across = cuts(length, across);
  up = cuts(plan.size_m.z, up);
  const auto at = [&](double a, double z) { return glm::dvec3((*ends)[0] + a * along, z); };
  for (std::size_t i = 0; i + 1 < across.size(); ++i)
    for (std::size_t j = 0; j + 1 < up.size(); ++j) {
      const double a = 0.5 * (across[i] + across[i + 1]), z = 0.5 * (up[j] + up[j + 1]);
      std::uint32_t material = wall;
      for (const auto& [w, pane] : panes)
        if (const auto [from, to] = extent(*w, length);
            a > from && a < to && z > w->sill_m && z < w->sill_m + w->height_m)
          material = pane;
      // Inside is left of the wall's direction: this order turns the normal there.
      out.quad(material, {at(across[i + 1], up[j]), at(across[i], up[j]), at(across[i], up[j + 1]),
                          at(across[i + 1], up[j + 1])});
    }
}

/// Floor and ceiling: one rectangle, or the two of an L.
void add_level(const RoomPlan& plan, double z, bool faces_up, std::uint32_t material, RoomBuilder& out) {
  const auto rectangle = [&](double x0, double y0, double x1, double y1) {
    std::array<glm::dvec3, 4> corner = {{{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}};
    if (!faces_up)
      std::ranges::reverse(corner);
    out.quad(material, corner);
  };
  const double x = plan.size_m.x - plan.cut_m.x, y = plan.size_m.y - plan.cut_m.y;
  if (plan.is_box())
    return rectangle(0, 0, plan.size_m.x, plan.size_m.y);
  rectangle(0, 0, x, y);
  rectangle(x, 0, plan.size_m.x, y);
  rectangle(0, y, x, plan.size_m.y);
}

void add_block(const PlanBlock& block, RoomBuilder& out) {
  const std::uint32_t m = out.material(block.name, block.reflectance);
  const glm::dvec3 a(block.corner_m, block.below_m), b = a + block.size_m;
  out.quad(m, {{{a.x, a.y, b.z}, {b.x, a.y, b.z}, {b.x, b.y, b.z}, {a.x, b.y, b.z}}});
  if (block.below_m > 0.0)
    out.quad(m, {{{a.x, b.y, a.z}, {b.x, b.y, a.z}, {b.x, a.y, a.z}, {a.x, a.y, a.z}}});
  const std::array<glm::dvec2, 4> foot = {{{a.x, a.y}, {b.x, a.y}, {b.x, b.y}, {a.x, b.y}}};
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec2 p = foot[k], q = foot[(k + 1) % 4];
    out.quad(m, {{{p, a.z}, {q, a.z}, {q, b.z}, {p, b.z}}});
  }
}

void check_window(const RoomPlan& plan, std::size_t k, std::vector<std::string>& faults) {
  const PlanWindow& w = plan.windows[k];
  const std::string name = fmt::format("window {} (wall {})", k + 1, w.wall);
  const auto ends = plan.wall(w.wall);
  if (!ends) {
    faults.push_back(name + ": a room without cut has no such wall");
    return;
  }
  const double length = glm::length((*ends)[1] - (*ends)[0]);
  if (w.left_m + w.width_m > length + kTouch_m)
    faults.push_back(
        fmt::format("{}: ends {:.2f} m from the left, the wall is {:.2f} m long; measure left and width again", name,
                    w.left_m + w.width_m, length));
  if (w.sill_m + w.height_m > plan.size_m.z + kTouch_m)
    faults.push_back(fmt::format("{}: reaches {:.2f} m up, the room is {:.2f} m high; measure sill and height again",
                                 name, w.sill_m + w.height_m, plan.size_m.z));
  for (std::size_t j = 0; j < k; ++j) {
    const PlanWindow& o = plan.windows[j];
    if (o.wall == w.wall && w.left_m < o.left_m + o.width_m && o.left_m < w.left_m + w.width_m &&
        w.sill_m < o.sill_m + o.height_m && o.sill_m < w.sill_m + w.height_m)
      faults.push_back(
          fmt::format("{}: overlaps window {}; measure from the left end of the wall, seen from inside", name, j + 1));
  }
}

void check_block(const RoomPlan& plan, const PlanBlock& b, std::vector<std::string>& faults) {
  const glm::dvec3 end(b.corner_m + glm::dvec2(b.size_m), b.below_m + b.size_m.z);
  const bool in_cut = !plan.is_box() && end.x > plan.size_m.x - plan.cut_m.x + kTouch_m &&
                      end.y > plan.size_m.y - plan.cut_m.y + kTouch_m;
  if (end.x > plan.size_m.x + kTouch_m || end.y > plan.size_m.y + kTouch_m || end.z > plan.size_m.z + kTouch_m ||
      in_cut)
    faults.push_back(fmt::format("block '{}': reaches out of the room, to ({:.2f}, {:.2f}, {:.2f}); measure corner and "
                                 "size again",
                                 b.name, end.x, end.y, end.z));
}

} // namespace

std::vector<glm::dvec2> RoomPlan::outline() const {
  const double x = size_m.x, y = size_m.y;
  if (is_box())
    return {{0, 0}, {x, 0}, {x, y}, {0, y}};
  return {{0, 0}, {x, 0}, {x, y - cut_m.y}, {x - cut_m.x, y - cut_m.y}, {x - cut_m.x, y}, {0, y}};
}

std::optional<std::array<glm::dvec2, 2>> RoomPlan::wall(const std::string& name) const {
  static constexpr std::array<const char*, 4> kBox = {"y0", "x1", "y1", "x0"};
  const std::vector<glm::dvec2> corner = outline();
  for (std::size_t k = 0; k < corner.size(); ++k)
    if ((is_box() ? kBox[k] : kWallNames[k]) == name)
      return std::array{corner[k], corner[(k + 1) % corner.size()]};
  return std::nullopt;
}

double RoomPlan::computed_diagonal_m() const { return std::hypot(size_m.x, size_m.y - cut_m.y); }

Result<RoomPlan> read_room_plan(const std::filesystem::path& path) {
  auto file = detail::parse_config_file(path);
  if (!file)
    return file.error();
  detail::TomlSection root(*file, &file->root, "");
  RoomPlan plan;
  read_photographs(root, plan);
  if (plan.photographs && (root.has("size") || root.has("cut")))
    root.problem("size", "given together with [photographs]; keep one");
  if (!root.read("size", plan.size_m, {0.1, 1e5}) && !root.has("size") && !plan.photographs)
    root.problem("", "needs size = [along x, along y, height], metres, or [photographs]");
  std::array<double, 2> cut{};
  if (root.read_array("cut", cut, {0.0, kLargest_m}))
    plan.cut_m = {cut[0], cut[1]};
  if (!plan.photographs && ((cut[0] > 0) != (cut[1] > 0) || cut[0] >= plan.size_m.x || cut[1] >= plan.size_m.y))
    root.problem("cut", "is the size of the missing corner: two lengths, shorter than the room's");
  if (double diagonal = 0; root.read("diagonal", diagonal, {0.1, 1e5}))
    plan.diagonal_m = diagonal;
  root.read_rgb("floor", plan.floor, {0.0, 1.0});
  root.read_rgb("walls", plan.walls, {0.0, 1.0});
  root.read_rgb("ceiling", plan.ceiling, {0.0, 1.0});
  for (detail::TomlSection& section : root.sections("window"))
    read_window(section, plan);
  for (detail::TomlSection& section : root.sections("block"))
    read_block(section, plan);
  root.finish();
  if (auto error = file->error())
    return *error;
  return plan;
}

std::vector<std::string> contradictions(const RoomPlan& plan) {
  std::vector<std::string> faults;
  if (plan.size_m.z < kLowest_m || plan.size_m.z > kHighest_m || std::max(plan.size_m.x, plan.size_m.y) > kLargest_m)
    faults.push_back(fmt::format("the room is {:g} x {:g} x {:g} m; give metres, and the height last", plan.size_m.x,
                                 plan.size_m.y, plan.size_m.z));
  if (plan.windows.empty())
    faults.push_back("no [[window]]: no light comes in");
  for (std::size_t k = 0; k < plan.windows.size(); ++k)
    check_window(plan, k, faults);
  for (const PlanBlock& block : plan.blocks)
    check_block(plan, block, faults);
  if (plan.diagonal_m) {
    const double right = plan.computed_diagonal_m();
    if (std::abs(*plan.diagonal_m - right) > std::max(kDiagonal_m, kDiagonal * right))
      faults.push_back(
          fmt::format("the diagonal was measured as {:.2f} m, the lengths give {:.2f} m; one of them is wrong, "
                      "or the corner is no right angle",
                      *plan.diagonal_m, right));
  }
  return faults;
}

Room room_of(const RoomPlan& plan) {
  RoomBuilder out;
  add_level(plan, 0.0, true, out.material("floor", plan.floor), out);
  add_level(plan, plan.size_m.z, false, out.material("ceiling", plan.ceiling), out);
  for (const char* name : kWallNames)
    if (plan.wall(name))
      add_wall(plan, name, out);
  for (const PlanBlock& block : plan.blocks)
    add_block(block, out);
  return std::move(out.room);
}

} // namespace daylit::calibration
