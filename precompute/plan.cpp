#include "precompute/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "precompute/adaptive_sky.h"
#include "precompute/plan_laws.h"
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

const PlanLaws& laws = kPlanLaws;

double grid_part(const Pilot& pilot, double spacing_m, double rays, double at_pilot) {
  const double curved = at_pilot * std::pow(spacing_m / pilot.spacing_m, laws.grid_exponent);
  return std::hypot(curved, ray_noise(rays));
}

/// Facets of the law that a mesh with elements is as good as.
double facets_like(double patches, double elements) {
  return elements > patches ? std::sqrt(patches * elements / (kPatchShare * kElementShare)) : patches;
}

double mesh_part(const Pilot& pilot, double facets) {
  return pilot.mesh_error * std::pow(static_cast<double>(pilot.fine.facets) / facets, laws.mesh_exponent);
}

struct SkyParts {
  double smooth = 0, sun = 0;
};

/// What the laws know of a sky.
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
    return {laws.adaptive_error * 64 / n, laws.adaptive_sun * std::pow(256 / n, laws.adaptive_sun_exponent)};
  if (!sky.nodes)
    return {laws.region_error * 64 / n,
            n <= 256 ? laws.region_sun : laws.region_sun * std::pow(256 / n, laws.region_sun_exponent)};
  return {std::hypot(laws.node_error * 1024 / n, laws.compact_smooth * compact_error),
          std::hypot(laws.node_sun * std::pow(1024 / n, laws.node_sun_exponent), laws.compact_sun * compact_error)};
}

double seconds_of(const std::vector<StageTime>& stages, const std::string& name) {
  double sum = 0;
  for (const StageTime& s : stages)
    sum += s.name == name ? s.seconds : 0.0;
  return sum;
}

/// What a bake costs, in multiplications and rays; the pilot's own seconds tell what they take here.
struct Work {
  double facets, probes, columns, channels, gather_rays, elements;
  double product() const { return 9 * probes * facets * columns * channels; }
  double solve() const { return facets * facets * columns * channels + facets * facets * facets * channels / 3; }
  double rays() const { return probes * gather_rays; }
  // Of a fine sky.
  double sources() const { return laws.lit_elements * elements; }
  /// Halves of the air until each is small enough.
  double probe_clusters() const {
    return std::exp2(std::ceil(std::log2(std::max(probes / static_cast<double>(CompactOptions{}.cluster_probes), 1.0))));
  }
  double compress(double error) const {
    const double share = sources() / laws.compress_square;
    return probe_clusters() * (1 + share * share) *
           std::pow(probes / probe_clusters() / laws.compress_probes, laws.compress_probes_exponent) *
           std::pow(0.03 / error, laws.compress_exponent);
  }
};

double predicted_seconds(const Pilot& pilot, const Work& work, double visibility_rays, double compact_error) {
  const bool fine = compact_error > 0;
  const auto own_facets = static_cast<double>(pilot.fine.facets);
  const Work own{own_facets,
                 static_cast<double>(pilot.probes),
                 64 * pilot.stored_share,
                 static_cast<double>(pilot.channels),
                 pilot.gather_rays,
                 own_facets};
  const auto pilots = [&](const char* stage) { return seconds_of(pilot.stages, stage); };
  const double more = work.facets / own.facets, elements = fine ? work.elements / own.facets : more;
  const double model = laws.gather_start_s + laws.ray_s * own.rays() + laws.product_s * own.product();
  const double speed = std::clamp((pilots("rays") + pilots("volume")) / model, 0.1, 10.0);
  double s = pilot.seconds + laws.start_s + more * pilots("mesh") + elements * pilots("first bounce");
  s += std::max(laws.audit_elements * elements, 1.0) * pilots("audit");
  s += pilots("form factors") * std::pow(more, laws.exchange_exponent) *
       std::pow(visibility_rays / pilot.visibility_rays, laws.visibility_exponent);
  s += speed * (laws.ray_s * work.rays() + laws.solve_s * work.solve());
  return s + speed * (fine ? laws.compress_s * work.compress(compact_error) : laws.product_s * work.product());
}

double predicted_bytes(const Work& work, const SkyKind& sky, double compact_error, BasisPrecision precision) {
  if (!sky.nodes)
    return work.probes * 27 * work.columns * (precision == BasisPrecision::float16 ? 2 : 4);
  const double probes = work.probes / work.probe_clusters(), full = static_cast<double>(CompactOptions{}.cluster_probes);
  const double rank =
      laws.rank * std::pow(0.03 / compact_error, laws.rank_exponent) * std::pow(probes / full, laws.rank_of_probes);
  return laws.stored_bytes * work.probe_clusters() * rank *
             (laws.aggregated_fraction * work.sources() + laws.row_padding * 27 * probes) +
         laws.light_bytes * work.sources() * sky.regions;
}

/// The settings on their way, with what they are predicted to do.
class Planner {
public:
  Planner(const Pilot& pilot, const PlanRequest& request) : pilot_(pilot), request_(request) {}

  Result<Plan> plan(double target) const {
    Plan plan;
    plan.max_error = target;
    plan.options.points = request_.points;
    plan.options.audit = true;
    plan.options.held_out = pilot_.fine.audit.points;
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
    const AuditReport& seen = pilot_.fine.audit;
    const bool much = seen.smooth(&SkyError::band4) > kOrderShare * target ||
                      seen.sun(&SkyError::band4) > kOrderShare * kSunShare * target;
    return fine() && much ? ShOrder::fourth : ShOrder::second;
  }

  double mesh_of(const Plan& plan) const {
    const double facets = plan.options.target_facets;
    return mesh_part(pilot_, fine() ? facets_like(facets, static_cast<double>(plan.options.elements)) : facets);
  }

  int choose_facets(double target) const {
    if (request_.facets > 0)
      return request_.facets;
    const double allowed = target * (request_.points.empty() ? kMeshShare : kPointsShare);
    const double more = std::pow(pilot_.mesh_error / allowed, 1.0 / laws.mesh_exponent);
    return static_cast<int>(
        std::clamp(more * static_cast<double>(pilot_.fine.facets), double(kFewestFacets), double(kMostFacets)));
  }

  void choose_grid(double target, BakeOptions& options) const {
    options.grid = request_.grid;
    options.spacing_m = request_.spacing_m;
    if (request_.points.empty() && request_.graded.value_or(options.grid.x == 0 && options.spacing_m == 0))
      options.density = pilot_.density;
    if (options.grid.x > 0 || options.spacing_m > 0 || !request_.points.empty())
      return;
    const glm::dvec3 size = pilot_.bounds.size();
    const double columns = 3 * 1024 * pilot_.stored_share;
    // Steps of 1.5 %: the number of probes jumps where one more fits along an axis.
    for (double spacing = 0.5 * std::max({size.x, size.y, size.z});; spacing /= 1.015) {
      const glm::ivec3 count = grid_size(pilot_.bounds, spacing);
      const double probes = static_cast<double>(count.x) * count.y * count.z;
      if (probes > kMostProbes || probes * 27 / 3 * columns * pilot_.air_share > kMostFloats)
        return;
      options.spacing_m = spacing;
      if (grid_part(pilot_, mean_spacing(pilot_.bounds, count), options.gather_rays, pilot_.grid_error) <=
          kGridShare * target)
        return;
    }
  }

  double spacing_of(const BakeOptions& options) const {
    return mean_spacing(pilot_.bounds, options.grid.x > 0 ? options.grid : grid_size(pilot_.bounds, options.spacing_m));
  }

  double sun_error(const Plan& plan, double sky_sun) const {
    if (pilot_.grid_sun <= 0)
      return 0;
    const double mesh = mesh_of(plan);
    const double grid = request_.points.empty()
                            ? grid_part(pilot_, spacing_of(plan.options), plan.options.gather_rays, pilot_.grid_sun)
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
    const auto smooth_with = [](int nodes) { return laws.node_error * 1024 / nodes; };
    int nodes = kNodes.front();
    for (const int more : kNodes) {
      const bool sun =
          pilot_.grid_sun > 0 && more <= kNodesAtTwoPercent * 0.02 / target && sun_with(nodes) > kSunShare * target;
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
    // A fixed edge: as many facets as the pilot's at its edge, by area.
    double facets = plan.options.target_facets;
    if (plan.options.facet_edge_m > 0)
      facets =
          static_cast<double>(pilot_.fine.facets) * std::pow(pilot_.fine.facet_edge_m / plan.options.facet_edge_m, 2.0);
    p.mesh = mesh_part(pilot_, fine() ? facets_like(facets, static_cast<double>(plan.options.elements)) : facets);
    p.sky = sky.smooth;
    double probes = static_cast<double>(request_.points.size());
    if (request_.points.empty()) {
      p.grid = grid_part(pilot_, spacing_of(plan.options), plan.options.gather_rays, pilot_.grid_error);
      const glm::ivec3 count =
          plan.options.grid.x > 0 ? plan.options.grid : grid_size(pilot_.bounds, plan.options.spacing_m);
      probes = static_cast<double>(count.x) * count.y * count.z * pilot_.air_share;
    } else {
      p.grid = ray_noise(plan.options.gather_rays);
    }
    p.total = std::hypot(p.mesh, std::hypot(p.grid, p.sky));
    p.sun = sun_error(plan, sky.sun);
    // A fine sky is solved for its clusters, whatever the number of nodes.
    const double columns = kind.nodes ? static_cast<double>(plan.options.clusters) : kind.stored(pilot_.stored_share);
    const Work work{facets,
                    probes,
                    columns,
                    static_cast<double>(pilot_.channels),
                    static_cast<double>(plan.options.gather_rays),
                    static_cast<double>(plan.options.elements)};
    p.seconds =
        predicted_seconds(pilot_, work, plan.options.visibility_rays, kind.nodes ? plan.options.compact_error : 0.0);
    p.bytes = predicted_bytes(work, kind, plan.options.compact_error, plan.precision);
  }

  const Pilot& pilot_;
  const PlanRequest& request_;
};

constexpr double kFinest = 1e-4; ///< the target at which every setting is at its limit

} // namespace

Result<Plan> make_plan(const Pilot& pilot, const PlanRequest& request) {
  const Planner planner(pilot, request);
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

Pilot corrected(const Pilot& pilot, const Plan& plan, const BakeReport& report) {
  Pilot better = pilot;
  const Measured m = measured_error(pilot, report);
  const double facets = facets_like(report);
  better.mesh_error = m.mesh * std::pow(facets / static_cast<double>(pilot.fine.facets), laws.mesh_exponent);
  if (!plan.options.points.empty())
    return better;
  const glm::ivec3 count =
      plan.options.grid.x > 0 ? plan.options.grid : grid_size(pilot.bounds, plan.options.spacing_m);
  const double back = std::pow(pilot.spacing_m / mean_spacing(pilot.bounds, count), laws.grid_exponent);
  better.grid_error = back * without_noise(report.audit.smooth(&SkyError::grid_part), plan.options.gather_rays);
  better.grid_sun = back * without_noise(report.audit.sun(&SkyError::grid_part), plan.options.gather_rays);
  return better;
}

double estimated_mesh_error(const Pilot& pilot, const BakeReport& report) {
  // Against the finest pilot mesh that is clearly coarser; on a mesh no finer than any, the pilot's law stands.
  const double facets = facets_like(report);
  for (const PilotMesh* mesh : {&pilot.fine, &pilot.coarse}) {
    const double ratio = facets / static_cast<double>(std::max<std::size_t>(mesh->facets, 1));
    if (ratio > kClearlyFiner)
      return mesh_difference(mesh->audit, report.audit) / (std::pow(ratio, laws.mesh_exponent) - 1.0);
  }
  return mesh_part(pilot, facets);
}

Measured measured_error(const Pilot& pilot, const BakeReport& report) {
  Measured m;
  m.mesh = estimated_mesh_error(pilot, report);
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
