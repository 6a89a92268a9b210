// daylit-calibrate room: a room model from lengths measured with a tape, or in photographs of markers.

#include <algorithm>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "calibration/command.h"
#include "calibration/room_photographs.h"
#include "calibration/room_plan.h"
#include "scene/room/aperture.h"
#include "scene/room/room_write.h"

namespace daylit::calibration {

namespace {

constexpr double kEscape = 1e-4; ///< rays that find a way out beside the windows

double window_area(const RoomPlan& plan) {
  double area = 0;
  for (const PlanWindow& w : plan.windows)
    area += w.width_m * w.height_m;
  return area;
}

/// What one centimetre more in width and height of every window adds to its area, and so about to the light.
double gain_of_a_centimetre(const RoomPlan& plan) {
  double more = 0;
  for (const PlanWindow& w : plan.windows)
    more += (w.width_m + 0.01) * (w.height_m + 0.01);
  return more / window_area(plan) - 1.0;
}

/// Ground plan: y up, windows thick.
std::string plan_drawing(const RoomPlan& plan) {
  constexpr double kPixels = 480.0, kMargin = 40.0;
  const double scale = kPixels / std::max(plan.size_m.x, plan.size_m.y);
  const auto at = [&](const glm::dvec2& p) {
    return fmt::format("{:.1f},{:.1f}", kMargin + scale * p.x, kMargin + scale * (plan.size_m.y - p.y));
  };
  const auto line = [&](const glm::dvec2& a, const glm::dvec2& b, const char* style) {
    return fmt::format("<path d='M{} L{}' {}/>\n", at(a), at(b), style);
  };
  std::string out = fmt::format("<svg width='{:.0f}' height='{:.0f}' font-family='sans-serif' font-size='13'>\n",
                                2 * kMargin + scale * plan.size_m.x, 2 * kMargin + scale * plan.size_m.y);
  for (const char* name : kWallNames)
    if (const auto ends = plan.wall(name)) {
      const auto& [a, b] = *ends;
      const glm::dvec2 middle = 0.5 * (a + b), along = glm::normalize(b - a);
      out += line(a, b, "stroke='#333' stroke-width='2'");
      const glm::dvec2 label = middle - 18.0 / scale * glm::dvec2(-along.y, along.x);
      out += fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='middle'>{} {:.2f} m</text>\n",
                         kMargin + scale * label.x, kMargin + scale * (plan.size_m.y - label.y) + 4, name,
                         glm::length(b - a));
      for (const PlanWindow& w : plan.windows)
        if (w.wall == name)
          out += line(b - w.left_m * along, b - (w.left_m + w.width_m) * along, "stroke='#39f' stroke-width='7'");
    }
  for (const PlanBlock& block : plan.blocks) {
    const glm::dvec2 top_left = block.corner_m + glm::dvec2(0, block.size_m.y);
    out += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='#ddc' stroke='#998'/>"
                       "<text x='{:.1f}' y='{:.1f}'>{}</text>\n",
                       kMargin + scale * top_left.x, kMargin + scale * (plan.size_m.y - top_left.y),
                       scale * block.size_m.x, scale * block.size_m.y, kMargin + scale * top_left.x + 4,
                       kMargin + scale * (plan.size_m.y - top_left.y) + 15, html_escaped(block.name));
  }
  return out + "</svg>\n";
}

/// What the bake's search for openings finds in the room. Error: of the geometry.
Result<ApertureReport> openings_of(const Room& room) {
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const auto apertures = find_apertures(room, *rays);
  if (!apertures)
    return apertures.error();
  return apertures->report;
}

void describe(const RoomPlan& plan, const ApertureReport& openings, Report& report) {
  const double floor = plan.size_m.x * plan.size_m.y - plan.cut_m.x * plan.cut_m.y;
  report.figures = nlohmann::ordered_json{{"size_m", {plan.size_m.x, plan.size_m.y, plan.size_m.z}},
                                          {"floor_m2", floor},
                                          {"windows", plan.windows.size()},
                                          {"window_m2", openings.window_area_m2},
                                          {"centimetre", gain_of_a_centimetre(plan)}}
                       .dump();
  report.text =
      fmt::format("room       {:.2f} x {:.2f} x {:.2f} m, floor {:.1f} m2\n"
                  "windows    {}, {:.2f} m2; a centimetre more in their width and height is {:.1f} % more light\n",
                  plan.size_m.x, plan.size_m.y, plan.size_m.z, floor, plan.windows.size(), openings.window_area_m2,
                  100 * gain_of_a_centimetre(plan));
  report.html = plan_drawing(plan) + "<pre>" + html_escaped(report.text) + "</pre>\n";
}

void describe_photographs(const MeasuredRoom& measured, Report& report) {
  nlohmann::ordered_json figures = nlohmann::ordered_json::parse(report.figures);
  figures["rms_px"] = measured.rms_px;
  report.text += fmt::format("corners    {} markers in {} photographs within {:.2f} px (rms)\n",
                             measured.corner_m.size(), measured.used.size(), measured.rms_px);
  for (const auto& [name, place] : measured.place_m) {
    figures["places_m"][name] = {{"value", place}, {"sigma", measured.sigma_m.at(name)}};
    report.text += fmt::format("{:10} at {:.3f} m, known to {:.3f}\n", name, place, measured.sigma_m.at(name));
  }
  report.figures = figures.dump();
}

Result<void> run(CommonOptions& o) {
  if (o.inputs.size() != 1 || o.output.extension() != ".obj")
    return Error{ErrorCode::usage,
                 o.inputs.size() != 1 ? "one file of lengths makes one room" : "the output is no .obj", "room",
                 "as daylit-calibrate room lengths.toml -o room.obj"};
  auto plan = read_room_plan(o.inputs.front());
  if (!plan)
    return plan.error();
  Report report;
  report.title = "Room model";
  report.used.push_back(o.inputs.front().filename().string());
  std::optional<MeasuredRoom> measured;
  if (plan->photographs) {
    ProgressLine progress(o.quiet || o.json);
    auto found = measure_plan(*plan, progress.callback());
    progress.clear();
    if (!found && found.error().code == ErrorCode::not_found)
      return deliver_without_result(o, report, {found.error().what + "; " + found.error().hint});
    if (!found)
      return found.error();
    measured = std::move(*found);
    report.used.insert(report.used.end(), measured->used.begin(), measured->used.end());
    report.dropped = measured->dropped;
  }
  if (const std::vector<std::string> faults = contradictions(*plan); !faults.empty()) {
    report.html = plan_drawing(*plan);
    return deliver_without_result(o, report, faults);
  }
  const Room room = room_of(*plan);
  const auto openings = openings_of(room);
  if (!openings)
    return openings.error();
  describe(*plan, *openings, report);
  std::vector<std::string> faults;
  if (measured) {
    describe_photographs(*measured, report);
    faults = faults_of(*measured);
  }
  if (openings->unexplained_escape > kEscape || openings->hole_polygons > 0)
    faults.push_back("light gets out beside the windows; please report this with the file of lengths");
  judge(report, faults,
        fmt::format("closed but for {} windows; daylit-precompute check {} says what a bake costs",
                    plan->windows.size(), o.output.string()));
  if (const Result<void> good = check_output(material_file_of(o.output), kRoomKind, o.force); !good)
    return good;
  return deliver_result(o, kRoomKind, report, [&] { return write_room(o.output, room); });
}

} // namespace

Command add_room_command(CLI::App& app, CommonOptions& o) {
  CLI::App* command = app.add_subcommand("room", "a box or an L-shaped room model from measured lengths");
  add_common_options(*command, o, "a TOML file of lengths: size, cut, diagonal, [[window]], [[block]]",
                     "the room model to write (.obj and .mtl)");
  return {command, [&o] { return run(o); }};
}

} // namespace daylit::calibration
