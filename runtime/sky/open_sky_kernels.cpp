#include "runtime/sky/open_sky_kernels.h"

#include <cmath>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/sky/open_sky_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::open_sky::HWY_NAMESPACE {

constexpr float kPi = std::numbers::pi_v<float>;

/// atan2 for y >= 0 after Abramowitz & Stegun 4.4.49 (error 2e-8 on |a| <= 1): off by less than 3e-6 radians in float,
/// a thousandth of a texel of the finest map.
HWY_INLINE float upper_angle(float y, float x) {
  const float ax = std::fabs(x), small = ax < y ? ax : y, large = ax < y ? y : ax;
  const float a = small / (large + 1e-30f), s = a * a;
  float p = 0.0028662257f;
  p = p * s - 0.0161657367f;
  p = p * s + 0.0429096138f;
  p = p * s - 0.0752896400f;
  p = p * s + 0.1065626393f;
  p = p * s - 0.1420889944f;
  p = p * s + 0.1999355085f;
  p = p * s - 0.3333314528f;
  const float r = a + a * s * p, steep = 0.5f * kPi - r, upper = ax < y ? steep : r, beyond = kPi - upper;
  return x < 0.0f ? beyond : upper;
}

/// Fresnel slab with all internal reflections (scene/room/glass.h): mean over both polarisations of 2ab / (a^2 + b^2).
HWY_INLINE float slab(float facing, float n, float inverse_n2) {
  const float glass = std::sqrt(1.0f - (1.0f - facing * facing) * inverse_n2 + 1e-12f);
  const float s = n * glass, p = n * facing;
  return facing * s / (facing * facing + s * s + 1e-20f) + p * glass / (p * p + glass * glass + 1e-20f);
}

/// A cell's glass: its slab, or 1 where it has none.
struct Pane {
  float n, has_slab, inverse_n2;
  HWY_INLINE explicit Pane(float index)
      : n(index > 0.0f ? index : 1.0f), has_slab(index > 0.0f ? 1.0f : 0.0f), inverse_n2(1.0f / (n * n)) {}
  HWY_INLINE float transmittance(float facing) const { return 1.0f + has_slab * (slab(facing, n, inverse_n2) - 1.0f); }
};

/// cos_cell cos_receiver A / r^2 x transmittance of the slab: solid angle of the cell times the receiver's cosine, sr.
HWY_INLINE float cell_weight(const CellConstants& c, const Pane& pane, const Receivers& r, int k, float dx, float dy,
                             float dz) {
  const float inverse = 1.0f / std::sqrt(dx * dx + dy * dy + dz * dz + 1e-20f);
  const float f = -(c.inward_x * dx + c.inward_y * dy + c.inward_z * dz) * inverse;
  const float q = (r.nx[k] * dx + r.ny[k] * dy + r.nz[k] * dz) * inverse;
  const float facing = f > 0.0f ? f : 0.0f, receiving = q > 0.0f ? q : 0.0f;
  return facing * receiving * c.area * inverse * inverse * pane.transmittance(facing);
}

/// u = 1/2 - azimuth / 2 pi, v = theta / pi of the direction to the cell, in texels (SkyMap::position()).
void view_cell(const CellConstants& c, const Receivers& r, CellView& view) {
  const Pane pane(c.index);
#pragma omp simd
  for (int k = 0; k < kLanes; ++k) {
    const float dx = c.x - r.x[k], dy = c.y - r.y[k], dz = c.z - r.z[k];
    view.weight[k] = cell_weight(c, pane, r, k, dx, dy, dz);
    view.distance2[k] = dx * dx + dy * dy + dz * dz;
    const float azimuth = upper_angle(std::fabs(dy), dx), turn = dy < 0.0f ? -1.0f : 1.0f;
    view.u[k] = (0.5f - turn * azimuth * (0.5f / kPi)) * c.width - 0.5f;
    view.v[k] = upper_angle(std::sqrt(dx * dx + dy * dy), dz) * (1.0f / kPi) * c.height - 0.5f;
  }
}

/// E += weight x sum_m factor_m (1, x, y, xy, z, xz, yz, xyz)_m. The direction to the cell's middle stands for all of
/// it.
void add_cell(const CellConstants& c, const BoxRadiance& radiance, const BoxPoints& p, float (&sum)[3][kLanes]) {
  const Receivers& r = p.receivers;
  const Pane pane(c.index);
#pragma omp simd
  for (int k = 0; k < kLanes; ++k) {
    const float weight = cell_weight(c, pane, r, k, c.x - r.x[k], c.y - r.y[k], c.z - r.z[k]);
    const float x = p.x[k], y = p.y[k], z = p.z[k], xy = x * y, xz = x * z, yz = y * z, xyz = xy * z;
    for (int channel = 0; channel < 3; ++channel) {
      const float* a = radiance.factor[channel];
      sum[channel][k] +=
          weight * (a[0] + a[1] * x + a[2] * y + a[3] * xy + a[4] * z + a[5] * xz + a[6] * yz + a[7] * xyz);
    }
  }
}

} // namespace daylit::open_sky::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::open_sky {

/// Each call goes to the widest version that the processor runs.
HWY_EXPORT(view_cell);
HWY_EXPORT(add_cell);

CellConstants::CellConstants(const ApertureCell& cell, const SkyMap& map, const glm::dvec3& origin)
    : x(static_cast<float>(cell.centre.x - origin.x)), y(static_cast<float>(cell.centre.y - origin.y)),
      z(static_cast<float>(cell.centre.z - origin.z)), inward_x(static_cast<float>(cell.inward.x)),
      inward_y(static_cast<float>(cell.inward.y)), inward_z(static_cast<float>(cell.inward.z)),
      area(static_cast<float>(cell.area_m2)), index(cell.refractive_index), width(static_cast<float>(map.width)),
      height(static_cast<float>(map.height)) {}

void view_cell(const CellConstants& cell, const Receivers& receivers, CellView& view) {
  HWY_DYNAMIC_DISPATCH(view_cell)(cell, receivers, view);
}
void add_cell(const CellConstants& cell, const BoxRadiance& radiance, const BoxPoints& points,
              float (&sum)[3][kLanes]) {
  HWY_DYNAMIC_DISPATCH(add_cell)(cell, radiance, points, sum);
}

} // namespace daylit::open_sky
#endif
