#include "precompute/detail/surface_transport.h"

#include <algorithm>

#include "precompute/detail/factors.h"

namespace daylit::precompute::detail {

SurfaceTransport::SurfaceTransport(const SurfaceLight& light) : light_(light) {
  for (std::size_t c = 0; c < 3; ++c) {
    bounced_[c].resize(light.elements * light.clusters);
    for (std::size_t e = 0; e < light.elements; ++e)
      std::copy_n(light.bounced.data() + (e * 3 + c) * light.clusters, light.clusters,
                  bounced_[c].data() + e * light.clusters);
  }
}

std::vector<float> SurfaceTransport::radiosity(int colour, std::span<const float> irradiance,
                                               std::size_t columns) const {
  std::vector<float> mean(light_.clusters * columns, 0.0f);
  for (std::size_t s = 0; s < sources(); ++s)
    for (std::size_t k = 0; k < columns; ++k)
      mean[light_.cluster[s] * columns + k] += light_.share[s] * irradiance[s * columns + k];
  std::vector<float> b =
      multiply(bounced_[static_cast<std::size_t>(colour)], mean, light_.elements, light_.clusters, columns);
  for (std::size_t s = 0; s < sources(); ++s)
    for (std::size_t k = 0; k < columns; ++k)
      b[light_.source[s] * columns + k] += light_.reflectance[s][colour] * irradiance[s * columns + k];
  return b;
}

void SurfaceTransport::add_adjoint(int colour, std::span<const float> weights, std::size_t rows,
                                   std::span<float> result) const {
  const std::vector<float> by_cluster =
      multiply(weights, bounced_[static_cast<std::size_t>(colour)], rows, light_.elements, light_.clusters);
  for (std::size_t r = 0; r < rows; ++r) {
    const float *own = weights.data() + r * light_.elements, *further = by_cluster.data() + r * light_.clusters;
    float* to = result.data() + r * sources();
    for (std::size_t s = 0; s < sources(); ++s)
      to[s] += light_.reflectance[s][colour] * own[light_.source[s]] + light_.share[s] * further[light_.cluster[s]];
  }
}

} // namespace daylit::precompute::detail
