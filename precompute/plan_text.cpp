#include <nlohmann/json.hpp>

#include "precompute/detail/text_format.h"
#include "precompute/planned_bake.h"

namespace daylit::precompute {

namespace {

using detail::format;

/// Where the probes are: given points, a counted grid, or a spacing.
std::string where(const Plan& plan) {
  const BakeOptions& o = plan.options;
  if (!o.points.empty())
    return format("%zu given points", o.points.size());
  const bool graded = is_graded(o.density);
  if (o.grid.x > 0)
    return format("%d x %d x %d%s probes", o.grid.x, o.grid.y, o.grid.z, graded ? " graded" : "");
  return format(graded ? "probes %.3g m apart in the mean" : "probes at most %.3g m apart", o.spacing_m);
}

std::string facets(const Plan& plan) {
  return plan.options.facet_edge_m > 0 ? format("facets up to %.3g m", plan.options.facet_edge_m)
                                       : format("%d facets", plan.options.target_facets);
}

} // namespace

/// Errors in per cent of the coefficients, nrms.
std::string to_text(const Plan& plan) {
  const Prediction& p = plan.predicted;
  std::string text = format("plan       for %.3g %%: %s, %s, %s, %.0f visibility rays, %d rays per probe\n",
                            100 * plan.max_error, facets(plan).c_str(), where(plan).c_str(), plan.regions.c_str(),
                            plan.options.visibility_rays, plan.options.gather_rays);
  text += format("predicted  %.2f %% (mesh %.2f, probes %.2f, sky %.2f)", 100 * p.total, 100 * p.mesh, 100 * p.grid,
                 100 * p.sky);
  if (p.sun > 0)
    text += format(", a small sun %.1f %%", 100 * p.sun);
  return text + format("; %.1f s, %.1f MB\n", p.seconds, p.bytes / 1e6);
}

/// The measured error beside the target, with a warning where it is above.
std::string to_text(const Plan& plan, const Measured& m) {
  std::string text = format(
      "measured   %.2f %% (mesh %.2f estimated, volume %.2f) at %zu points and the worst of 5 smooth skies (%s) that "
      "the bake did not use\n",
      100 * m.total, 100 * m.mesh, 100 * m.volume, m.points, m.worst_sky.c_str());
  text += format("           as irradiance %.2f %%, beside what nine coefficients leave out (0.8 to 1 %%)",
                 100 * m.irradiance);
  if (m.sun > 0)
    text += format("; under a small sun %.1f %%", 100 * m.sun);
  text += "\n";
  if (m.total > plan.max_error)
    text += format("warning    the measured error is above the %.3g %% that were wanted\n", 100 * plan.max_error);
  if (m.sun > 2 * plan.max_error)
    text += format("note       under a small sun the error is above twice that\n");
  return text;
}

std::string to_json(const PlannedBake& bake, bool times) {
  const BakeOptions& o = bake.plan.options;
  const Prediction& p = bake.plan.predicted;
  const Measured& m = bake.measured;
  auto j = nlohmann::ordered_json::parse(to_json(bake.report, times));
  j["plan"] = {{"max_error", bake.plan.max_error},
               {"regions", bake.plan.regions},
               {"target_facets", o.target_facets},
               {"facet_edge_m", o.facet_edge_m},
               {"spacing_m", o.spacing_m},
               {"graded", is_graded(o.density)},
               {"visibility_rays", o.visibility_rays},
               {"gather_rays", o.gather_rays},
               {"compact_error", o.compact_error},
               {"precision", bake.plan.precision == BasisPrecision::float16 ? "float16" : "float32"},
               {"repeated", bake.repeated}};
  j["predicted"] = {{"error", p.total}, {"mesh", p.mesh}, {"probes", p.grid},
                    {"sky", p.sky},     {"sun", p.sun},   {"bytes", p.bytes}};
  if (times)
    j["predicted"]["seconds"] = p.seconds;
  j["measured"] = {{"error", m.total}, {"mesh", m.mesh},           {"volume", m.volume}, {"irradiance", m.irradiance},
                   {"sun", m.sun},     {"worst_sky", m.worst_sky}, {"points", m.points}};
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

} // namespace daylit::precompute
