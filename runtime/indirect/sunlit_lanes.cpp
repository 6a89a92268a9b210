#include "runtime/indirect/sunlit_lanes.h"

#include <cmath>
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

/// The closed form of sh::evaluate9(), summed with the transfer vector.
HWY_INLINE float times_nine(const TransferVector& t, float x, float y, float z) {
  constexpr float c0 = 0.28209479f, c1 = 0.48860251f, c2 = 1.09254843f, c20 = 0.31539157f, c22 = 0.54627422f;
  return c0 * t[0] + c1 * (y * t[1] + z * t[2] + x * t[3]) + c2 * (x * y * t[4] + y * z * t[5] + x * z * t[7]) +
         c20 * (3.0f * z * z - 1.0f) * t[6] + c22 * (x * x - y * y) * t[8];
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
