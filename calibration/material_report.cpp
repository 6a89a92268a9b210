#include "calibration/material_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibration/code_picture.h"
#include "calibration/material_checks.h"
#include "scene/image/resample.h"

namespace daylit::calibration {

namespace {

constexpr double kShown = 0.01;     ///< of a picture: what covers more must be known well
constexpr double kSure = 0.05;      ///< relative uncertainty of such a material
constexpr double kOverRange = 0.02; ///< of the pixels that show surfaces
constexpr double kAgree = 0.6;      ///< of a picture's pixels
constexpr double kLevel = 1.1;      ///< of one picture against the others
constexpr double kWindow = 1.3;     ///< measured over computed sky
constexpr double kSlope = 0.2;
constexpr int kPictureWidth = 360;

/// All that the report tells.
struct Findings {
  const MaterialScene& scene;
  const MaterialSamples& samples;
  const MaterialFit& fit;
  std::vector<BetterPose> poses;
  double window = 0;
  std::vector<const MaterialEstimate*> materials; ///< without windows
};

double largest(const Rgb& c) { return static_cast<double>(std::max({c.r, c.g, c.b})); }

double relative_uncertainty(const MaterialEstimate& m) {
  double worst = 0;
  for (int c = 0; c < 3; ++c)
    worst = std::max(worst, static_cast<double>(m.uncertainty[c] / std::max(m.reflectance[c], 1e-6f)));
  return worst;
}

/// Median slope of measured against computed light over the materials that tell; 1 where none does.
double median_slope(const Findings& f) {
  std::vector<double> slopes;
  for (const MaterialEstimate* m : f.materials)
    if (m->seen && m->slope != 0 && m->coverage >= kShown)
      slopes.push_back(m->slope);
  if (slopes.empty())
    return 1.0;
  std::ranges::sort(slopes);
  return slopes[slopes.size() / 2];
}

void add_view_faults(const Findings& f, std::vector<std::string>& faults) {
  for (std::size_t v = 0; v < f.scene.views.size(); ++v) {
    const std::string& name = f.scene.views[v].name;
    const ViewAgreement& view = f.fit.views[v];
    if (f.samples.over_range[v] > kOverRange)
      faults.push_back(fmt::format("{}: over-exposed: {:.0f} % of the pixels that show surfaces are at the top of "
                                   "their range; expose less, or merge a bracket",
                                   name, 100 * f.samples.over_range[v]));
    if (f.poses[v].is_another())
      faults.push_back(fmt::format("{}: wrong pose: turned by {:.1f} degrees and moved by {:.2f} m, the picture fits "
                                   "the room better ({:.0f} instead of {:.0f} % off); find its pose again",
                                   name, f.poses[v].turn_deg, f.poses[v].moved_m, 100 * f.poses[v].after,
                                   100 * f.poses[v].before));
    else if (view.used < kAgree)
      faults.push_back(fmt::format("{}: {:.0f} % of its pixels do not agree with the room model: something stands in "
                                   "front that the model lacks (mask it), or the light was another",
                                   name, 100 * (1 - view.used)));
    if (view.level > kLevel || view.level < 1 / kLevel)
      faults.push_back(fmt::format("{}: {:.2f} times as bright as the other pictures say: wrong [interior] scale, or "
                                   "the sky changed meanwhile",
                                   name, view.level));
  }
}

void add_light_faults(const Findings& f, std::vector<std::string>& faults) {
  if (f.window > 0 && (f.window > kWindow || f.window < 1 / kWindow))
    faults.push_back(fmt::format("wrong scale: through the windows the pictures show {:.2f} times the radiance of the "
                                 "sky picture; correct [interior] scale, or take the sky at the same time",
                                 f.window));
  for (const MaterialEstimate* m : f.materials)
    if (m->seen && largest(m->reflectance) > 1.0)
      faults.push_back(fmt::format("wrong scale: '{}' would reflect {:.0f} % of the light; correct [interior] scale, "
                                   "or the window sizes of the model",
                                   m->name, 100 * largest(m->reflectance)));
  if (const double slope = median_slope(f); std::abs(slope - 1) > kSlope)
    faults.push_back(
        fmt::format("wrong sky: the light on the surfaces does not follow the sky picture (where it "
                    "computes twice the light, {:.2f} times is measured); check its time, its rotation and "
                    "the windows of the model",
                    std::pow(2.0, slope)));
}

std::vector<std::string> faults_of(const Findings& f) {
  std::vector<std::string> faults;
  add_view_faults(f, faults);
  add_light_faults(f, faults);
  if (!f.fit.settled)
    faults.push_back(fmt::format("no reflectances fit the pictures after {} steps: light and scale contradict each "
                                 "other",
                                 f.fit.steps));
  if (faults.empty())
    for (const MaterialEstimate* m : f.materials)
      if (m->seen && m->coverage >= kShown && relative_uncertainty(*m) > kSure)
        faults.push_back(fmt::format("'{}' is known to {:.0f} % only; take a picture that shows more of it, better lit",
                                     m->name, 100 * relative_uncertainty(*m)));
  return faults;
}

nlohmann::ordered_json rgb_json(const Rgb& c) { return {c.r, c.g, c.b}; }

std::string figures_of(const Findings& f) {
  nlohmann::ordered_json materials = nlohmann::ordered_json::array(), views = materials, unseen = materials;
  for (const MaterialEstimate* m : f.materials) {
    materials.push_back({{"name", m->name},
                         {"seen", m->seen},
                         {"reflectance", rgb_json(m->reflectance)},
                         {"uncertainty", rgb_json(m->uncertainty)},
                         {"given", rgb_json(m->given)},
                         {"coverage", m->coverage},
                         {"samples", m->samples},
                         {"used", m->used},
                         {"scatter", m->scatter}});
    if (!m->seen)
      unseen.push_back(m->name);
  }
  for (std::size_t v = 0; v < f.scene.views.size(); ++v)
    views.push_back({{"name", f.scene.views[v].name},
                     {"used", f.fit.views[v].used},
                     {"level", f.fit.views[v].level},
                     {"over_range", f.samples.over_range[v]},
                     {"off", f.poses[v].before},
                     {"turn_deg", f.poses[v].turn_deg},
                     {"moved_m", f.poses[v].moved_m}});
  return nlohmann::ordered_json{{"materials", materials},   {"unseen", unseen},         {"views", views},
                                {"window_level", f.window}, {"slope", median_slope(f)}, {"steps", f.fit.steps}}
      .dump();
}

std::string rgb_text(const Rgb& c) { return fmt::format("{:.3f} {:.3f} {:.3f}", c.r, c.g, c.b); }

std::string text_of(const Findings& f) {
  std::string out;
  for (const MaterialEstimate* m : f.materials)
    out += m->seen ? fmt::format("{:<16} {} +- {:.3f} ({:.1f} % of a picture)\n", m->name, rgb_text(m->reflectance),
                                 largest(m->uncertainty), 100 * m->coverage)
                   : fmt::format("{:<16} not seen; stays {}\n", m->name, rgb_text(m->given));
  return out;
}

/// The view and what is computed, at one brightness.
std::string view_html(const Findings& f, std::size_t v, const RoomTransport& transport) {
  const MaterialView& view = f.scene.views[v];
  RgbImage computed = computed_picture(view, transport, f.fit, std::min(kPictureWidth, view.radiance.width));
  RgbImage measured = resampled_by_area(view.radiance, computed.width, computed.height);
  std::vector<float> light;
  for (const Rgb& texel : computed.texels)
    light.push_back(luminance(texel));
  std::ranges::sort(light);
  const float white = std::max(light[light.size() * 95 / 100], 1e-20f);
  for (RgbImage* picture : {&measured, &computed})
    for (Rgb& texel : picture->texels)
      texel = glm::clamp(texel / white, 0.0f, 1.0f);
  return html_picture(view_of(measured, true), view.name + ": the photograph.") +
         html_picture(view_of(computed, true), view.name + ": the room with the reflectances that were found.");
}

std::string swatch(const Rgb& c) {
  const auto code = [](float v) {
    return static_cast<int>(std::lround(255 * std::pow(std::clamp(static_cast<double>(v), 0.0, 1.0), 1 / 2.2)));
  };
  return fmt::format("<span style='background:rgb({},{},{});border:1px solid;padding:0 2em'></span>", code(c.r),
                     code(c.g), code(c.b));
}

std::string page_of(const Findings& f, const RoomTransport& transport) {
  std::string out = "<table><tr><th>material</th><th></th><th>reflectance</th><th>95 %</th><th>in the model</th>"
                    "<th>of a picture</th><th>pixels used</th></tr>\n";
  for (const MaterialEstimate* m : f.materials)
    out += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.1f} %</td><td>{}</td></tr>\n",
                       html_escaped(m->name), swatch(m->reflectance), rgb_text(m->reflectance),
                       m->seen ? rgb_text(m->uncertainty) : "not seen", rgb_text(m->given), 100 * m->coverage,
                       m->seen ? fmt::format("{:.0f} % of {}", 100 * m->used, m->samples) : "");
  out += "</table>\n";
  for (std::size_t v = 0; v < f.scene.views.size(); ++v)
    out += view_html(f, v, transport);
  return out;
}

Report report_of(const Findings& f, const RoomTransport& transport) {
  Report report;
  report.title = "Reflectances of the room";
  for (const MaterialView& view : f.scene.views)
    report.used.push_back(view.name);
  report.figures = figures_of(f);
  report.text = text_of(f);
  report.html = page_of(f, transport);
  std::string praise = fmt::format("{} pictures agree with the room", f.scene.views.size());
  for (const MaterialEstimate* m : f.materials)
    if (!m->seen)
      praise += fmt::format("; no picture shows '{}'", m->name);
  judge(report, faults_of(f), praise);
  return report;
}

} // namespace

Result<MaterialCalibration> calibrate_materials(const MaterialScene& scene, RoomTransport& transport,
                                                const Progress& progress) {
  const auto samples = sample_materials(scene, transport, progress);
  if (!samples)
    return samples.error();
  auto fit = fit_materials(scene.room.room, *samples, scene.views, transport, progress);
  if (!fit)
    return fit.error();
  Findings f{scene, *samples, *fit, {}, window_level(scene, transport), {}};
  for (const MaterialView& view : scene.views) {
    if (!progress("poses", static_cast<double>(f.poses.size()) / static_cast<double>(scene.views.size())))
      return interrupted_error("materials");
    f.poses.push_back(search_pose(view, transport, *fit));
  }
  MaterialCalibration out;
  out.room = scene.room.room;
  for (std::size_t m = 0; m < out.room.materials.size(); ++m) {
    if (!out.room.materials[m].is_window)
      f.materials.push_back(&fit->materials[m]);
    out.room.materials[m].reflectance = glm::clamp(fit->reflectance[m], 0.0f, 1.0f);
  }
  out.report = report_of(f, transport);
  out.fit = std::move(*fit);
  return out;
}

} // namespace daylit::calibration
