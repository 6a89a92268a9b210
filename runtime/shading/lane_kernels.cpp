#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/shading/lane_kernels.cpp"
#include <hwy/foreach_target.h> // must come before highway.h
#include <hwy/highway.h>

#include "runtime/shading/lane_kernels.h"

#ifndef DAYLIT_EACH_LANE
// Compiled with -fopenmp-simd, without the run-time library: it keeps the compiler from unrolling into scalars first.
#define DAYLIT_EACH_LANE _Pragma("omp simd") for (int k = 0; k < kLanes; ++k)
#endif

// Plain loops over the lanes: the compiler vectorises them for each instruction set, Highway chooses one.
HWY_BEFORE_NAMESPACE();
namespace daylit::lanes::HWY_NAMESPACE {

LaneMask Receive(const PointBlock& p, const glm::vec3& w, std::span<const Portal> portals, const glm::vec4* planes,
                 LaneRgb& result) {
  alignas(64) float depth[kLanes], crossed[kLanes], cosine[kLanes];
  auto& e = result.channel;
  const float wx = w.x, wy = w.y, wz = w.z;
  DAYLIT_EACH_LANE {
    const float d = p.nx[k] * wx + p.ny[k] * wy + p.nz[k] * wz;
    cosine[k] = d > 0.0f ? d : 0.0f;
    crossed[k] = 0.0f;
    e[0][k] = cosine[k];
    e[1][k] = cosine[k];
    e[2][k] = cosine[k];
  }
  for (const Portal& portal : portals) {
    DAYLIT_EACH_LANE depth[k] = 1.0f; // inside the nearest plane, or less than zero
    for (std::uint32_t i = portal.first_plane; i < portal.last_plane; ++i) {
      const float a = planes[i].x, b = planes[i].y, c = planes[i].z, d = planes[i].w;
      DAYLIT_EACH_LANE {
        const float side = p.x[k] * a + p.y[k] * b + p.z[k] * c + d;
        depth[k] = side < depth[k] ? side : depth[k];
      }
    }
    const float r = portal.transmittance.x, g = portal.transmittance.y, b = portal.transmittance.z;
    DAYLIT_EACH_LANE {
      const float inside = depth[k] >= 0.0f ? 1.0f : 0.0f;
      e[0][k] *= 1.0f + inside * (r - 1.0f);
      e[1][k] *= 1.0f + inside * (g - 1.0f);
      e[2][k] *= 1.0f + inside * (b - 1.0f);
      crossed[k] = inside > crossed[k] ? inside : crossed[k];
    }
  }
  DAYLIT_EACH_LANE {
    e[0][k] *= crossed[k];
    e[1][k] *= crossed[k];
    e[2][k] *= crossed[k];
    cosine[k] *= crossed[k];
  }
  LaneMask lanes = 0;
#pragma omp simd reduction(| : lanes)
  for (int k = 0; k < kLanes; ++k)
    lanes |= cosine[k] > 0.0f ? 1u << k : 0u;
  return lanes;
}

LaneMask Facing(const PointBlock& p, const glm::vec3& w) {
  const float wx = w.x, wy = w.y, wz = w.z;
  LaneMask lanes = 0;
#pragma omp simd reduction(| : lanes)
  for (int k = 0; k < kLanes; ++k)
    lanes |= p.nx[k] * wx + p.ny[k] * wy + p.nz[k] * wz > 0.0f ? 1u << k : 0u;
  return lanes & p.lanes;
}

float SafeInverse(float d) {
  constexpr float kLeast = 1e-12f;
  return 1.0f / (d > kLeast || d < -kLeast ? d : d < 0.0f ? -kLeast : kLeast);
}

LaneMask FacingThroughBox(const PointBlock& p, const glm::vec3& w, const glm::vec3& lo, const glm::vec3& hi) {
  const float wx = w.x, wy = w.y, wz = w.z, ix = SafeInverse(wx), iy = SafeInverse(wy), iz = SafeInverse(wz);
  // Sides that a ray along w enters and leaves by.
  const float in_x = ix > 0 ? lo.x : hi.x, out_x = ix > 0 ? hi.x : lo.x, in_y = iy > 0 ? lo.y : hi.y,
              out_y = iy > 0 ? hi.y : lo.y, in_z = iz > 0 ? lo.z : hi.z, out_z = iz > 0 ? hi.z : lo.z;
  LaneMask lanes = 0;
#pragma omp simd reduction(| : lanes)
  for (int k = 0; k < kLanes; ++k) {
    const float ax = (in_x - p.x[k]) * ix, ay = (in_y - p.y[k]) * iy, az = (in_z - p.z[k]) * iz;
    const float bx = (out_x - p.x[k]) * ix, by = (out_y - p.y[k]) * iy, bz = (out_z - p.z[k]) * iz;
    float enter = ax > ay ? ax : ay, leave = bx < by ? bx : by;
    enter = az > enter ? az : enter;
    leave = bz < leave ? bz : leave;
    enter = enter > 0.0f ? enter : 0.0f;
    const float cosine = p.nx[k] * wx + p.ny[k] * wy + p.nz[k] * wz;
    lanes |= ((leave >= enter) & (cosine > 0.0f)) ? 1u << k : 0u;
  }
  return lanes & p.lanes;
}

FacedLights Faced(const DirectionBlock& w, const glm::vec3& n, const glm::vec3& to_centre, float radius) {
  const float nx = n.x, ny = n.y, nz = n.z, cx = to_centre.x, cy = to_centre.y, cz = to_centre.z;
  const float distance2 = cx * cx + cy * cy + cz * cz, radius2 = radius * radius;
  LaneMask facing = 0, near = 0;
#pragma omp simd reduction(| : facing, near)
  for (int k = 0; k < kLanes; ++k) {
    const float along = cx * w.x[k] + cy * w.y[k] + cz * w.z[k];
    facing |= nx * w.x[k] + ny * w.y[k] + nz * w.z[k] > 0.0f ? 1u << k : 0u;
    near |= ((along > -radius) & (distance2 - along * along < radius2)) ? 1u << k : 0u;
  }
  return {facing, near};
}

void AddLight(LightSums& sums, const Rgb& irradiance, const LaneRgb& e, LaneMask by_room, LaneMask by_any) {
  const float irradiance_of[3] = {irradiance.x, irradiance.y, irradiance.z};
  for (int c = 0; c < 3; ++c) {
    const float whole = irradiance_of[c];
    float *unblocked = sums.unblocked.channel[c], *past_room = sums.past_room.channel[c],
          *past_both = sums.past_both.channel[c];
    const float* fraction = e.channel[c];
    DAYLIT_EACH_LANE {
      const float light = whole * fraction[k];
      unblocked[k] += light;
      past_room[k] += (by_room >> k & 1u) ? 0.0f : light;
      past_both[k] += (by_any >> k & 1u) ? 0.0f : light;
    }
  }
}

void Transpose(const LaneMask* masks, std::size_t count, std::uint64_t* bits) {
  DAYLIT_EACH_LANE bits[k] = 0;
  for (std::size_t j = 0; j < count; ++j) {
    const std::uint64_t mask = masks[j];
    DAYLIT_EACH_LANE bits[k] |= (mask >> k & 1u) << j;
  }
}

void Transform(const glm::mat3& axes, const glm::vec3& origin, const LaneVectors& from, float* to_x, float* to_y,
               float* to_z) {
  const float m00 = axes[0][0], m01 = axes[0][1], m02 = axes[0][2], m10 = axes[1][0], m11 = axes[1][1],
              m12 = axes[1][2], m20 = axes[2][0], m21 = axes[2][1], m22 = axes[2][2];
  const float ox = origin.x, oy = origin.y, oz = origin.z;
  const float *x = from.x, *y = from.y, *z = from.z;
  DAYLIT_EACH_LANE {
    to_x[k] = ox + m00 * x[k] + m10 * y[k] + m20 * z[k];
    to_y[k] = oy + m01 * x[k] + m11 * y[k] + m21 * z[k];
    to_z[k] = oz + m02 * x[k] + m12 * y[k] + m22 * z[k];
  }
}

} // namespace daylit::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::lanes {

HWY_EXPORT(Receive);
HWY_EXPORT(Facing);
HWY_EXPORT(FacingThroughBox);
HWY_EXPORT(Faced);
HWY_EXPORT(AddLight);
HWY_EXPORT(Transpose);
HWY_EXPORT(Transform);

LaneMask receive(const PointBlock& points, const glm::vec3& w, std::span<const Portal> portals, const glm::vec4* planes,
                 LaneRgb& e) {
  return HWY_DYNAMIC_DISPATCH(Receive)(points, w, portals, planes, e);
}
LaneMask facing(const PointBlock& points, const glm::vec3& w) { return HWY_DYNAMIC_DISPATCH(Facing)(points, w); }
LaneMask facing_through_box(const PointBlock& points, const glm::vec3& w, const glm::vec3& low, const glm::vec3& high) {
  return HWY_DYNAMIC_DISPATCH(FacingThroughBox)(points, w, low, high);
}
FacedLights faced_lights(const DirectionBlock& w, const glm::vec3& n, const glm::vec3& to_centre, float radius) {
  return HWY_DYNAMIC_DISPATCH(Faced)(w, n, to_centre, radius);
}
void add_light(LightSums& sums, const Rgb& irradiance, const LaneRgb& e, LaneMask by_room, LaneMask by_any) {
  HWY_DYNAMIC_DISPATCH(AddLight)(sums, irradiance, e, by_room, by_any);
}
void transpose(std::span<const LaneMask> masks, std::uint64_t (&bits)[kLanes]) {
  HWY_DYNAMIC_DISPATCH(Transpose)(masks.data(), masks.size(), bits);
}
void transform(const glm::mat3& axes, const glm::vec3& origin, const LaneVectors& from, float* x, float* y, float* z) {
  HWY_DYNAMIC_DISPATCH(Transform)(axes, origin, from, x, y, z);
}

} // namespace daylit::lanes
#endif
