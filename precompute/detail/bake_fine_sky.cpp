#include <algorithm>
#include <numeric>

#include "precompute/detail/bake_stage.h"
#include "precompute/detail/node_sharpening.h"
#include "scene/core/parallel.h"

namespace daylit::precompute::detail {

namespace {

/// What the points see, fitted to probe values where neighbours see each other.
GatherRows gather_rows(const Stage& s) {
  const auto sight = [&s](std::span<const std::uint32_t> some, std::span<Sight> of_patches) {
    std::vector<std::uint8_t> distinguished(of_patches.size(), 0);
    std::vector<std::uint64_t> rays(s.hits.patches(), 0);
    for (const std::uint32_t point : s.fit.needed(some)) {
      s.hits.mark_distinguished(s.points.position[point], distinguished);
      s.hits.count_rays(s.points.position[point], rays);
    }
    for (std::size_t e = 0; e < rays.size(); ++e)
      if (const std::uint32_t patch = s.elements.parent[e]; rays[e] > 0)
        of_patches[patch] = distinguished[patch] != 0 ? Sight::of_elements : Sight::of_patch;
  };
  const auto gather = [&s](std::span<const std::uint32_t> some, std::span<const std::uint32_t> part_end, float* out) {
    const auto one = [&](std::uint32_t point, float* nine_rows) {
      s.hits.weights(s.points.position[point], part_end, nine_rows);
    };
    s.fit.apply(some, 9 * part_end.size(), one, out);
  };
  GatherRows rows_of_points{sight, gather};
  if (s.options.sh_order == ShOrder::fourth)
    rows_of_points.band4_rows = [&s](std::span<const std::uint32_t> some, std::span<const std::uint32_t> part_end,
                                     float* out) {
      for (std::size_t i = 0; i < some.size(); ++i)
        s.hits.weights(s.points.position[some[i]], part_end, out + i * 9 * part_end.size(), radiosity::Bands::fourth);
    };
  return rows_of_points;
}

/// n / A of each patch, [patch][cluster of probes]: n rays of the cluster's points meet it.
radiosity::FirstBounce rays_as_light(const Stage& s, const ProbeClusters& clusters) {
  constexpr auto kRay = static_cast<double>(radiosity::GatherHits::kRay);
  const std::size_t patches = s.problem.patches.patches.size(), columns = clusters.size();
  radiosity::FirstBounce light{.patches = patches,
                               .channels = 1,
                               .region = std::vector<std::int32_t>(columns),
                               .irradiance = std::vector<float>(patches * columns, 0.0f),
                               .opening = std::vector<float>(patches, 0.0f)};
  std::iota(light.region.begin(), light.region.end(), 0);
  parallel_for(std::size_t{0}, columns, [&](std::size_t k) {
    std::vector<std::uint64_t> rays(s.hits.patches(), 0);
    for (const std::uint32_t point : clusters[k])
      s.hits.count_rays(point, rays);
    for (std::size_t e = 0; e < rays.size(); ++e) {
      const std::uint32_t patch = s.elements.parent[e];
      light.row(patch, 0)[k] +=
          static_cast<float>(static_cast<double>(rays[e]) / kRay / s.problem.patches.patches[patch].area_m2);
    }
  });
  return light;
}

/// Patches that a ray of some point meets, and what comes back from each: with n rays of a cluster's points that meet
/// patch i, sum_i n_i B_i = sum_i A_i r_i E_i by reciprocity, r the radiosity under irradiances n / A. Without the
/// first reflection, for grey surfaces.
Result<ProbeSight> probe_sight(const Stage& s, const ProbeClusters& clusters) {
  const radiosity::FirstBounce light = rays_as_light(s, clusters);
  radiosity::PatchSet grey = s.problem.patches;
  for (radiosity::Patch& e : grey.patches)
    e.reflectance = Rgb((e.reflectance.r + e.reflectance.g + e.reflectance.b) / 3.0f);
  const auto sent = radiosity::solve_radiosity(grey, s.exchange, light, {.tolerance = s.options.tolerance}, s.progress);
  if (!sent)
    return sent.error();
  ProbeSight sight{std::vector<std::uint8_t>(light.patches, 0), std::vector<float>(clusters.size() * light.patches)};
  for (std::size_t p = 0; p < light.patches; ++p)
    for (std::size_t k = 0; k < clusters.size(); ++k) {
      const float direct = light.row(p, 0)[k];
      if (direct > 0)
        sight.seen[p] = 1;
      sight.further[k * light.patches + p] = std::max(0.0f, sent->row(p)[k] - grey.patches[p].reflectance.r * direct);
    }
  return sight;
}

/// The element of each source; of those that no probe sees, no corners.
SourceElements elements_of(const Stage& s, const SurfaceLight& light, std::span<const std::uint8_t> seen,
                           const glm::dvec3& origin) {
  SourceElements elements;
  for (std::size_t k = 0; k < light.source.size(); ++k) {
    const std::uint32_t e = light.source[k];
    auto& corner = elements.corner.emplace_back();
    if (seen[s.elements.parent[e]])
      std::ranges::transform(s.elements.patches.patches[e].corner, corner.begin(),
                             [&](const glm::dvec3& c) { return glm::vec3(s.elements.mesh.origin + c - origin); });
    elements.reflectance.push_back(light.reflectance[k]);
  }
  return elements;
}

} // namespace

/// L_lm(probe) = sum over sources of T[lm, source] H_source,k for node k: H is sparse, T is factored per probe cluster.
Result<std::vector<std::uint32_t>> bake_fine_sky(const Stage& s, std::vector<radiosity::FirstBounceRow> rows,
                                                 BasisVolume& volume, BakeReport& report) {
  SurfaceLightReport surfaces;
  sharpen_nodes(volume.partition, rows);
  const ProbeClusters clusters = probe_clusters(volume.probes, s.points.probe, s.fit.part(),
                                                volume.probes.is_grid ? kProbesInCluster : kGivenPointsInCluster);
  const auto sight = probe_sight(s, clusters);
  if (!sight)
    return sight.error();
  const auto light = surface_light(s.problem.patches, s.elements, s.exchange, std::move(rows), *sight,
                                   s.options.clusters, s.solve(), s.progress, surfaces);
  if (!light)
    return light.error();
  report.solve = surfaces.solve;
  report.energy = surfaces.energy;
  s.clock.finish("solve");
  auto compact = compact_sky(*light, gather_rows(s), clusters, s.points.probe, volume.partition,
                             {.error = s.options.compact_error}, s.progress, &report.compact);
  if (!compact)
    return compact.error();
  report.regions_stored = static_cast<int>(report.compact.nodes);
  report.first_bounce.regions_skipped = report.regions - report.regions_stored;
  volume.elements = elements_of(s, *light, sight->seen, volume.probes.origin);
  volume.compact = std::make_shared<const CompactBasis>(std::move(*compact));
  s.clock.finish("fine sky");
  return light->source;
}

} // namespace daylit::precompute::detail
