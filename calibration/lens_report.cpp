#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibration/lens_calibration.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kEnlarged = 30.0; ///< errors in the drawing / errors

std::vector<std::string> names_of(const LensCalibration& c) {
  const bool equidistant = c.kind == LensKind::equidistant;
  return equidistant ? std::vector<std::string>{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"}
                     : std::vector<std::string>{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
}

double value_of(const LensModel& lens, std::size_t i) {
  const double first[] = {lens.fx, lens.fy, lens.cx, lens.cy};
  return i < 4 ? first[i] : lens.distortion[i - 4];
}

/// Corners, and their errors kEnlarged times as long.
std::string drawing(const LensCalibration& c) {
  const LensModel& lens = c.fit.lens;
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='corners and their errors'>\n"
                                "<rect width='100%' height='100%' fill='#111'/>\n",
                                lens.width_px, lens.height_px);
  const double line = 0.0015 * lens.width_px;
  if (c.circle.radius > 0)
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{:.1f}' fill='none' stroke='#888' stroke-width='{:.2f}'/>\n",
                       c.circle.centre.x, c.circle.centre.y, c.circle.radius, line);
  for (std::size_t v = 0; v < c.views.size(); ++v)
    for (std::size_t k = 0; k < c.views[v].corner_px.size(); ++k) {
      const glm::dvec2 p = c.views[v].corner_px[k];
      const glm::dvec2 q = lens.project(c.fit.pose[v].apply(c.views[v].board_m[k])).value_or(p);
      const glm::dvec2 end = p + kEnlarged * (q - p);
      svg += fmt::format("<path d='M{:.1f} {:.1f}L{:.1f} {:.1f}' stroke='#f93' stroke-width='{:.2f}'/>"
                         "<circle cx='{:.1f}' cy='{:.1f}' r='{:.2f}' fill='hsl({},70%,65%)'/>\n",
                         p.x, p.y, end.x, end.y, line, p.x, p.y, 1.4 * line, 360 * v / c.views.size());
    }
  return svg + "</svg>\n";
}

std::string tables(const LensCalibration& c) {
  std::vector<std::vector<std::string>> views{{"picture", "corners off by, rms px"}},
      numbers{{"number", "value", "standard deviation"}};
  for (std::size_t v = 0; v < c.views.size(); ++v)
    views.push_back({c.views[v].name, fmt::format("{:.3f}", c.fit.view_rms_px[v])});
  const auto names = names_of(c);
  for (std::size_t i = 0; i < names.size(); ++i)
    numbers.push_back(
        {names[i], fmt::format("{:.6g}", value_of(c.fit.lens, i)), fmt::format("{:.2g}", c.fit.sigma[i])});
  return html_table(views) + html_table(numbers);
}

std::string figures(const LensCalibration& c) {
  nlohmann::ordered_json j;
  j["rms_px"] = c.fit.rms_px;
  j["held_out_rms_px"] = c.held_out_rms_px;
  j["view_rms_px"] = c.fit.view_rms_px;
  j["model"] = c.kind == LensKind::equidistant ? "equidistant" : "plumb_bob";
  for (const TriedCurve& curve : c.curves)
    j["curves"].push_back({{"curve", curve.name}, {"held_out_rms_px", curve.held_out_rms_px}});
  const auto names = names_of(c);
  for (std::size_t i = 0; i < names.size(); ++i)
    j["lens"][names[i]] = {{"value", value_of(c.fit.lens, i)}, {"sigma", c.fit.sigma[i]}};
  j["reach_deg"] = c.reach_deg;
  j["max_theta_deg"] = c.fit.lens.max_theta / kDegree;
  j["coverage"] = c.coverage;
  j["tilt_spread_deg"] = c.tilt_spread_deg;
  j["fx_over_fy"] = {{"value", c.fit.lens.fx / c.fit.lens.fy}, {"sigma", c.fit.sigma_aspect}};
  j["one_lens"] = {{"f", c.agreement.f}, {"two_lenses_explain", c.agreement.two}};
  if (c.circle.radius > 0)
    j["circle_px"] = {{"x", c.circle.centre.x}, {"y", c.circle.centre.y}, {"radius", c.circle.radius}};
  return j.dump();
}

std::string held_out_of(const LensCalibration& c) {
  return std::isnan(c.held_out_rms_px) ? "not explained by the others" : fmt::format("{:.3f} px", c.held_out_rms_px);
}

std::string text(const LensCalibration& c) {
  const LensModel& lens = c.fit.lens;
  return fmt::format("corners    off by {:.3f} px rms ({} x {} pixels); pictures that were left out in turn {}\n",
                     c.fit.rms_px, lens.width_px, lens.height_px, held_out_of(c)) +
         fmt::format(
             "lens       fx {:.2f} +- {:.2f}, fy {:.2f} +- {:.2f}, cx {:.2f} +- {:.2f}, cy {:.2f} +- {:.2f} px\n",
             lens.fx, c.fit.sigma[0], lens.fy, c.fit.sigma[1], lens.cx, c.fit.sigma[2], lens.cy, c.fit.sigma[3]) +
         (c.curves.empty() ? "" : "curve      " + c.curves.front().name + "\n") +
         fmt::format("reach      corners up to {:.1f} degrees from the axis, in {:.0f} % of the picture\n", c.reach_deg,
                     100 * c.coverage);
}

} // namespace

Report report_of(const LensCalibration& c) {
  if (c.views.empty())
    return {"Lens calibration", false, c.why, {}, c.dropped, "", "", ""};
  Report report{.title = "Lens calibration",
                .pass = c.pass,
                .why = c.why,
                .used = {},
                .dropped = c.dropped,
                .figures = figures(c),
                .text = text(c),
                .html = {}};
  for (const BoardView& view : c.views)
    report.used.push_back(view.name);
  report.html = fmt::format("<p>Corners are off by {:.3f} px rms; pictures that were left out in turn: {}.</p>\n",
                            c.fit.rms_px, held_out_of(c)) +
                drawing(c) +
                fmt::format("<p>Every corner that counts, one colour per picture; lines: errors, {:.0f} times as "
                            "long.</p>\n",
                            kEnlarged) +
                tables(c);
  return report;
}

} // namespace daylit::calibration
