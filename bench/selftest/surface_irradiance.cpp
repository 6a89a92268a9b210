#include "bench/selftest/surface_irradiance.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"
#include "radiosity/polygon_kernel.h"
#include "scene/core/parallel_stage.h"

namespace daylit::bench {

namespace {

using namespace radiosity; // sampling and kernels

constexpr int kFirst = 16; // one ray packet

/// One packet of rays from the point to the patch; adds their kernel weights (d . n)+ (-d . n_j)+ / |d|^4.
std::uint32_t add_packet(const SurfacePoint& at, const radiosity::Patch& e, const RayScene& scene, int first,
                         const glm::dvec2& shift, double& seen, double& total) {
  RayPacket16 rays;
  double weight[kFirst];
  const double gap = 4.0 * static_cast<double>(scene.surface_offset());
  const glm::vec3 origin = scene.to_local(at.position + gap * at.normal);
  for (int k = 0; k < kFirst; ++k) {
    const glm::dvec3 target = on_triangle(e.corner, r2_point(static_cast<std::uint32_t>(first + k), shift));
    const glm::dvec3 d = target - at.position;
    const double r2 = std::max(glm::dot(d, d), 1e-300);
    weight[k] = std::max(0.0, glm::dot(d, at.normal)) * std::max(0.0, -glm::dot(d, e.normal)) / (r2 * r2);
    const glm::vec3 way = scene.to_local(target) - origin;
    rays.org_x[k] = origin.x;
    rays.org_y[k] = origin.y;
    rays.org_z[k] = origin.z;
    rays.dir_x[k] = way.x;
    rays.dir_y[k] = way.y;
    rays.dir_z[k] = way.z;
    rays.tnear[k] = 0.0f;
    rays.tfar[k] = 1.0f - static_cast<float>(std::min(0.25, gap / std::sqrt(r2)));
  }
  const std::uint32_t blocked = scene.occluded16(rays, kFirst);
  for (int k = 0; k < kFirst; ++k) {
    total += weight[k];
    seen += (blocked >> k) & 1u ? 0.0 : weight[k];
  }
  return blocked;
}

double visibility(const SurfacePoint& at, const radiosity::Patch& e, const RayScene& scene, std::uint64_t seed,
                  int partial_rays) {
  const glm::dvec2 shift = random_shift(seed);
  double seen = 0, total = 0;
  const std::uint32_t blocked = add_packet(at, e, scene, 0, shift, seen, total);
  if (blocked != 0 && blocked != 0xFFFFu)
    for (int first = kFirst; first < partial_rays; first += kFirst)
      add_packet(at, e, scene, first, shift, seen, total);
  return total > 0 ? seen / total : 0.0;
}

/// E = sum_j F_j V_j B_j over the patches in front of the point.
void receive(const SurfacePoint& at, std::uint64_t index, const radiosity::PatchSet& set, const RayScene& scene,
             const radiosity::Radiosity& solved, int partial_rays, float* out) {
  std::vector<double> sum(solved.columns, 0.0);
  for (std::size_t j = 0; j < set.patches.size(); ++j) {
    const radiosity::Patch& e = set.patches[j];
    if (glm::dot(at.position - e.corner[0], e.normal) <= 0.0)
      continue;
    double f = point_to_polygon(at.position, at.normal, e.corner);
    if (f > 0.0)
      f *= visibility(at, e, scene, mix_bits(index * 0x100000001ull + j), partial_rays);
    if (f > 0.0)
      for (std::size_t k = 0; k < solved.columns; ++k)
        sum[k] += f * static_cast<double>(solved.row(j)[k]);
  }
  std::ranges::transform(sum, out, [](double e) { return static_cast<float>(e); });
}

} // namespace

Result<std::vector<float>> surface_irradiance(std::span<const SurfacePoint> points, const radiosity::PatchSet& set,
                                              const RayScene& facets, const radiosity::Radiosity& solved,
                                              const SurfaceOptions& options, const Progress& progress) {
  std::vector<float> result(points.size() * solved.columns, 0.0f);
  const Result<void> done = parallel_stage("surfaces", points.size(), 1, progress, [&](std::size_t p) {
    receive(points[p], p, set, facets, solved, options.partial_rays, result.data() + p * solved.columns);
  });
  if (!done)
    return done.error();
  return result;
}

} // namespace daylit::bench
