#include "precompute/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "precompute/adaptive_sky.h"
#include "precompute/cost_model.h"
#include "precompute/far_probes.h"
#include "precompute/probes.h"

namespace daylit::precompute {

namespace {

// Parts of the target. Together 0.67 of it; a bake that misses is repeated with better knowledge.
constexpr double kMeshPart = 0.45, kGridPart = 0.38;
constexpr double kMeshPartOfRooms = 0.36; ///< in a building: the law knows the error of all rooms, not that of dim ones
constexpr double kSunPart = 2.0;
constexpr double kOrderPart = 0.25; ///< of the target: what nine coefficients may leave of irradiance
constexpr int kFewestFacets = 200, kMostFacets = 60000;
constexpr double kMostFloats = 1.5e9; ///< of the coefficients while they are computed: 6 GB
constexpr double kMostProbes = 2e6;
constexpr std::array<int, 4> kNodes{256, 1024, 4096, 16384};
constexpr double kCompactPart = 1.55;        ///< error of the factors under suns / target, where all is one room
constexpr double kCompactLeast = 0.4;        ///< of that part, in a building of many rooms
constexpr double kCompactPoints = 0.7;       ///< the same at given points, which are few
constexpr double kNodePart = 0.3;            ///< of the target, before compression
constexpr double kNodesAtTwoPercent = 16384; ///< at most, ~ 1 / target
constexpr double kMinCompact = 1e-3, kMaxCompact = 0.1;
constexpr double kRowRays = 229376; ///< visibility rays at 2 %: rows of form factors close to 1e-3
// Of surfaces whose further bounces are solved together: at least so many at 2 %, and so many of the facets.
constexpr double kClusters = 512, kFacetsInClusters = 0.4, kMostClusters = 2048;
constexpr double kFixedPerFacet = 2.0;    ///< facets of small faces beyond so many for each other one are furniture's
constexpr double kBesideFurniture = 0.65; ///< of what grid and factors may err, at least, where there are more
constexpr int kGatherRays = 3072;         ///< per probe at 2 %: noise of the rays costs components of a fine sky
constexpr double kFinest = 1e-4;          ///< the target at which every setting is at its limit
constexpr double kCoarsest = 0.2, kErrorStep = 1.08; ///< errors that are tried where a time decides

/// Probes of a grid.
double cells(const glm::ivec3& count) { return static_cast<double>(count.x) * count.y * count.z; }

/// The settings on their way, with what they are predicted to do.
class Planner {
public:
  Planner(const CalibrationBake& calibration, const PlanRequest& request)
      : calibration_(calibration), request_(request) {}

  /// Each choice takes its part of the target; together they stay below it (constants above).
  Result<Plan> plan(double target) const {
    Plan plan;
    plan.max_error = target;
    plan.options.points = request_.points;
    plan.options.receivers = calibration_.receivers;
    plan.options.box = calibration_.box;
    plan.options.audit = true;
    plan.options.memory_bytes = request_.memory_bytes;
    plan.options.seen_of_room = seen_of_room();
    plan.options.held_out = calibration_.fine.audit.points;
    plan.options.held_out_standing = calibration_.standing;
    plan.options.held_out_rooms = calibration_.rooms;
    choose_effort(target, plan.options);
    choose_mesh(target, plan.options);
    choose_clusters(target, plan.options);
    choose_grid(target, plan.options);
    if (const Result<void> fits = check_grid(plan.options); !fits)
      return fits.error();
    plan.options.sh_order = request_.sh_order.value_or(choose_order(target));
    if (const Result<void> sky = choose_sky(target, plan); !sky)
      return sky.error();
    predict(plan);
    return plan;
  }

private:
  bool fine() const { return request_.regions.empty() || SkyKind::of(request_.regions).nodes; }

  /// What one place sees of what is lit, / that in a single room.
  double seen_of_room() const {
    const double seen = calibration_.seen_fraction / kCostModel.seen_in_room;
    return calibration_.rooms.size() > 1 ? std::min(seen, 1.0) : 1.0;
  }

  /// A sun that looks into one of several rooms gives the others little, and errs more there: in proportion to what one
  /// place sees of what is lit.
  double compact_part() const { return std::max(seen_of_room(), kCompactLeast); }

  /// What only reduces noise grows as the target falls, from values that do at 2 %.
  void choose_effort(double target, BakeOptions& options) const {
    const double finer = 0.02 / target;
    options.visibility_rays = kRowRays * std::clamp(finer, 1.0 / 14, 8.0);
    options.gather_rays = static_cast<int>(kGatherRays * std::clamp(std::pow(finer, 1.2), 0.25, 64.0) *
                                           (request_.points.empty() ? 1 : 2));
  }

  /// Where furniture makes most of the facets, exchange between these takes the time, whatever the error that is
  /// wanted. Probes and factors then cost little, so they take less of it.
  double beside_furniture(const BakeOptions& options) const {
    const double fixed = static_cast<double>(calibration_.fixed_facets);
    return std::clamp(std::sqrt(kFixedPerFacet * facets_of(options) / std::max(fixed, 1.0)), kBesideFurniture, 1.0);
  }

  /// n = 512 (2 % / target), at least 0.4 of the facets: in a building every room needs its own. Furniture's are small,
  /// many in a cluster.
  void choose_clusters(double target, BakeOptions& options) const {
    const double usual = kClusters * std::clamp(0.02 / target, 0.5, 4.0), free = facets_of(options),
                 facets = free + std::min(static_cast<double>(calibration_.fixed_facets), kFixedPerFacet * free);
    options.clusters = static_cast<std::size_t>(std::min(std::max(usual, kFacetsInClusters * facets), kMostClusters));
  }

  /// Facets from the mesh error's power law; under a fine sky fewer patches, with more elements on them. Their number
  /// jumps where narrow faces are cut, so the mesh is made by the length of its edges: N ~ 1 / edge^2.
  void choose_mesh(double target, BakeOptions& options) const {
    const bool planned = request_.facets == 0 && request_.facet_edge_m == 0;
    double patches = (fine() && planned ? kPatchFraction : 1.0) * choose_facets(target);
    options.facet_edge_m = request_.facet_edge_m;
    if (planned) {
      options.facet_edge_m =
          std::min(calibration_.fine.facet_edge_m * std::sqrt(calibration_.free_facets() / patches), wall_m());
      patches = facets_of(options);
    }
    options.target_facets = static_cast<int>(patches);
    options.more_elements = static_cast<std::size_t>((kElementFraction / kPatchFraction - 1.0) * patches);
  }

  /// Shortest side of a room, in the mean; infinite where none is known. Facets longer than that are too few for the
  /// law: of a building with many rooms the calibration meshes are so coarse.
  double wall_m() const {
    double sum = 0;
    for (const RoomPoints& room : calibration_.rooms)
      sum += std::min({room.box.size().x, room.box.size().y, room.box.size().z});
    return sum > 0 ? sum / static_cast<double>(calibration_.rooms.size()) : std::numeric_limits<double>::infinity();
  }

  /// N = N_0 (e_0 / allowed)^(1 / a), the mesh error's power law solved for the facets.
  int choose_facets(double target) const {
    if (request_.facets > 0)
      return request_.facets;
    const double part = calibration_.rooms.size() > 1 ? kMeshPartOfRooms : kMeshPart,
                 more = std::pow(calibration_.mesh_error / (part * target), 1.0 / kCostModel.mesh_exponent);
    return static_cast<int>(std::clamp(more * calibration_.free_facets(), double(kFewestFacets), double(kMostFacets)));
  }

  /// Order 4 where nine coefficients leave much of what the light may err. In constant regions l = 4 doubles the file:
  /// only when it is wanted.
  ShOrder choose_order(double target) const {
    const AuditReport& seen = calibration_.fine.audit;
    const bool much = seen.smooth(&SkyError::band4) > kOrderPart * target ||
                      seen.sun(&SkyError::band4) > kOrderPart * kSunPart * target;
    return fine() && much ? ShOrder::fourth : ShOrder::second;
  }

  /// The coarsest grid whose predicted error stays below its part of the target.
  void choose_grid(double target, BakeOptions& options) const {
    options.grid = request_.grid;
    options.spacing_m = request_.spacing_m;
    if (request_.points.empty() && request_.graded.value_or(options.grid.x == 0 && options.spacing_m == 0)) {
      options.density = calibration_.density;
      if (options.grid.x == 0)
        options.near_surfaces = calibration_.near_surfaces;
    }
    if (options.grid.x > 0 || options.spacing_m > 0 || !request_.points.empty())
      return;
    const glm::dvec3 size = calibration_.bounds.size();
    const double columns = 3 * 1024 * calibration_.stored_fraction,
                 allowed = kGridPart * beside_furniture(options) * target;
    // Steps of 1.5 %: the number of probes jumps where one more fits along an axis.
    for (double spacing = 0.5 * std::max({size.x, size.y, size.z});; spacing /= 1.015) {
      const glm::ivec3 count = grid_size(calibration_.bounds, spacing);
      const double probes = cells(count);
      if (probes > kMostProbes || (!fine() && probes * 27 / 3 * columns * calibration_.air_fraction > kMostFloats))
        return;
      options.spacing_m = spacing;
      if (grid_error(calibration_, mean_spacing(calibration_.bounds, count), options.gather_rays,
                     calibration_.grid_error) <= allowed)
        return;
    }
  }

  /// Before the planes of a grid that was asked for are made.
  Result<void> check_grid(const BakeOptions& options) const {
    if (options.grid.x > 0)
      return check_probe_count(options.grid);
    return options.spacing_m > 0 ? check_probe_count(grid_size(calibration_.bounds, options.spacing_m))
                                 : Result<void>{};
  }

  /// Probes of the grid with light of their own, if all were in the air.
  double probes_of(const BakeOptions& options) const {
    return static_cast<double>(probes_wanted(
        grid_planes(calibration_.bounds, options.grid, options.spacing_m, options.density, options.near_surfaces)));
  }
  /// Planes near surfaces are for what is there: they change nothing between the others.
  double grid_part(const BakeOptions& options, double at_calibration) const {
    const glm::ivec3 count = options.grid.x > 0 ? options.grid : grid_size(calibration_.bounds, options.spacing_m);
    return grid_error(calibration_, mean_spacing(calibration_.bounds, count), options.gather_rays, at_calibration);
  }

  /// Mesh error of `facets`, refined by the elements under a fine sky.
  double mesh_part(const BakeOptions& options, double facets) const {
    const double elements = facets + static_cast<double>(options.more_elements);
    return mesh_error(calibration_, fine() ? equivalent_facets(facets, elements) : facets);
  }

  /// mesh, grid and sky under a small sun, as the root of the sum of squares; 0 where no sun comes in.
  double sun_error(const BakeOptions& options, double sky_sun) const {
    if (calibration_.grid_sun <= 0)
      return 0;
    const double grid = request_.points.empty() ? grid_part(options, calibration_.grid_sun) : 0;
    return std::hypot(mesh_part(options, options.target_facets), std::hypot(grid, sky_sun));
  }

  /// The fewest nodes that meet the target under suns and smooth skies, as far as nodes decide it.
  int choose_nodes(double target, const BakeOptions& options) const {
    const auto sun_with = [&](int nodes) {
      return sun_error(options, sky_errors({static_cast<double>(nodes), true}, options.compact_error).sun);
    };
    const auto smooth_with = [](int nodes) { return kCostModel.node_error * 1024 / nodes; };
    int nodes = kNodes.front();
    for (const int more : kNodes) {
      const bool sun = calibration_.grid_sun > 0 && more <= kNodesAtTwoPercent * 0.02 / target &&
                       sun_with(nodes) > kSunPart * target;
      if (more > nodes && (sun || smooth_with(nodes) > kNodePart * target))
        nodes = more;
    }
    return nodes;
  }

  Result<void> choose_sky(double target, Plan& plan) const {
    plan.precision = target >= 0.005 ? BasisPrecision::float16 : BasisPrecision::float32;
    const double part =
        request_.points.empty() ? kCompactPart * compact_part() * beside_furniture(plan.options) : kCompactPoints;
    plan.options.compact_error = std::clamp(part * target, kMinCompact, kMaxCompact);
    plan.regions = request_.regions;
    if (!plan.regions.empty())
      return check_regions(plan.regions);
    plan.regions = "fine:" + std::to_string(choose_nodes(target, plan.options));
    return {};
  }

  /// Facets that the edge length decides. A fixed edge: as many as the calibration bake has at its edge, by area.
  double facets_of(const BakeOptions& options) const {
    return options.facet_edge_m > 0
               ? calibration_.free_facets() * std::pow(calibration_.fine.facet_edge_m / options.facet_edge_m, 2.0)
               : options.target_facets;
  }

  /// total^2 = mesh^2 + grid^2 + sky^2: the three errors are independent. Seconds and bytes from the counts.
  void predict(Plan& plan) const {
    Prediction& p = plan.predicted;
    const BakeOptions& options = plan.options;
    const SkyKind kind = SkyKind::of(plan.regions);
    const SkyErrors sky = sky_errors(kind, options.compact_error);
    const double facets = facets_of(options);
    p.mesh = mesh_part(options, facets);
    p.sky = sky.smooth;
    const bool grid = request_.points.empty();
    p.grid = grid ? grid_part(options, calibration_.grid_error) : ray_noise(options.gather_rays);
    p.total = std::hypot(p.mesh, std::hypot(p.grid, p.sky));
    p.sun = sun_error(options, sky.sun);
    const double probes =
        grid ? probes_of(options) * calibration_.air_fraction : static_cast<double>(request_.points.size());
    // A fine sky is solved for its clusters, whatever the number of nodes.
    const double columns =
        kind.nodes ? static_cast<double>(options.clusters) : kind.stored(calibration_.stored_fraction);
    const double all = facets + static_cast<double>(calibration_.fixed_facets);
    const BakeWork work{all,
                        probes,
                        columns,
                        static_cast<double>(calibration_.channels),
                        static_cast<double>(options.gather_rays),
                        all + static_cast<double>(options.more_elements),
                        calibration_.seen_fraction,
                        compact_part()};
    p.seconds =
        predicted_seconds(calibration_, work, options.visibility_rays, kind.nodes ? options.compact_error : 0.0);
    p.bytes = predicted_bytes(work, kind, options.compact_error, plan.precision);
  }

  const CalibrationBake& calibration_;
  const PlanRequest& request_;
};

} // namespace

/// The finest plan says what can be reached at all; a target below it is refused with that figure.
Result<Plan> make_plan(const CalibrationBake& calibration, const PlanRequest& request) {
  const Planner planner(calibration, request);
  const double wanted = request.max_error;
  const Result<Plan> finest = planner.plan(kFinest);
  if (!finest)
    return finest.error();
  const double reachable = finest->predicted.total;
  if (!(wanted > 0) || wanted < kFinest || (request.must_reach && wanted < reachable) || !(wanted < 1)) {
    const bool free = request.regions.empty() && request.facets == 0 && request.spacing_m == 0 && request.grid.x == 0;
    return Error{
        ErrorCode::value_invalid,
        fmt::format(
            "no bake of this room can be planned for an error of {:g} %; from {:.2g} to less than 100 % one can",
            100 * wanted, 100 * std::max(reachable * 1.02, kFinest)),
        "--max-error",
        wanted >= 1 ? "give a smaller one"
        : free      ? "give a larger one"
                    : "give a larger one, or leave the number of regions, facets and probes to the plan"};
  }
  return planner.plan(wanted);
}

/// From coarse to fine. Two digits, as --max-error reads them: the same text gives the same bits.
Result<double> error_in_time(const CalibrationBake& calibration, PlanRequest request, double seconds) {
  std::optional<double> fits;
  for (double error = kCoarsest;; error /= kErrorStep) {
    request.max_error = 0.01 * std::stod(fmt::format("{:.2g}", 100 * error));
    const Result<Plan> plan = make_plan(calibration, request);
    if (plan && plan->predicted.seconds <= seconds)
      fits = request.max_error;
    else if (fits)
      return *fits;
    else if (!plan)
      return plan.error();
    else
      return Error{
          ErrorCode::limit_exceeded,
          fmt::format("an error of {:g} % takes about {:.2g} minutes", 100 * kCoarsest, plan->predicted.seconds / 60),
          "--time", "allow more, or ask for less: one room (--inside), points (--points)"};
  }
}

} // namespace daylit::precompute
