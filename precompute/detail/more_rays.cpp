#include "precompute/detail/more_rays.h"

#include <algorithm>
#include <cmath>

#include "precompute/detail/neighbours.h"
#include "scene/core/parallel.h"

namespace daylit::precompute::detail {

namespace {

constexpr std::size_t kNeighbours = 180; ///< points that are judged together: what a few rays of one miss, others meet
constexpr double kNoise = 0.02;          ///< of the mean radiance of a point, that its rays may err by
constexpr double kMostFans = 16;

} // namespace

/// One column, the mean reflectance in all channels: they are solved as one.
Result<std::vector<float>> grey_radiosity(const radiosity::PatchSet& patches, const LightElements& elements,
                                          const radiosity::ExchangeMatrix& exchange, std::vector<float> light,
                                          const radiosity::SolveOptions& options, const Progress& progress) {
  radiosity::PatchSet grey = patches;
  for (radiosity::Patch& e : grey.patches)
    e.reflectance = Rgb((e.reflectance.r + e.reflectance.g + e.reflectance.b) / 3.0f);
  const std::size_t count = light.size();
  const radiosity::FirstBounce direct{.patches = count,
                                      .channels = 1,
                                      .region = {0},
                                      .irradiance = std::move(light),
                                      .opening = std::vector<float>(count, 0.0f)};
  const radiosity::FirstBounce of_parents = elements.of_parents(direct);
  const auto solved = radiosity::solve_radiosity(grey, exchange, of_parents, options, progress);
  if (!solved)
    return solved.error();
  const radiosity::Radiosity sent = elements.radiosity_of(*solved, of_parents, direct);
  std::vector<float> mean(count);
  for (std::size_t e = 0; e < count; ++e)
    mean[e] = (sent.row(e)[0] + sent.row(e)[1] + sent.row(e)[2]) / 3.0f;
  return mean;
}

/// The mean B of a point errs by sqrt(v / N) / B of itself, v: variance of its N rays. N <= kNoise^-2 v / B^2, in the
/// mean over neighbouring points.
std::vector<std::uint16_t> more_rays(const radiosity::GatherHits& hits, std::span<const glm::dvec3> at,
                                     std::span<const float> radiosity, int rays) {
  const auto groups = neighbours(std::vector<glm::vec3>(at.begin(), at.end()), {}, kNeighbours);
  std::vector<std::uint16_t> more(at.size(), 0);
  parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
    double variance = 0;
    for (const std::uint32_t p : groups[g]) {
      const auto [mean, of_ray] = hits.moments(p, radiosity);
      variance += mean > 0 ? of_ray / (mean * mean) : 0.0;
    }
    variance /= static_cast<double>(groups[g].size());
    const double fans = std::ceil(variance / (kNoise * kNoise * rays));
    for (const std::uint32_t p : groups[g])
      more[p] = static_cast<std::uint16_t>(std::clamp(fans, 1.0, kMostFans) - 1.0);
  });
  return more;
}

} // namespace daylit::precompute::detail
