#include "precompute/check_plot.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <nlohmann/json.hpp>

#include "precompute/page/check_page_text.h"
#include "precompute/probes.h"

namespace daylit::precompute {

namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostDrawn = 20'000; // probes
constexpr double kGoldenRatio = 1.6180339887498949;

Json triple(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

/// To a tenth of a millimetre: a room's coordinates, not a metre's sixteen digits.
double rounded(double metres) { return std::round(1e4 * metres) / 1e4; }

void append(Json& list, const glm::dvec3& p) {
  for (int k = 0; k < 3; ++k)
    list.push_back(rounded(p[k]));
}

void add_surfaces(const Room& room, const glm::dvec3& origin, Json& page) {
  page["triangles"] = Json::array();
  page["colours"] = Json::array();
  for (const RoomTriangle& t : room.triangles) {
    if (room.is_window(t))
      continue;
    for (int k = 0; k < 3; ++k)
      append(page["triangles"], room.corner(t, k) - origin);
    append(page["colours"], glm::dvec3(room.material(t).reflectance));
  }
}

void add_openings(const Apertures& apertures, const glm::dvec3& origin, Json& page) {
  page["windows"] = page["holes"] = Json::array();
  for (std::size_t i = 0; i < apertures.list.size(); ++i) {
    Json corners = Json::array();
    for (const glm::dvec3& c : apertures.list[i].corners)
      corners.push_back(triple(c - origin));
    const bool pane = i < static_cast<std::size_t>(apertures.report.window_polygons);
    page[pane ? "windows" : "holes"].push_back({{"corners", corners}, {"inward", triple(apertures.list[i].inward)}});
  }
}

/// Where probes would stand, and where they would not: outdoors, in furniture, in rooms that no light reaches.
Result<void> add_probes(const RoomCheck& check, const glm::dvec3& origin, Json& page) {
  page["probes"] = page["outside"] = Json::array();
  page["probes_in_air"] = page["probes_outside"] = 0;
  if (!check.estimate)
    return {};
  const BakeOptions& o = check.estimate->plan.options;
  auto probes = make_grid(check.bounds, o.grid, o.spacing_m, o.density, o.near_surfaces);
  if (!probes)
    return probes.error();
  const auto rays = RayScene::build(check.room);
  if (!rays)
    return rays.error();
  mark_air(*probes, *rays, check.survey.apertures.list);
  const auto in_air = static_cast<std::size_t>(std::ranges::count(probes->valid, 1));
  page["probes_in_air"] = in_air;
  page["probes_outside"] = probes->size() - in_air;
  const double part = static_cast<double>(kMostDrawn) / static_cast<double>(probes->size());
  for (std::size_t i = 0; i < probes->size(); ++i)
    if (std::fmod(kGoldenRatio * static_cast<double>(i), 1.0) < part) // as many in every plane of the grid
      append(page[probes->valid[i] ? "probes" : "outside"], probes->origin + glm::dvec3(probes->positions[i]) - origin);
  return {};
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

/// JSON that cannot end the script element it stands in.
std::string for_script(const Json& json) {
  std::string out;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace))
    out += c == '<' ? "\\u003c" : std::string(1, c);
  return out;
}

void replace(std::string& page, std::string_view mark, std::string_view by) {
  page.replace(page.find(mark), mark.size(), by);
}

} // namespace

/// Coordinates are relative to the room's middle: a browser draws in single precision.
Result<std::string> check_page(const RoomCheck& check) {
  const glm::dvec3 origin = check.bounds.centre();
  Json data = {
      {"low", triple(check.bounds.min - origin)}, {"high", triple(check.bounds.max - origin)}, {"gaps", Json::array()}};
  add_surfaces(check.room, origin, data);
  add_openings(check.survey.apertures, origin, data);
  for (const Gap& gap : check.survey.gaps.list)
    data["gaps"].push_back({{"from", triple(gap.corners[0] - origin)}, {"to", triple(gap.corners[1] - origin)}});
  if (const Result<void> done = add_probes(check, origin, data); !done)
    return done.error();
  std::string page = check_page_text::check_room;
  // The report comes last: it holds names from the model.
  replace(page, "@THREE@", check_page_text::three);
  replace(page, "@DATA@", for_script(data));
  replace(page, "@REPORT@", escaped(to_text(check)));
  return page;
}

} // namespace daylit::precompute
