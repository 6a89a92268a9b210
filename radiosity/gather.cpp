#include "radiosity/gather.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>

#include "scene/core/parallel_stage.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kReport = 32; ///< points between reports of progress
constexpr double kOwnRays = 4;      ///< that members of a group are expected to meet together, to be told from others
constexpr std::size_t kRuns = 4;    ///< of a group that are told apart: fewer, and it counts as one

glm::vec3 turned(const glm::vec3& d, const glm::vec2& turn) {
  return {d.x * turn.x - d.y * turn.y, d.x * turn.y + d.y * turn.x, d.z};
}

} // namespace

/// The tables of the whole faces first; what they do not know by the hierarchy of facets.
void GatherHits::trace(std::size_t fan, std::span<std::int32_t> met) const {
  std::ranges::fill(met, WholeFaces::kUnknown);
  if (faces_)
    faces_->trace(origin_[fan], rays_in_groups_, turn_[fan], met);
  trace_facets(fan, met);
  drop_covered(fan, met);
}

/// Aimed rays stand for those of the fan in the solid angles of their holes.
void GatherHits::drop_covered(std::size_t fan, std::span<std::int32_t> met) const {
  if (aimed_.empty() || aimed_[point_of(fan)].hole.empty())
    return;
  const AimedRays& aimed = aimed_[point_of(fan)];
  for (std::size_t k = 0; k < met.size(); ++k)
    if (met[k] >= 0 && aimed.covers(turned(fan_.direction[k], turn_[fan])))
      met[k] = -1;
}

std::int32_t GatherHits::met_along(const glm::dvec3& origin, const glm::vec3& direction) const {
  RayHit hit;
  return scene_->closest(scene_->to_local(origin), direction, 0.0f, std::numeric_limits<float>::infinity(), hit)
             ? set_->hit(*mesh_, hit.triangle, direction)
             : -1;
}

void GatherHits::trace_facets(std::size_t fan, std::span<std::int32_t> met) const {
  const glm::vec2 turn = turn_[fan];
  const glm::vec3 origin = scene_->to_local(origin_[fan]);
  RayPacket16 packet;
  std::array<std::uint32_t, 16> facet;
  std::array<std::size_t, 16> ray;
  std::size_t count = 0;
  const auto shoot = [&] {
    const std::uint32_t hit = scene_->closest16(packet, static_cast<int>(count), facet);
    for (std::size_t k = 0; k < count; ++k)
      met[ray[k]] = (hit >> k & 1u) != 0 ? set_->hit(*mesh_, facet[k], packet.direction(k)) : -1;
    count = 0;
  };
  for (std::size_t k = 0; k < met.size(); ++k) {
    if (met[k] != WholeFaces::kUnknown)
      continue;
    packet.set(count, origin, turned(fan_.direction[k], turn), 0.0f, std::numeric_limits<float>::infinity());
    ray[count] = k;
    if (++count == 16)
      shoot();
  }
  if (count > 0)
    shoot();
}

Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const PatchSet& set, const SurfaceMesh& mesh,
                               const RayScene& facets, const GatherOptions& options, const Progress& progress,
                               std::size_t most_kept_bytes) {
  GatherHits hits;
  hits.set_ = &set;
  hits.mesh_ = &mesh;
  hits.scene_ = &facets;
  hits.faces_ = options.faces && !options.faces->empty() ? options.faces : nullptr;
  hits.points_ = points.size();
  hits.origin_.assign(points.begin(), points.end());
  for (std::size_t p = 0; p < points.size(); ++p)
    hits.turn_.push_back(turn_of(p));
  hits.most_kept_bytes_ = most_kept_bytes;
  hits.patch_ = PatchNumbers(set.patches.size());
  hits.rays_ = static_cast<std::size_t>(options.rays);
  hits.fan_ = RayFan::of(options.rays);
  hits.rays_in_groups_ = RayGroups::of(hits.fan_.direction);
  hits.groups_ = GatherHits::groups_of(set, options.group);
  if (const Result<void> kept = hits.keep_fans(progress); !kept)
    return kept.error();
  return hits;
}

/// Traces those that are not kept yet, as many as may be.
Result<void> GatherHits::keep_fans(const Progress& progress) {
  const std::size_t first = patch_.size() / rays_,
                    kept = most_kept_bytes_ / PatchNumbers::bytes_each(patches()) / rays_,
                    end = std::max(first, std::min(origin_.size(), kept));
  patch_.resize(end * rays_);
  return parallel_stage("rays", end - first, kReport, progress, [&](std::size_t k) {
    std::vector<std::int32_t> met(rays_);
    trace(first + k, met);
    patch_.put((first + k) * rays_, met);
  });
}

/// Kept where the mean radiosity of the holes' directions is above that of all.
Result<void> GatherHits::aim_at(std::span<const HoleOutline> holes, std::span<const float> radiosity,
                                const Progress& progress) {
  if (holes.empty())
    return {};
  std::vector<AimedRays> made(points_);
  const auto aim = [&](std::size_t p) {
    const glm::vec3 from = scene_->to_local(origin_[p]);
    AimedRays aimed = AimedRays::of(origin_[p], holes, static_cast<int>(rays_),
                                    [&](const glm::vec3& way) { return !scene_->occluded(from, way, 0.0f, 0.999f); });
    if (aimed.ray.empty())
      return;
    double solid_angle_sr = 0;
    for (AimedRay& ray : aimed.ray) {
      ray.patch = met_along(origin_[p], ray.direction);
      solid_angle_sr += static_cast<double>(ray.solid_angle_sr);
    }
    if (aimed.light(radiosity) > solid_angle_sr * moments(p, radiosity)[0])
      made[p] = std::move(aimed);
  };
  const Result<void> done = parallel_stage("rays", points_, kReport, progress, aim);
  aimed_ = std::move(made);
  const std::size_t kept = patch_.size() / rays_;
  parallel_for(std::size_t{0}, kept, [&](std::size_t fan) {
    std::vector<std::int32_t> seen = met(fan);
    drop_covered(fan, seen);
    patch_.put(fan * rays_, seen);
  });
  return done;
}

/// Fan k of n: turned by 2 pi k / n from the first one, so that all rays together are a lattice again.
Result<void> GatherHits::add_rays(std::span<const std::uint16_t> more, const Progress& progress) {
  for (std::size_t p = 0; p < points_; ++p) {
    first_more_.push_back(origin_.size());
    origin_.insert(origin_.end(), more[p], glm::dvec3(origin_[p]));
    for (std::size_t k = 1; k <= more[p]; ++k) {
      const auto angle = static_cast<float>(2.0 * std::numbers::pi * static_cast<double>(k) / (more[p] + 1));
      turn_.push_back(turned(glm::vec3(turn_[p], 0.0f), {std::cos(angle), std::sin(angle)}));
    }
  }
  first_more_.push_back(origin_.size());
  return keep_fans(progress);
}

std::size_t GatherHits::fans_of(std::size_t point) const {
  return first_more_.empty() ? 1 : 1 + first_more_[point + 1] - first_more_[point];
}

std::size_t GatherHits::point_of(std::size_t fan) const {
  if (fan < points_)
    return fan;
  return static_cast<std::size_t>(std::ranges::upper_bound(first_more_, fan) - first_more_.begin()) - 1;
}

template <class Visit>
void GatherHits::for_each_fan(std::size_t point, const Visit& visit) const {
  visit(point);
  for (std::size_t k = 1; k < fans_of(point); ++k)
    visit(first_more_[point] + k - 1);
}

/// m = sum over the fans' rays of B / N, s = that of B^2 / N, a = sum over the aimed ones of B dw / 4 pi: m + a, s -
/// m^2.
std::array<double, 2> GatherHits::moments(std::size_t point, std::span<const float> radiosity) const {
  std::array<double, 2> sum{};
  for_each_fan(point, [&](std::size_t fan) {
    for (const std::int32_t patch : met(fan))
      if (patch >= 0) {
        const auto b = static_cast<double>(radiosity[static_cast<std::size_t>(patch)]);
        sum[0] += b;
        sum[1] += b * b;
      }
  });
  const auto rays = static_cast<double>(rays_ * fans_of(point));
  const double aimed = aimed_.empty() ? 0.0 : aimed_[point].light(radiosity);
  const double mean = sum[0] / rays;
  return {mean + aimed / (4.0 * std::numbers::pi), std::max(0.0, sum[1] / rays - mean * mean)};
}

/// Runs of equal group: area-weighted middle, common normal, mean area of the members.
std::vector<GatherHits::Group> GatherHits::groups_of(const PatchSet& set, std::span<const std::uint32_t> group) {
  std::vector<Group> groups;
  for (std::uint32_t first = 0, end = 0; first < group.size(); first = end) {
    Group g{group[first], first, first, glm::dvec3(0.0), set.patches[first].normal, 0.0, 0.0};
    for (; end < group.size() && group[end] == group[first]; ++end) {
      const Patch& e = set.patches[end];
      g.middle += e.area_m2 * e.middle();
      g.member_m2 += e.area_m2;
    }
    g.end = end;
    g.middle /= g.member_m2;
    g.member_m2 /= end - first;
    for (std::uint32_t k = first; k < end; ++k)
      g.radius = std::max(g.radius, glm::distance(set.patches[k].middle(), g.middle));
    if (end - first > 1)
      groups.push_back(g);
  }
  return groups;
}

/// n members of area A at distance r are expected to meet N n A cos / (4 pi r^2) of the N rays: at least kOwnRays of
/// those that meet the most.
std::size_t GatherHits::members_together(const glm::dvec3& point, const Group& g) const {
  const double own_sr = kOwnRays * 4.0 * std::numbers::pi / static_cast<double>(rays_),
               height = std::abs(glm::dot(point - g.middle, g.normal));
  const auto members = [&](double r) { return own_sr * r * r * r / (height * g.member_m2); };
  const std::size_t count = g.end - g.first;
  const double nearest = std::max(glm::distance(point, g.middle) - g.radius, height);
  if (!(members(nearest) < static_cast<double>(count / 2)))
    return count;
  double fewest = std::numeric_limits<double>::infinity();
  for (std::uint32_t k = g.first; k < g.end; ++k)
    fewest = std::min(fewest, members(glm::distance(point, set_->patches[k].middle())));
  std::size_t run = 1;
  while (run < count && static_cast<double>(run) <= fewest)
    run *= 2;
  return std::min(run, count);
}

std::vector<std::int32_t> GatherHits::met(std::size_t fan) const {
  std::vector<std::int32_t> seen(rays_);
  if ((fan + 1) * rays_ <= patch_.size())
    patch_.get(fan * rays_, seen);
  else
    trace(fan, seen);
  return seen;
}

void GatherHits::count_rays(std::size_t point, std::span<std::uint64_t> rays) const {
  const auto add = [&](std::int32_t patch, std::uint64_t count) {
    if (patch >= 0)
      std::atomic_ref(rays[static_cast<std::size_t>(patch)]).fetch_add(count, std::memory_order_relaxed);
  };
  for_each_fan(point, [&](std::size_t fan) {
    for (const std::int32_t patch : met(fan))
      add(patch, kRay);
  });
  if (aimed_.empty())
    return;
  const double per_sr = static_cast<double>(kRay * rays_ * fans_of(point)) / (4.0 * std::numbers::pi);
  for (const AimedRay& ray : aimed_[point].ray)
    add(ray.patch, static_cast<std::uint64_t>(1.0 + per_sr * static_cast<double>(ray.solid_angle_sr)));
}

/// A group of which fewer than kRuns runs are told apart counts as one.
void GatherHits::mark_distinguished(std::size_t point, std::span<std::uint8_t> groups) const {
  for (const Group& g : groups_)
    if (const std::size_t run = members_together(origin_[point], g); run == 1 || kRuns * run <= g.end - g.first)
      groups[g.group] = 1;
}

/// The sums of a run that is not told apart go to its members in proportion to their areas.
void GatherHits::divide_by_area(const glm::dvec3& point, std::span<const std::uint32_t> aggregate_of,
                                std::vector<float>& sum) const {
  for (const Group& g : groups_) {
    if (aggregate_of[g.first] == aggregate_of[g.end - 1])
      continue;
    const auto run = static_cast<std::uint32_t>(members_together(point, g));
    for (std::uint32_t first = g.first; run > 1 && first < g.end; first += run) {
      const std::uint32_t end = std::min(first + run, g.end);
      std::array<float, RayFan::kStride> all{};
      double area_m2 = 0;
      const auto of = [&](std::uint32_t k) { return sum.data() + aggregate_of[k] * RayFan::kStride; };
      for (std::uint32_t k = first; k < end; ++k) {
        area_m2 += set_->patches[k].area_m2;
        for (std::size_t l = 0; l < RayFan::kStride; ++l)
          all[l] += of(k)[l];
      }
      for (std::uint32_t k = first; k < end; ++k)
        for (std::size_t l = 0; l < RayFan::kStride; ++l)
          of(k)[l] = static_cast<float>(set_->patches[k].area_m2 / area_m2) * all[l];
    }
  }
}

/// Of kept hits, or of rays that are traced again.
std::vector<float> GatherHits::sums(std::size_t fan, std::span<const std::uint32_t> aggregate_of,
                                    std::size_t aggregates, Bands bands) const {
  std::vector<float> sum(aggregates * RayFan::kStride, 0.0f);
  const std::vector<float> axes = bands == Bands::axes ? fan_.axes(turn_[fan]) : std::vector<float>{};
  add_harmonics(met(fan), aggregate_of, (axes.empty() ? fan_.of(bands) : axes).data(), sum.data());
  divide_by_area(origin_[fan], aggregate_of, sum);
  return sum;
}

void GatherHits::weights(std::size_t point, float* nine_rows, Bands bands) const {
  std::vector<std::uint32_t> end(patches());
  std::iota(end.begin(), end.end(), 1u);
  weights(point, end, nine_rows, bands);
}

/// weights[lm][j] = (4 pi / N) sum over the rays w that meet j of Y_lm(w) / pi: Monte Carlo integral of L_lm with
/// L = B / pi (Grosch et al. 2007, eq. 2); the mean over the point's fans.
void GatherHits::weights(std::size_t point, std::span<const std::uint32_t> aggregate_end, float* nine_rows,
                         Bands bands) const {
  std::vector<std::uint32_t> aggregate_of(patches());
  for (std::uint32_t k = 0, e = 0; k < aggregate_end.size(); ++k)
    for (; e < aggregate_end[k]; ++e)
      aggregate_of[e] = k;
  const std::size_t aggregates = aggregate_end.size(), fans = fans_of(point);
  std::vector<float> of_fan(fans > 1 ? 9 * aggregates : 0);
  for_each_fan(point, [&](std::size_t fan) {
    const std::vector<float> sum = sums(fan, aggregate_of, aggregates, bands);
    float* rows = fan == point ? nine_rows : of_fan.data();
    for (std::size_t k = 0; k < aggregates; ++k)
      turn_harmonics(sum.data() + k * RayFan::kStride, turn_[fan], aggregates, bands, rows + k);
    for (std::size_t k = 0; fan != point && k < of_fan.size(); ++k)
      nine_rows[k] += of_fan[k];
  });
  for (std::size_t k = 0; k < of_fan.size(); ++k)
    nine_rows[k] /= static_cast<float>(fans);
  if (!aimed_.empty())
    aimed_[point].add_harmonics(aggregate_of, aggregates, bands, nine_rows);
}

} // namespace daylit::radiosity
