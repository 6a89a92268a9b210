#include "calibration/room_photographs.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "capture/markers/find_markers.h"
#include "capture/markers/marker_pose.h"

namespace daylit::calibration {

namespace {

constexpr double kOff_px = 1.5; ///< rms of a marker's corners
constexpr double kUncertain_m = 0.03;

Error without(const std::string& what, const std::string& hint) {
  return {ErrorCode::value_invalid, what, "room", hint};
}

Result<std::vector<RoomPhotograph>> read_photographs(const PlanPhotographs& given, const LensModel& lens,
                                                     const Progress& progress) {
  std::vector<RoomPhotograph> photographs;
  for (const std::filesystem::path& image : given.images) {
    if (!progress("photographs", static_cast<double>(photographs.size()) / static_cast<double>(given.images.size())))
      return interrupted_error("room");
    const auto picture = read_ldr_image(image);
    if (!picture)
      return picture.error();
    if (const Result<void> good = check_lens_size(*picture, lens, image.string()); !good)
      return good.error();
    auto seen = find_markers(*picture, given.markers.dictionary);
    if (!seen)
      return seen.error();
    photographs.push_back({image.filename().string(), std::move(*seen)});
  }
  return photographs;
}

Result<void> set_size(const MeasuredRoom& measured, RoomPlan& plan) {
  const auto place = [&](const char* name) {
    const auto found = measured.place_m.find(name);
    return found == measured.place_m.end() ? 0.0 : found->second;
  };
  plan.size_m = {place("x1"), place("y1"), place("ceiling") > 0 ? place("ceiling") : plan.size_m.z};
  if (!(plan.size_m.z > 0))
    return without("the height of the room is not known", "put a marker on the ceiling, or give height, metres");
  if ((place("cut_x") > 0) != (place("cut_y") > 0))
    return without("only one wall of the missing corner has a marker", "put one on cut_x and one on cut_y");
  if (place("cut_x") > 0)
    plan.cut_m = {plan.size_m.x - place("cut_x"), plan.size_m.y - place("cut_y")};
  return {};
}

/// Along the wall from its left end as seen from inside, and above the floor: the extremes of a marker's paper.
Result<std::array<glm::dvec2, 2>> extremes(const MeasuredRoom& measured, const PlanPhotographs& given,
                                           const std::array<glm::dvec2, 2>& wall, const std::string& name, int id) {
  const auto corners = measured.corner_m.find(id);
  const auto on = given.markers.on.find(id);
  if (on == given.markers.on.end() || on->second != name)
    return without(fmt::format("marker {} of a window is not said to be on wall {}", id, name),
                   "a [[marker]] with its id and on");
  if (corners == measured.corner_m.end())
    return without(fmt::format("marker {} of a window is in no photograph that counts", id),
                   "take one that shows it together with a marker on another surface");
  const glm::dvec2 along = glm::normalize(wall[0] - wall[1]);
  glm::dvec2 low(1e9), high(-1e9);
  for (const glm::dvec3& p : corners->second) {
    const glm::dvec2 at(glm::dot(glm::dvec2(p) - wall[1], along), p.z);
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  return std::array{low - given.markers.margin_m, high + given.markers.margin_m};
}

/// The paper at the lower left touches the window with its upper right corner, the other one with its lower left.
Result<void> set_window(const MeasuredRoom& measured, const RoomPlan& plan, PlanWindow& w) {
  const auto wall = plan.wall(w.wall);
  if (!wall || !w.markers)
    return {};
  const auto lower = extremes(measured, *plan.photographs, *wall, w.wall, (*w.markers)[0]),
             upper = extremes(measured, *plan.photographs, *wall, w.wall, (*w.markers)[1]);
  if (!lower || !upper)
    return lower ? upper.error() : lower.error();
  const glm::dvec2 from = (*lower)[1], to = (*upper)[0];
  if (!(to.x > from.x && to.y > from.y))
    return without(fmt::format("markers {} and {} leave no window between them", (*w.markers)[0], (*w.markers)[1]),
                   "markers = [at its lower left corner, at its upper right corner], as seen from inside");
  w.left_m = from.x;
  w.sill_m = from.y;
  w.width_m = to.x - from.x;
  w.height_m = to.y - from.y;
  return {};
}

} // namespace

Result<MeasuredRoom> measure_plan(RoomPlan& plan, const Progress& progress) {
  const auto lens = read_lens(plan.photographs->lens);
  if (!lens)
    return lens.error();
  const auto photographs = read_photographs(*plan.photographs, *lens, progress);
  if (!photographs)
    return photographs.error();
  auto measured = measure_room(plan.photographs->markers, *lens, *photographs);
  if (!measured)
    return measured.error();
  if (const Result<void> good = set_size(*measured, plan); !good)
    return good.error();
  for (PlanWindow& window : plan.windows)
    if (const Result<void> good = set_window(*measured, plan, window); !good)
      return good.error();
  return measured;
}

std::vector<std::string> faults_of(const MeasuredRoom& measured) {
  std::vector<std::string> faults;
  const auto worst = std::ranges::max_element(measured.marker_rms_px, {}, &std::pair<const int, double>::second);
  if (worst->second > kOff_px)
    faults.push_back(
        fmt::format("marker {} is {:.1f} px from where it would be on its surface: it is on another one, not "
                    "flat, was moved, or the walls are not at right angles",
                    worst->first, worst->second));
  for (const auto& [name, sigma] : measured.sigma_m)
    if (sigma > kUncertain_m)
      faults.push_back(
          fmt::format("{} is only known to {:.0f} cm; take a photograph that shows its marker larger, together "
                      "with others",
                      name, 100 * sigma));
  return faults;
}

} // namespace daylit::calibration
