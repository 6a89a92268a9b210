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
constexpr double kOwnRays = 4;      ///< that a member of a group is expected to meet, to count by itself

glm::vec3 turned(const glm::vec3& d, const glm::vec2& turn) {
  return {d.x * turn.x - d.y * turn.y, d.x * turn.y + d.y * turn.x, d.z};
}

} // namespace

/// The tables of the whole faces first; what they do not know by the hierarchy of facets.
void GatherHits::trace(std::size_t point, std::span<std::int32_t> met) const {
  std::ranges::fill(met, WholeFaces::kUnknown);
  if (faces_)
    faces_->trace(points_[point], rays_in_groups_, turn_of(point), met);
  trace_facets(point, met);
}

void GatherHits::trace_facets(std::size_t point, std::span<std::int32_t> met) const {
  const glm::vec2 turn = turn_of(point);
  const glm::vec3 origin = scene_->to_local(points_[point]);
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
                               std::size_t most_kept_rays) {
  GatherHits hits;
  hits.set_ = &set;
  hits.mesh_ = &mesh;
  hits.scene_ = &facets;
  hits.faces_ = options.faces && !options.faces->empty() ? options.faces : nullptr;
  hits.points_.assign(points.begin(), points.end());
  hits.rays_ = static_cast<std::size_t>(options.rays);
  hits.fan_ = RayFan::of(options.rays);
  hits.rays_in_groups_ = RayGroups::of(hits.fan_.direction);
  hits.groups_ = GatherHits::groups_of(set, options.group);
  const std::size_t kept = std::min(points.size(), most_kept_rays / hits.rays_);
  hits.patch_.resize(kept * hits.rays_);
  const Result<void> traced = parallel_stage("rays", kept, kReport, progress, [&](std::size_t p) {
    hits.trace(p, std::span(hits.patch_).subspan(p * hits.rays_, hits.rays_));
  });
  if (!traced)
    return traced.error();
  return hits;
}

/// Runs of equal group: area-weighted middle, common normal, mean area of the members.
std::vector<GatherHits::Group> GatherHits::groups_of(const PatchSet& set, std::span<const std::uint32_t> group) {
  std::vector<Group> groups;
  for (std::uint32_t first = 0, end = 0; first < group.size(); first = end) {
    Group g{group[first], first, first, glm::dvec3(0.0), set.patches[first].normal, 0.0};
    for (; end < group.size() && group[end] == group[first]; ++end) {
      const Patch& e = set.patches[end];
      g.middle += e.area_m2 * (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
      g.member_m2 += e.area_m2;
    }
    g.end = end;
    g.middle /= g.member_m2;
    g.member_m2 /= end - first;
    if (end - first > 1)
      groups.push_back(g);
  }
  return groups;
}

/// A member of area A at distance r is expected to meet N A cos / (4 pi r^2) of the N rays: at least kOwnRays.
bool GatherHits::distinguishes(const glm::dvec3& point, const Group& g) const {
  const glm::dvec3 way = point - g.middle;
  const double distance2 = glm::dot(way, way), own_sr = kOwnRays * 4.0 * std::numbers::pi / static_cast<double>(rays_);
  return g.member_m2 * std::abs(glm::dot(way, g.normal)) > own_sr * distance2 * std::sqrt(distance2);
}

std::span<const std::int32_t> GatherHits::met(std::size_t point, std::vector<std::int32_t>& again) const {
  if ((point + 1) * rays_ <= patch_.size())
    return std::span(patch_).subspan(point * rays_, rays_);
  again.resize(rays_);
  trace(point, again);
  return again;
}

void GatherHits::mark_seen(std::size_t point, std::span<std::uint8_t> patches) const {
  std::vector<std::int32_t> again;
  for (const std::int32_t patch : met(point, again))
    if (patch >= 0)
      std::atomic_ref(patches[static_cast<std::size_t>(patch)]).store(1, std::memory_order_relaxed);
}

void GatherHits::mark_distinguished(std::size_t point, std::span<std::uint8_t> groups) const {
  for (const Group& g : groups_)
    if (distinguishes(points_[point], g))
      groups[g.group] = 1;
}

/// The sums of a group that is not distinguished go to its members in proportion to their areas.
void GatherHits::divide_by_area(const glm::dvec3& point, std::span<const std::uint32_t> aggregate_of,
                                std::vector<float>& sum) const {
  for (const Group& g : groups_) {
    const std::size_t count = g.end - g.first;
    if (aggregate_of[g.first] == aggregate_of[g.end - 1] || distinguishes(point, g))
      continue;
    std::array<float, RayFan::kStride> all{};
    float* of_group = sum.data() + aggregate_of[g.first] * RayFan::kStride; // every patch is an aggregate
    for (std::size_t k = 0; k < count; ++k)
      for (std::size_t l = 0; l < RayFan::kStride; ++l)
        all[l] += of_group[k * RayFan::kStride + l];
    for (std::size_t k = 0; k < count; ++k) {
      const auto fraction = static_cast<float>(set_->patches[g.first + k].area_m2 / (g.member_m2 * (g.end - g.first)));
      for (std::size_t l = 0; l < RayFan::kStride; ++l)
        of_group[k * RayFan::kStride + l] = fraction * all[l];
    }
  }
}

/// Of kept hits, or of rays that are traced again.
std::vector<float> GatherHits::sums(std::size_t point, std::span<const std::uint32_t> aggregate_of,
                                    std::size_t aggregates, Bands bands) const {
  std::vector<std::int32_t> again;
  std::vector<float> sum(aggregates * RayFan::kStride, 0.0f);
  add_harmonics(met(point, again), aggregate_of, fan_.of(bands).data(), sum.data());
  divide_by_area(points_[point], aggregate_of, sum);
  return sum;
}

void GatherHits::weights(std::size_t point, float* nine_rows, Bands bands) const {
  std::vector<std::uint32_t> end(patches());
  std::iota(end.begin(), end.end(), 1u);
  weights(point, end, nine_rows, bands);
}

/// weights[lm][j] = (4 pi / N) sum over the rays w that meet j of Y_lm(w) / pi: Monte Carlo integral of L_lm with
/// L = B / pi (Grosch et al. 2007, eq. 2).
void GatherHits::weights(std::size_t point, std::span<const std::uint32_t> aggregate_end, float* nine_rows,
                         Bands bands) const {
  std::vector<std::uint32_t> aggregate_of(patches());
  for (std::uint32_t k = 0, e = 0; k < aggregate_end.size(); ++k)
    for (; e < aggregate_end[k]; ++e)
      aggregate_of[e] = k;
  const std::vector<float> sum = sums(point, aggregate_of, aggregate_end.size(), bands);
  const glm::vec2 turn = turn_of(point);
  for (std::size_t k = 0; k < aggregate_end.size(); ++k)
    turn_harmonics(sum.data() + k * RayFan::kStride, turn, aggregate_end.size(), bands, nine_rows + k);
}

} // namespace daylit::radiosity
