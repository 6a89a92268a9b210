#include "runtime/object/received_light.h"

#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/object/received_light.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::HWY_NAMESPACE {

/// Adds E_j max(0, n.w_j) of each light to its lane, per channel.
void add_received(const ReceivedLight::Lights* lights, std::size_t count, float nx, float ny, float nz,
                  float (&sum)[3][ReceivedLight::kLanes]) {
  for (const ReceivedLight::Lights* l = lights; l != lights + count; ++l) {
#pragma omp simd
    for (int k = 0; k < ReceivedLight::kLanes; ++k) {
      const float cosine = nx * l->x[k] + ny * l->y[k] + nz * l->z[k], lit = cosine > 0.0f ? cosine : 0.0f;
      sum[0][k] += lit * l->irradiance[0][k];
      sum[1][k] += lit * l->irradiance[1][k];
      sum[2][k] += lit * l->irradiance[2][k];
    }
  }
}

} // namespace daylit::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit {

HWY_EXPORT(add_received);

/// Structure of arrays: one component of sixteen lights in a vector.
ReceivedLight::ReceivedLight(std::span<const DirectionalLight> lights)
    : lights_((lights.size() + kLanes - 1) / kLanes) {
  for (std::size_t j = 0; j < lights.size(); ++j) {
    Lights& l = lights_[j / kLanes];
    const std::size_t k = j % kLanes;
    l.x[k] = static_cast<float>(lights[j].direction.x);
    l.y[k] = static_cast<float>(lights[j].direction.y);
    l.z[k] = static_cast<float>(lights[j].direction.z);
    for (int c = 0; c < 3; ++c)
      l.irradiance[c][k] = lights[j].irradiance[c];
  }
}

/// The sixteen sums of the lanes are added in order: the same bits with every instruction set but for fused steps.
Rgb ReceivedLight::irradiance(const glm::vec3& n) const {
  alignas(64) float sum[3][kLanes] = {};
  HWY_DYNAMIC_DISPATCH(add_received)(lights_.data(), lights_.size(), n.x, n.y, n.z, sum);
  Rgb total(0.0f);
  for (int c = 0; c < 3; ++c)
    total[c] = std::accumulate(sum[c], sum[c] + kLanes, 0.0f);
  return total;
}

} // namespace daylit
#endif
