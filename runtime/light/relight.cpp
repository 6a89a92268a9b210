#include "runtime/light/relight.h"

#include <algorithm>
#include <atomic>
#include <numbers>

#include <glm/common.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/light/sh_rotation.h"

namespace daylit {

std::vector<TransferVector> rotate_transfer(std::span<const TransferVector> transfer, const glm::mat3& r) {
  std::vector<TransferVector> turned(transfer.size());
  std::transform(transfer.begin(), transfer.end(), turned.begin(),
                 [&](const TransferVector& t) { return rotate9<float>(r, t); });
  return turned;
}

Rgb reflected_radiance(const Sh9Rgb& light, const TransferVector& transfer, const Rgb& reflectance) {
  Rgb sum(0.0f);
  for (int i = 0; i < 9; ++i)
    sum += light[i] * transfer[i];
  return glm::max(reflectance * sum * std::numbers::inv_pi_v<float>, Rgb(0.0f));
}

IndirectLight relight_vertices(const LightFieldSampler& sampler, const LightField& field,
                               std::span<const glm::dvec3> positions, std::span<const TransferVector> world_transfer,
                               std::span<const Rgb> reflectance) {
  IndirectLight light{std::vector<Rgb>(positions.size(), Rgb(0.0f)), 0};
  std::atomic<std::size_t> outside{0};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, positions.size(), 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const auto coefficients = sampler.sample(field, positions[i]);
      if (coefficients)
        light.radiance[i] = reflected_radiance(*coefficients, world_transfer[i], reflectance[i]);
      else
        outside.fetch_add(1, std::memory_order_relaxed);
    }
  });
  light.outside = outside.load();
  return light;
}

} // namespace daylit
