#include "runtime/indirect/sunlit_lanes.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "sh/sh9.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/indirect/sunlit_lanes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::sunlit::HWY_NAMESPACE {

HWY_INLINE float within01(float x) {
  const float low = x > 0.0f ? x : 0.0f;
  return low < 1.0f ? low : 1.0f;
}

/// cos' / (pi r^2), where r is more than twice the point's reach, and fading in from one reach on; times
/// smoothstep(1/2, 1, distance from what is known / its reach).
HWY_INLINE float weight(const Points& p, const Receiver& to, int k, float dx, float dy, float dz, float r) {
  const float there = -(p.nx[k] * dx + p.ny[k] * dy + p.nz[k] * dz) / r;
  const float ex = p.x[k] - to.known_centre.x, ey = p.y[k] - to.known_centre.y, ez = p.z[k] - to.known_centre.z;
  const float beyond = within01(2.0f * std::sqrt(ex * ex + ey * ey + ez * ez) * to.per_known_reach - 1.0f);
  const float share = within01(r * p.per_reach[k] - 1.0f) * beyond * beyond * (3.0f - 2.0f * beyond);
  return share * (there > 0.0f ? there : 0.0f) / (std::numbers::pi_v<float> * r * r);
}

/// sum_lm Y_lm C_lm
HWY_INLINE float times_nine(const TransferVector& t, float x, float y, float z) {
  const std::array<float, 9> harmonic = sh::evaluate9(x, y, z);
  float sum = 0.0f;
  for (std::size_t i = 0; i < harmonic.size(); ++i)
    sum += harmonic[i] * t[i];
  return sum;
}

void view(const Points& p, const Receiver& to, Views& out) {
  const glm::mat3& m = to.world_from_local;
#pragma omp simd
  for (int k = 0; k < kLanes; ++k) {
    const float dx = p.x[k] - to.position.x, dy = p.y[k] - to.position.y, dz = p.z[k] - to.position.z;
    const float r = std::sqrt(dx * dx + dy * dy + dz * dz + 1e-20f), x = dx / r, y = dy / r, z = dz / r;
    out.weight[k] = weight(p, to, k, dx, dy, dz, r);
    out.x[k] = m[0].x * x + m[0].y * y + m[0].z * z;
    out.y[k] = m[1].x * x + m[1].y * y + m[1].z * z;
    out.z[k] = m[2].x * x + m[2].y * y + m[2].z * z;
    out.coefficients[k] = times_nine(to.transfer, x, y, z);
  }
}

} // namespace daylit::sunlit::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::sunlit {

/// Each call goes to the widest version that the processor runs.
HWY_EXPORT(view);
void view(const Points& points, const Receiver& receiver, Views& views) {
  HWY_DYNAMIC_DISPATCH(view)(points, receiver, views);
}

} // namespace daylit::sunlit
#endif
