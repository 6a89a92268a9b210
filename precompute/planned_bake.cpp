#include "precompute/planned_bake.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "precompute/adaptive_sky.h"
#include "precompute/cheaper_bake.h"
#include "precompute/cost_model.h"
#include "precompute/detail/text_format.h"
#include "precompute/probes.h"
#include "precompute/room_frame.h"

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

constexpr double kMissed = 1.05;      ///< times the target: what 128 points tell is no surer than that
constexpr double kMostGrowth = 2;     ///< of the file, by a second bake: its time depends on the machine
constexpr double kClearlyFiner = 1.8; ///< ratio of facets from which a difference shows an error

/// How much finer the mesh of the report is than one of the calibration: ratio of facets where light comes from, with
/// the elements under a fine sky.
double finer_than(const CalibrationMesh& mesh, const BakeReport& report) {
  const double elements_per_patch =
      static_cast<double>(report.elements) / static_cast<double>(std::max<std::size_t>(report.patches, 1));
  return mesh.mean_facet_m2 / report.mean_facet_m2 * equivalent_facets(1.0, elements_per_patch);
}

/// Richardson: with an error e ~ facets^-a, the difference of two meshes is e (ratio^a - 1), e the finer mesh's error.
/// Against the coarsest calibration mesh: what it lacks beside facets (its direct light is that of whole patches)
/// counts least where the ratio is large. On a mesh no finer than that the model decides.
double estimated_mesh_error(const CalibrationBake& calibration, const BakeReport& report) {
  if (const double ratio = finer_than(calibration.coarse, report); ratio > kClearlyFiner)
    return mesh_difference(calibration.coarse.audit, report.audit) / (std::pow(ratio, kCostModel.mesh_exponent) - 1.0);
  return mesh_error(calibration, calibration.free_facets() * finer_than(calibration.fine, report));
}

/// The records of a repeated bake, in the same file beside those of the first.
class RepeatedStore final : public radiosity::WorkStore {
public:
  explicit RepeatedStore(radiosity::WorkStore& base) : base_(base) {}
  std::optional<std::vector<std::byte>> find(const Name& name) override { return base_.find(moved(name)); }
  void keep(const Name& name, std::span<const std::byte> bytes) override { base_.keep(moved(name), bytes); }

private:
  static constexpr std::uint32_t kRepeated = 1u << 16; ///< parts are channels: far below
  static Name moved(Name name) {
    name.part += kRepeated;
    return name;
  }
  radiosity::WorkStore& base_;
};

/// One bake at the settings of out.plan, measured.
Result<void> bake_plan(const RoomFile& room, radiosity::WorkStore* store, const Progress& progress, PlannedBake& out) {
  const auto partition = sky_for(room, out.plan.regions, progress);
  if (!partition)
    return partition.error();
  out.plan.options.store = store;
  out.report = BakeReport{};
  auto volume = bake_room(room, *partition, out.plan.options, progress, out.report);
  if (!volume)
    return volume.error();
  out.volume = std::move(*volume);
  out.measured = measured_error(out.calibration, out.report);
  return {};
}

} // namespace

/// Carries the measured errors back to the settings of the calibration bake by the same powers that predicted them.
CalibrationBake corrected(const CalibrationBake& calibration, const Plan& plan, const BakeReport& report) {
  CalibrationBake better = calibration;
  const double mesh = estimated_mesh_error(calibration, report);
  // Two calibration meshes that are the same, because faces make all facets, show no error that could be scaled.
  better.mesh_error = plan.predicted.mesh > 0 ? calibration.mesh_error * mesh / plan.predicted.mesh : mesh;
  if (!plan.options.points.empty())
    return better;
  const glm::ivec3 count =
      plan.options.grid.x > 0 ? plan.options.grid : grid_size(calibration.bounds, plan.options.spacing_m);
  const double back =
      std::pow(calibration.spacing_m / mean_spacing(calibration.bounds, count), kCostModel.grid_exponent);
  better.grid_error = back * without_noise(report.audit.smooth(&SkyError::grid_part), plan.options.gather_rays);
  better.grid_sun = back * without_noise(report.audit.sun(&SkyError::grid_part), plan.options.gather_rays);
  return better;
}

/// total^2 = volume^2 + mesh^2: the audit compares with the same mesh, so it cannot see the error of the mesh.
Measured measured_error(const CalibrationBake& calibration, const BakeReport& report) {
  Measured m;
  m.mesh = estimated_mesh_error(calibration, report);
  m.volume = report.audit.smooth(&SkyError::total);
  m.total = std::hypot(m.volume, m.mesh);
  m.limited = std::hypot(report.audit.smooth(&SkyError::limited), m.mesh);
  m.irradiance = std::hypot(report.audit.smooth(&SkyError::irradiance), m.mesh);
  const double sun = report.audit.sun(&SkyError::total);
  m.sun = sun > 0 ? std::hypot(sun, m.mesh) : 0.0;
  m.standing_points = report.audit.standing.size();
  if (m.standing_points > 0)
    m.standing = std::hypot(report.audit.smooth(&SkyError::standing), m.mesh);
  if (m.standing_points > 0 && sun > 0)
    m.standing_sun = std::hypot(report.audit.sun(&SkyError::standing), m.mesh);
  m.points = report.audit.points.size();
  for (std::size_t r = 0; r < report.audit.rooms.size(); ++r)
    if (const RoomPoints& room = report.audit.rooms[r]; !room.points.empty())
      m.rooms.push_back({room.box, room.points.size(), report.audit.errors_in(r, m.mesh)});
  for (const SkyError& s : report.audit.sky)
    if (!s.is_sun && s.total >= m.volume)
      m.worst_sky = s.sky;
  return m;
}

bool all_met(const Plan& plan, const Measured& m) {
  return !m.rooms.empty() && std::ranges::all_of(m.rooms, [&](const Measured::OfRoom& room) {
    return room.errors.smooth.percentile95 <= plan.max_error && room.errors.sun.percentile95 <= 2 * plan.max_error;
  });
}

Result<BakePlan> plan_bake(const RoomFile& room, const PlanRequest& request, const Progress& progress) {
  auto calibration =
      run_calibration_bake(room, request.points, request.box, request.stand_on, request.memory_bytes, progress);
  if (!calibration)
    return calibration.error();
  PlanRequest settled = request;
  if (request.seconds > 0) {
    const Result<double> error = error_in_time(*calibration, request, request.seconds);
    if (!error)
      return error.error();
    settled.max_error = *error;
    settled.once = true;
  }
  auto plan = make_plan(*calibration, settled);
  if (!plan)
    return plan.error();
  return BakePlan{std::move(settled), std::move(*calibration), std::move(*plan)};
}

std::string against_a_second_bake(const Plan& first, const Result<Plan>& better) {
  if (!better || better->predicted.total > first.max_error)
    return "what this one missed is out of reach";
  if (better->predicted.bytes > kMostGrowth * first.predicted.bytes)
    return format("its file would be more than %.2g times as large", kMostGrowth);
  return "";
}

Result<PlannedBake> bake_to_error(const RoomFile& room, const PlanRequest& request, radiosity::WorkStore* store,
                                  const Progress& progress, const std::function<void(const std::string&)>& announce) {
  auto planned = plan_bake(room, request, progress);
  return planned ? bake_planned(room, std::move(*planned), store, progress, announce)
                 : Result<PlannedBake>(planned.error());
}

/// Bake, measure; at most once more, from what the first bake showed.
Result<PlannedBake> bake_planned(const RoomFile& room, BakePlan planned, radiosity::WorkStore* store,
                                 const Progress& progress, const std::function<void(const std::string&)>& announce) {
  const PlanRequest& request = planned.request;
  const auto cheaper = cheaper_text(room, planned, progress);
  if (!cheaper)
    return cheaper.error();
  PlannedBake out{};
  out.calibration = std::move(planned.calibration);
  out.plan = std::move(planned.plan);
  announce(to_text(out.plan) + *cheaper);
  if (const Result<void> baked = bake_plan(room, store, progress, out); !baked)
    return baked.error().where == "--memory" ? with_offer(baked.error(), room, out.calibration, request, progress)
                                             : baked.error();
  if (request.once || out.measured.limited <= kMissed * request.max_error || all_met(out.plan, out.measured))
    return out;
  // Once more, with the cost model tied to what was measured. A target that is now out of reach, or far more work than
  // was announced, leaves the first result.
  const auto better = make_plan(corrected(out.calibration, out.plan, out.report), request);
  std::string against = against_a_second_bake(out.plan, better);
  if (against.empty() && request.memory_bytes > 0)
    if (const auto needed = memory_of(room, *better, progress); !needed || *needed > request.memory_bytes)
      against = "it would need more memory than may be taken";
  if (!against.empty()) {
    announce("note       no second bake: " + against + "\n");
    return out;
  }
  announce(to_text(out.plan, out.measured) + "once more   with a plan for what this bake missed\n");
  std::optional<RepeatedStore> again;
  if (store)
    again.emplace(*store);
  out.plan = *better;
  out.repeated = true;
  if (const Result<void> baked = bake_plan(room, again ? &*again : nullptr, progress, out); !baked)
    return baked.error();
  return out;
}

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

namespace {

constexpr std::size_t kRoomsShown = 8;

/// Mean, 95th percentile and worst sky, per cent of the irradiance there.
std::string room_lines(const Measured& m) {
  if (m.rooms.empty())
    return "";
  std::string text =
      "rooms      irradiance, % of the light there, anywhere from 10 cm off surfaces; mean / 95th percentile / worst "
      "smooth sky; the same of small suns that look in, in a clear sky\n";
  const auto add = [&](const ErrorSpread& e) {
    text +=
        e.skies == 0 ? "; no sun" : format("; %.1f / %.1f / %.1f", 100 * e.mean, 100 * e.percentile95, 100 * e.worst);
  };
  for (std::size_t r = 0; r < std::min(m.rooms.size(), kRoomsShown); ++r) {
    const Measured::OfRoom& room = m.rooms[r];
    const glm::dvec3 size = room.box.size(), middle = room.box.centre();
    text += format("           %.1f x %.1f x %.1f m around %.2f,%.2f,%.2f", size.x, size.y, size.z, middle.x, middle.y,
                   middle.z);
    add(room.errors.smooth);
    add(room.errors.sun);
    text += "\n";
  }
  if (m.rooms.size() > kRoomsShown)
    text += format("           and %zu smaller ones (--json)\n", m.rooms.size() - kRoomsShown);
  return text;
}

double smooth_percentile(const Measured::OfRoom& room) { return room.errors.smooth.percentile95; }
double sun_percentile(const Measured::OfRoom& room) { return room.errors.sun.percentile95; }

nlohmann::ordered_json to_json(const ErrorSpread& e) {
  return {{"skies", e.skies}, {"mean", e.mean}, {"percentile_95", e.percentile95}, {"worst", e.worst}};
}

nlohmann::ordered_json to_json(const Measured::OfRoom& room) {
  const auto corner = [](const glm::dvec3& p) { return nlohmann::ordered_json{p.x, p.y, p.z}; };
  return {{"low_m", corner(room.box.min)},
          {"high_m", corner(room.box.max)},
          {"points", room.points},
          {"smooth", to_json(room.errors.smooth)},
          {"sun", to_json(room.errors.sun)}};
}

} // namespace

/// By the rooms, where there are any: the 95th percentile in the one that misses most.
std::string missed_text(const Plan& plan, const Measured& m) {
  double smooth = m.total, sun = m.sun;
  std::string in_smooth, in_sun;
  const auto place = [](const Measured::OfRoom& room) {
    const glm::dvec3 p = room.box.centre();
    return format(" in the room around %.2f,%.2f,%.2f", p.x, p.y, p.z);
  };
  if (!m.rooms.empty()) {
    const auto& most = *std::ranges::max_element(m.rooms, {}, smooth_percentile);
    const auto& most_sun = *std::ranges::max_element(m.rooms, {}, sun_percentile);
    smooth = smooth_percentile(most);
    sun = sun_percentile(most_sun);
    in_smooth = place(most);
    in_sun = place(most_sun);
  }
  const double wanted = plan.max_error;
  std::string text;
  if (smooth > wanted)
    text += format(
        "warning    the error%s is %.3g %%, above the %.3g %% that were wanted; --max-error %.3g may reach them\n",
        in_smooth.c_str(), 100 * smooth, 100 * wanted, 100 * wanted * wanted / smooth);
  if (sun > 2 * wanted)
    text += format("note       under small suns the error%s is %.3g %%, above twice that\n", in_sun.c_str(), 100 * sun);
  return text;
}

/// The measured error beside the target, with a warning where it is above.
std::string to_text(const Plan& plan, const Measured& m) {
  std::string text = format(
      "measured   %.2f %% (mesh %.2f estimated, volume %.2f) at %zu points and the worst of 5 smooth skies (%s) that "
      "the bake did not use\n",
      100 * m.total, 100 * m.mesh, 100 * m.volume, m.points, m.worst_sky.c_str());
  text += format("           as irradiance %.2f %%", 100 * m.irradiance);
  if (m.sun > 0)
    text += format("; under a small sun %.1f %%", 100 * m.sun);
  text += "\n";
  if (m.standing_points > 0)
    text += format("           where objects stand (%zu points 1 to 30 cm above level faces) irradiance %.2f %%",
                   m.standing_points, 100 * m.standing);
  if (m.standing_sun > 0)
    text += format("; under a small sun %.1f %%", 100 * m.standing_sun);
  if (m.standing_points > 0)
    text += "\n";
  return text + room_lines(m) + missed_text(plan, m);
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
  j["measured"] = {{"error", m.total},
                   {"mesh", m.mesh},
                   {"volume", m.volume},
                   {"irradiance", m.irradiance},
                   {"sun", m.sun},
                   {"worst_sky", m.worst_sky},
                   {"points", m.points},
                   {"standing", m.standing},
                   {"standing_sun", m.standing_sun},
                   {"standing_points", m.standing_points},
                   {"rooms", nlohmann::ordered_json::array()}};
  for (const Measured::OfRoom& room : m.rooms)
    j["measured"]["rooms"].push_back(to_json(room));
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

} // namespace daylit::precompute
