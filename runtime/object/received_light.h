#pragma once

#include <span>
#include <vector>

#include "runtime/sky/direct_light.h"

namespace daylit {

/// Many directional lights, for the irradiance of many normals.
class ReceivedLight {
public:
  static constexpr int kLanes = 16;
  /// Sixteen lights side by side; those beyond the last are black.
  struct alignas(64) Lights {
    float x[kLanes] = {}, y[kLanes] = {}, z[kLanes] = {}, irradiance[3][kLanes] = {};
  };

  explicit ReceivedLight(std::span<const DirectionalLight> lights);
  /// E(n) = sum_j E_j max(0, n.w_j), n a unit normal.
  Rgb irradiance(const glm::vec3& n) const;

private:
  std::vector<Lights> lights_;
};

} // namespace daylit
