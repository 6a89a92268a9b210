#include "precompute/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "precompute/adaptive_sky.h"
#include "precompute/cost_model.h"
#include "precompute/probes.h"

namespace daylit::precompute {

namespace {

// Shares of the target. Together 0.82 of it; a bake that misses is repeated with better knowledge.
constexpr double kMeshShare = 0.45, kGridShare = 0.64;
constexpr double kPointsShare = 0.30; ///< of the mesh at given points, where no grid adds to it
constexpr double kSunShare = 2.0;
constexpr double kOrderShare = 0.25; ///< of the target: what nine coefficients may leave of irradiance
constexpr int kFewestFacets = 200, kMostFacets = 60000;
constexpr double kMostFloats = 1.5e9; ///< of the coefficients while they are computed: 6 GB
constexpr double kMostProbes = 2e6;
constexpr std::array<int, 4> kNodes{256, 1024, 4096, 16384};
// Patches and elements per facet of the law: first light on finer pieces than the rest (detail/light_elements.h).
constexpr double kPatchShare = 0.65, kElementShare = 1.6;
constexpr double kCompactShare = 1.55;       ///< error of the factors under suns / target
constexpr double kNodeShare = 0.3;           ///< of the target, before compression
constexpr double kNodesAtTwoPercent = 16384; ///< at most, ~ 1 / target
constexpr double kClearlyFiner = 1.8;        ///< ratio of facets from which a difference tells an error
constexpr double kMinCompact = 1e-3, kMaxCompact = 0.1;
constexpr double kRowRays = 229376; ///< visibility rays at 2 %: rows of form factors close to 1e-3
constexpr double kClusters = 512;   ///< at 2 %, of surfaces whose further bounces are solved together
constexpr int kGatherRays = 3072;   ///< per probe at 2 %: noise of the rays costs components of a fine sky

const CostModel& model = kCostModel;

double grid_part(const CalibrationBake& calibration, double spacing_m, double rays, double at_calibration) {
  const double curved = at_calibration * std::pow(spacing_m / calibration.spacing_m, model.grid_exponent);
  return std::hypot(curved, ray_noise(rays));
}

/// Facets of the law that a mesh with elements is as good as.
double facets_like(double patches, double elements) {
  return elements > patches ? std::sqrt(patches * elements / (kPatchShare * kElementShare)) : patches;
}

double mesh_part(const CalibrationBake& calibration, double facets) {
  return calibration.mesh_error * std::pow(static_cast<double>(calibration.fine.facets) / facets, model.mesh_exponent);
}

struct SkyParts {
  double smooth = 0, sun = 0;
};

/// What the cost model know of a sky.
struct SkyKind {
  double regions = 0;
  bool nodes = false, adaptive = false;

  static SkyKind of(const std::string& text) {
    if (const auto n = adaptive_regions(text))
      return {static_cast<double>(*n), false, true};
    const SkyPartition partition = *SkyPartition::parse(text);
    return {static_cast<double>(partition.size()), partition.interpolated(), false};
  }
  /// Columns that are solved and kept: adaptive regions lie where light comes in.
  double stored(double share) const { return adaptive ? regions : regions * share; }
};

SkyParts sky_parts(const SkyKind& sky, double compact_error) {
  const double n = sky.regions;
  if (sky.adaptive)
    return {model.adaptive_error * 64 / n, model.adaptive_sun * std::pow(256 / n, model.adaptive_sun_exponent)};
  if (!sky.nodes)
    return {model.region_error * 64 / n,
            n <= 256 ? model.region_sun : model.region_sun * std::pow(256 / n, model.region_sun_exponent)};
  return {std::hypot(model.node_error * 1024 / n, model.compact_smooth * compact_error),
          std::hypot(model.node_sun * std::pow(1024 / n, model.node_sun_exponent), model.compact_sun * compact_error)};
}

double seconds_of(const std::vector<StageTime>& stages, const std::string& name) {
  double sum = 0;
  for (const StageTime& s : stages)
    sum += s.name == name ? s.seconds : 0.0;
  return sum;
}

/// What a bake costs, in multiplications and rays; the calibration bake's own seconds tell what they take here.
struct Work {
  double facets, probes, columns, channels, gather_rays, elements;
  double product() const { return 9 * probes * facets * columns * channels; }
  double solve() const { return facets * facets * columns * channels + facets * facets * facets * channels / 3; }
  double rays() const { return probes * gather_rays; }
  // Of a fine sky.
  double sources() const { return model.lit_elements * elements; }
  /// Halves of the air until each is small enough.
  double probe_clusters() const {
    return std::exp2(
        std::ceil(std::log2(std::max(probes / static_cast<double>(CompactOptions{}.cluster_probes), 1.0))));
  }
  double compress(double error) const {
    const double share = sources() / model.compress_square;
    return probe_clusters() * (1 + share * share) *
           std::pow(probes / probe_clusters() / model.compress_probes, model.compress_probes_exponent) *
           std::pow(0.03 / error, model.compress_exponent);
  }
};

double predicted_seconds(const CalibrationBake& calibration, const Work& work, double visibility_rays,
                         double compact_error) {
  const bool fine = compact_error > 0;
  const auto own_facets = static_cast<double>(calibration.fine.facets);
  const Work own{own_facets,
                 static_cast<double>(calibration.probes),
                 64 * calibration.stored_fraction,
                 static_cast<double>(calibration.channels),
                 calibration.gather_rays,
                 own_facets};
  const auto calibrated = [&](const char* stage) { return seconds_of(calibration.stages, stage); };
  const double more = work.facets / own.facets, elements = fine ? work.elements / own.facets : more;
  const double model = model.gather_start_s + model.ray_s * own.rays() + model.product_s * own.product();
  const double speed = std::clamp((calibrated("rays") + calibrated("volume")) / model, 0.1, 10.0);
  double s = calibration.seconds + model.start_s + more * calibrated("mesh") + elements * calibrated("first bounce");
  s += std::max(model.audit_elements * elements, 1.0) * calibrated("audit");
  s += calibrated("form factors") * std::pow(more, model.exchange_exponent) *
       std::pow(visibility_rays / calibration.visibility_rays, model.visibility_exponent);
  s += speed * (model.ray_s * work.rays() + model.solve_s * work.solve());
  return s + speed * (fine ? model.compress_s * work.compress(compact_error) : model.product_s * work.product());
}

double predicted_bytes(const Work& work, const SkyKind& sky, double compact_error, BasisPrecision precision) {
  if (!sky.nodes)
    return work.probes * 27 * work.columns * (precision == BasisPrecision::float16 ? 2 : 4);
  const double probes = work.probes / work.probe_clusters(),
               full = static_cast<double>(CompactOptions{}.cluster_probes);
  const double rank =
      model.rank * std::pow(0.03 / compact_error, model.rank_exponent) * std::pow(probes / full, model.rank_of_probes);
  return model.stored_bytes * work.probe_clusters() * rank *
             (model.aggregated_fraction * work.sources() + model.row_padding * 27 * probes) +
         model.light_bytes * work.sources() * sky.regions;
}

/// The settings on their way, with what they are predicted to do.
class Planner {
public:
  Planner(const CalibrationBake& calibration, const PlanRequest& request)
      : calibration_(calibration), request_(request) {}

  Result<Plan> plan(double target) const {
    Plan plan;
    plan.max_error = target;
    plan.options.points = request_.points;
    plan.options.audit = true;
    plan.options.held_out = calibration_.fine.audit.points;
    const double finer = 0.02 / target;
    plan.options.clusters = static_cast<std::size_t>(kClusters * std::clamp(finer, 0.5, 4.0));
    plan.options.visibility_rays = kRowRays * std::clamp(finer, 1.0 / 14, 8.0);
    const bool grid = request_.points.empty();
    plan.options.gather_rays =
        static_cast<int>(kGatherRays * std::clamp(std::pow(finer, 1.2), 0.25, 64.0) * (grid ? 1 : 2));
    plan.options.facet_edge_m = request_.facet_edge_m;
    const int facets = choose_facets(target);
    plan.options.target_facets = facets;
    plan.options.elements = static_cast<std::size_t>(kElementShare / kPatchShare * facets);
    if (fine() && request_.facets == 0 && request_.facet_edge_m == 0) {
      plan.options.target_facets = static_cast<int>(kPatchShare * facets);
      plan.options.elements = static_cast<std::size_t>(kElementShare * facets);
    }
    choose_grid(target, plan.options);
    plan.options.sh_order = request_.sh_order.value_or(choose_order(target));
    if (const Result<void> sky = choose_sky(target, plan); !sky)
      return sky.error();
    predict(plan);
    return plan;
  }

private:
  bool fine() const { return request_.regions.empty() || SkyKind::of(request_.regions).nodes; }

  /// Order 4 where nine coefficients leave much of what the light may err. In constant regions l = 4 doubles the file:
  /// only when asked for.
  ShOrder choose_order(double target) const {
    const AuditReport& seen = calibration_.fine.audit;
    const bool much = seen.smooth(&SkyError::band4) > kOrderShare * target ||
                      seen.sun(&SkyError::band4) > kOrderShare * kSunShare * target;
    return fine() && much ? ShOrder::fourth : ShOrder::second;
  }

  double mesh_of(const Plan& plan) const {
    const double facets = plan.options.target_facets;
    return mesh_part(calibration_, fine() ? facets_like(facets, static_cast<double>(plan.options.elements)) : facets);
  }

  int choose_facets(double target) const {
    if (request_.facets > 0)
      return request_.facets;
    const double allowed = target * (request_.points.empty() ? kMeshShare : kPointsShare);
    const double more = std::pow(calibration_.mesh_error / allowed, 1.0 / model.mesh_exponent);
    return static_cast<int>(
        std::clamp(more * static_cast<double>(calibration_.fine.facets), double(kFewestFacets), double(kMostFacets)));
  }

  void choose_grid(double target, BakeOptions& options) const {
    options.grid = request_.grid;
    options.spacing_m = request_.spacing_m;
    if (request_.points.empty() && request_.graded.value_or(options.grid.x == 0 && options.spacing_m == 0))
      options.density = calibration_.density;
    if (options.grid.x > 0 || options.spacing_m > 0 || !request_.points.empty())
      return;
    const glm::dvec3 size = calibration_.bounds.size();
    const double columns = 3 * 1024 * calibration_.stored_fraction;
    // Steps of 1.5 %: the number of probes jumps where one more fits along an axis.
    for (double spacing = 0.5 * std::max({size.x, size.y, size.z});; spacing /= 1.015) {
      const glm::ivec3 count = grid_size(calibration_.bounds, spacing);
      const double probes = static_cast<double>(count.x) * count.y * count.z;
      if (probes > kMostProbes || probes * 27 / 3 * columns * calibration_.air_fraction > kMostFloats)
        return;
      options.spacing_m = spacing;
      if (grid_part(calibration_, mean_spacing(calibration_.bounds, count), options.gather_rays,
                    calibration_.grid_error) <= kGridShare * target)
        return;
    }
  }

  double spacing_of(const BakeOptions& options) const {
    return mean_spacing(calibration_.bounds,
                        options.grid.x > 0 ? options.grid : grid_size(calibration_.bounds, options.spacing_m));
  }

  double sun_error(const Plan& plan, double sky_sun) const {
    if (calibration_.grid_sun <= 0)
      return 0;
    const double mesh = mesh_of(plan);
    const double grid = request_.points.empty() ? grid_part(calibration_, spacing_of(plan.options),
                                                            plan.options.gather_rays, calibration_.grid_sun)
                                                : 0;
    return std::hypot(mesh, std::hypot(grid, sky_sun));
  }

  Result<void> choose_sky(double target, Plan& plan) const {
    plan.precision = target >= 0.005 ? BasisPrecision::float16 : BasisPrecision::float32;
    plan.options.compact_error = std::clamp(kCompactShare * target, kMinCompact, kMaxCompact);
    plan.regions = request_.regions;
    if (!plan.regions.empty())
      return check_regions(plan.regions);
    const auto sun_with = [&](int nodes) {
      return sun_error(plan, sky_parts({static_cast<double>(nodes), true}, plan.options.compact_error).sun);
    };
    const auto smooth_with = [](int nodes) { return model.node_error * 1024 / nodes; };
    int nodes = kNodes.front();
    for (const int more : kNodes) {
      const bool sun = calibration_.grid_sun > 0 && more <= kNodesAtTwoPercent * 0.02 / target &&
                       sun_with(nodes) > kSunShare * target;
      if (more > nodes && (sun || smooth_with(nodes) > kNodeShare * target))
        nodes = more;
    }
    plan.regions = "fine:" + std::to_string(nodes);
    return {};
  }

  void predict(Plan& plan) const {
    Prediction& p = plan.predicted;
    const SkyKind kind = SkyKind::of(plan.regions);
    const SkyParts sky = sky_parts(kind, plan.options.compact_error);
    // A fixed edge: as many facets as the calibration bake's at its edge, by area.
    double facets = plan.options.target_facets;
    if (plan.options.facet_edge_m > 0)
      facets = static_cast<double>(calibration_.fine.facets) *
               std::pow(calibration_.fine.facet_edge_m / plan.options.facet_edge_m, 2.0);
    p.mesh = mesh_part(calibration_, fine() ? facets_like(facets, static_cast<double>(plan.options.elements)) : facets);
    p.sky = sky.smooth;
    double probes = static_cast<double>(request_.points.size());
    if (request_.points.empty()) {
      p.grid = grid_part(calibration_, spacing_of(plan.options), plan.options.gather_rays, calibration_.grid_error);
      const glm::ivec3 count =
          plan.options.grid.x > 0 ? plan.options.grid : grid_size(calibration_.bounds, plan.options.spacing_m);
      probes = static_cast<double>(count.x) * count.y * count.z * calibration_.air_fraction;
    } else {
      p.grid = ray_noise(plan.options.gather_rays);
    }
    p.total = std::hypot(p.mesh, std::hypot(p.grid, p.sky));
    p.sun = sun_error(plan, sky.sun);
    // A fine sky is solved for its clusters, whatever the number of nodes.
    const double columns =
        kind.nodes ? static_cast<double>(plan.options.clusters) : kind.stored(calibration_.stored_fraction);
    const Work work{facets,
                    probes,
                    columns,
                    static_cast<double>(calibration_.channels),
                    static_cast<double>(plan.options.gather_rays),
                    static_cast<double>(plan.options.elements)};
    p.seconds = predicted_seconds(calibration_, work, plan.options.visibility_rays,
                                  kind.nodes ? plan.options.compact_error : 0.0);
    p.bytes = predicted_bytes(work, kind, plan.options.compact_error, plan.precision);
  }

  const CalibrationBake& calibration_;
  const PlanRequest& request_;
};

constexpr double kFinest = 1e-4; ///< the target at which every setting is at its limit

} // namespace

Result<Plan> make_plan(const CalibrationBake& calibration, const PlanRequest& request) {
  const Planner planner(calibration, request);
  const double asked = request.max_error;
  const Result<Plan> finest = planner.plan(kFinest);
  if (!finest)
    return finest.error();
  const double reachable = finest->predicted.total;
  if (!(asked > 0) || asked < kFinest || (request.must_reach && asked < reachable) || !(asked < 1)) {
    char text[160];
    std::snprintf(text, sizeof(text), "%g %% is no error that can be planned for this room; the smallest is %.2g %%",
                  100 * asked, 100 * std::max(reachable * 1.02, kFinest));
    return Error{ErrorCode::value_invalid, text, "--max-error",
                 request.regions.empty() && request.facets == 0 && request.spacing_m == 0 && request.grid.x == 0
                     ? "ask for a larger one"
                     : "ask for a larger one, or leave the number of regions, facets and probes to the plan"};
  }
  return planner.plan(asked);
}

namespace {

double facets_like(const BakeReport& report) {
  const double elements_per_patch =
      static_cast<double>(report.elements) / static_cast<double>(std::max<std::size_t>(report.patches, 1));
  const auto facets = static_cast<double>(report.facets);
  return facets_like(facets, elements_per_patch * facets);
}

} // namespace

CalibrationBake corrected(const CalibrationBake& calibration, const Plan& plan, const BakeReport& report) {
  CalibrationBake better = calibration;
  const Measured m = measured_error(calibration, report);
  const double facets = facets_like(report);
  better.mesh_error = m.mesh * std::pow(facets / static_cast<double>(calibration.fine.facets), model.mesh_exponent);
  if (!plan.options.points.empty())
    return better;
  const glm::ivec3 count =
      plan.options.grid.x > 0 ? plan.options.grid : grid_size(calibration.bounds, plan.options.spacing_m);
  const double back = std::pow(calibration.spacing_m / mean_spacing(calibration.bounds, count), model.grid_exponent);
  better.grid_error = back * without_noise(report.audit.smooth(&SkyError::grid_part), plan.options.gather_rays);
  better.grid_sun = back * without_noise(report.audit.sun(&SkyError::grid_part), plan.options.gather_rays);
  return better;
}

double estimated_mesh_error(const CalibrationBake& calibration, const BakeReport& report) {
  // Against the finest calibration bake mesh that is clearly coarser; on a mesh no finer than any, the calibration
  // bake's law stands.
  const double facets = facets_like(report);
  for (const CalibrationMesh* mesh : {&calibration.fine, &calibration.coarse}) {
    const double ratio = facets / static_cast<double>(std::max<std::size_t>(mesh->facets, 1));
    if (ratio > kClearlyFiner)
      return mesh_difference(mesh->audit, report.audit) / (std::pow(ratio, model.mesh_exponent) - 1.0);
  }
  return mesh_part(calibration, facets);
}

Measured measured_error(const CalibrationBake& calibration, const BakeReport& report) {
  Measured m;
  m.mesh = estimated_mesh_error(calibration, report);
  m.volume = report.audit.smooth(&SkyError::total);
  m.total = std::hypot(m.volume, m.mesh);
  m.irradiance = std::hypot(report.audit.smooth(&SkyError::irradiance), m.mesh);
  const double sun = report.audit.sun(&SkyError::total);
  m.sun = sun > 0 ? std::hypot(sun, m.mesh) : 0.0;
  m.points = report.audit.points.size();
  for (const SkyError& s : report.audit.sky)
    if (!s.is_sun && s.total >= m.volume)
      m.worst_sky = s.sky;
  return m;
}

} // namespace daylit::precompute
