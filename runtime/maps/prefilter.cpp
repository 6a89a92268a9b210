#include "runtime/maps/prefilter.h"

#include <bit>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "runtime/maps/detail/prefilter_methods.h"
#include "scene/core/parallel.h"

namespace daylit {
namespace {

Result<void> check(std::span<const Lobe> lobes, double tolerance) {
  constexpr const char* where = "prefilter";
  for (const Lobe& lobe : lobes) {
    if (!(lobe.exponent >= 1.0 && lobe.exponent <= kMaxExponent))
      return Error{ErrorCode::value_invalid, "an exponent of " + std::to_string(lobe.exponent), where,
                   "use 1 (irradiance) to 100000"};
    if (lobe.side < 4 || lobe.side > kMaxMapSide || !std::has_single_bit(static_cast<unsigned>(lobe.side)))
      return Error{ErrorCode::value_invalid, "a blurred map of side " + std::to_string(lobe.side), where,
                   "use a power of two from 4 to " + std::to_string(kMaxMapSide)};
  }
  if (!(tolerance >= 1e-7 && tolerance <= 0.1))
    return Error{ErrorCode::value_invalid, "a tolerance of " + std::to_string(tolerance), where, "use 1e-7 to 0.1"};
  return {};
}

} // namespace

Result<std::vector<RadianceMap>> prefilter(const RadianceMap& source, std::span<const Lobe> lobes,
                                           PrefilterMethod method, const PrefilterOptions& options) {
  if (const auto ok = check(lobes, options.tolerance); !ok)
    return ok.error();
  if (const auto ok = check_map(source, "prefilter"); !ok)
    return ok.error();
  std::vector<RadianceMap> maps;
  for (const Lobe& lobe : lobes)
    maps.emplace_back(lobe.side);
  const detail::PrefilterJob job{source, lobes, options, maps};
  switch (method) {
  case PrefilterMethod::exact:
    detail::exact_lobes(job);
    break;
  case PrefilterMethod::mip_chain:
    detail::mip_lobes(job);
    break;
  case PrefilterMethod::harmonics:
    detail::harmonic_lobes(job);
    break;
  }
  if (options.stop.stop_requested())
    return Error{ErrorCode::interrupted, "stopped", "prefilter", ""};
  return maps;
}

std::vector<glm::dvec3> plain_prefilter(const RadianceMap& source, double exponent,
                                        std::span<const glm::dvec3> directions) {
  std::vector<glm::dvec3> texels, means(directions.size());
  for (std::size_t i = 0; i < source.radiance.size(); ++i)
    texels.push_back(source.direction(i));
  parallel_for(std::size_t(0), directions.size(), [&](std::size_t k) {
    glm::dvec4 sum(0.0);
    for (std::size_t i = 0; i < texels.size(); ++i)
      if (const double cosine = glm::dot(texels[i], directions[k]); cosine > 0.0)
        sum += std::pow(cosine, exponent) * glm::dvec4(glm::dvec3(source.radiance[i]), 1.0);
    means[k] = glm::dvec3(sum) / sum.w;
  });
  return means;
}

} // namespace daylit
