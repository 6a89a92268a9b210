#include <numeric>

#include "precompute/detail/bake_stage.h"
#include "precompute/detail/neighbours.h"

namespace daylit::precompute::detail {

namespace {

/// [point][coefficient][channel * regions + region] -> [region][probe][coefficient][channel]
std::vector<float> rows_of(const std::vector<float>& coefficients, const std::vector<std::size_t>& probe_of_point,
                           std::size_t regions, const BasisVolume& volume) {
  std::vector<float> basis(regions * volume.row_floats(), 0.0f);
  for (std::size_t p = 0; p < probe_of_point.size(); ++p)
    for (std::size_t l = 0; l < 9; ++l)
      for (std::size_t c = 0; c < 3; ++c) {
        const float* from = coefficients.data() + ((p * 9 + l) * 3 + c) * regions;
        float* to = basis.data() + probe_of_point[p] * 27 + l * 3 + c;
        for (std::size_t r = 0; r < regions; ++r)
          to[r * volume.row_floats()] = from[r];
      }
  return basis;
}

/// All regions of the sky at once, for the audit when no region is solved by itself.
radiosity::FirstBounce whole_sky(const radiosity::FirstBounce& light) {
  radiosity::FirstBounce one{
      .patches = light.patches, .channels = light.channels, .region = {0}, .irradiance = {}, .opening = light.opening};
  for (std::size_t i = 0; i < light.patches; ++i)
    for (int c = 0; c < light.channels; ++c)
      one.irradiance.push_back(
          static_cast<float>(std::accumulate(light.row(i, c), light.row(i, c) + light.columns(), 0.0)));
  return one;
}

/// Of the area that the sky lights, what a few neighbouring points meet, in the mean over the points.
double seen_fraction(const Stage& s, const radiosity::FirstBounce& light) {
  constexpr std::size_t kNeighbours = 32;
  double lit = 0, seen = 0;
  const auto area = [&](std::size_t patch) {
    return light.opening[patch] > 0.0f ? s.problem.patches.patches[patch].area_m2 : 0.0;
  };
  for (std::size_t e = 0; e < light.patches; ++e)
    lit += area(e);
  const std::vector<glm::vec3> at(s.points.at.begin(), s.points.at.end());
  for (const std::vector<std::uint32_t>& some : neighbours(at, {}, kNeighbours)) {
    std::vector<std::uint64_t> rays(light.patches, 0);
    for (const std::uint32_t point : some)
      s.hits.count_rays(point, rays);
    for (std::size_t e = 0; e < light.patches; ++e)
      seen += rays[e] > 0 ? area(e) * static_cast<double>(some.size()) : 0.0;
  }
  return lit > 0 && !at.empty() ? seen / lit / static_cast<double>(at.size()) : 1.0;
}

} // namespace

/// Forward: B = (I - rho F)^-1 rho H, then L_lm = w . B. Adjoint, where 9 points < columns: L_lm = h . H. The same
/// bilinear form either way.
Result<void> bake_regions(const Stage& s, const radiosity::FirstBounce& light, BasisVolume& volume,
                          BakeReport& report) {
  report.seen_fraction = seen_fraction(s, light);
  report.adjoint = 9 * s.points.at.size() < light.columns();
  const radiosity::FirstBounce driving = report.adjoint ? whole_sky(light) : radiosity::FirstBounce{};
  const radiosity::FirstBounce& forward = report.adjoint ? driving : light;
  const auto radiosity =
      radiosity::solve_radiosity(s.problem.patches, s.exchange, forward, s.solve(), s.progress, &report.solve);
  if (!radiosity)
    return radiosity.error();
  report.energy = radiosity::audit_energy(s.problem.patches, s.exchange, forward, *radiosity, &report.closure);
  s.clock.finish("solve");
  volume.stored_region = light.region;
  for (const radiosity::Bands bands : {radiosity::Bands::low, radiosity::Bands::fourth}) {
    const bool low = bands == radiosity::Bands::low;
    if (!low && s.options.sh_order == ShOrder::second)
      continue;
    auto coefficients =
        report.adjoint ? radiosity::adjoint_coefficients(s.hits, s.problem.patches, s.exchange, light, s.solve(bands),
                                                         s.progress, low ? &report.solve : nullptr, bands)
                       : radiosity::gather_coefficients(s.hits, *radiosity, s.progress, bands);
    if (!coefficients)
      return coefficients.error();
    std::vector<float> of_probes = s.points.spread(std::move(*coefficients));
    if (low) // in a fine sky the fit would gather twice as much for the small part that l = 4 has in irradiance
      s.fit.apply(of_probes, 27 * light.columns());
    (low ? volume.basis : volume.band4) = rows_of(of_probes, s.points.probe, light.columns(), volume);
  }
  s.clock.finish("volume");
  return {};
}

} // namespace daylit::precompute::detail
