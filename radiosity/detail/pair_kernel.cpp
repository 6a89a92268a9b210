// Compiled once for each set of vector instructions: the loops are plain, the compiler makes vectors of them.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "radiosity/detail/pair_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "radiosity/detail/pair_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

HWY_BEFORE_NAMESPACE();
namespace daylit::radiosity {
namespace HWY_NAMESPACE {
namespace {

constexpr float kFarRatio2 = 30.0f;      // squared distance over squared sum of radii from which 3 x 3 points do
constexpr float kPlaneTolerance = 1e-5f; // of the radii: rounding of corners that lie in the other's plane

/// Raw pointers into PairArrays from `first` on, so that the loops below vectorise.
struct Columns {
  const float *corner[9], *gauss[9], *centre[3], *normal[3], *radius, *area;
};

Columns columns_from(const PairArrays& a, std::uint32_t first) {
  Columns c;
  for (std::size_t k = 0; k < 9; ++k) {
    c.corner[k] = a.corner[k].data() + first;
    c.gauss[k] = a.gauss[k].data() + first;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    c.centre[k] = a.centre[k].data() + first;
    c.normal[k] = a.normal[k].data() + first;
  }
  c.radius = a.radius.data() + first;
  c.area = a.area.data() + first;
  return c;
}

/// state[j]: kNotFacing, kFar or kNear of the pair (one, column j). A patch faces another when a corner of either lies
/// in front of the other's plane: h = (corner - centre) . normal > 0, metres.
void classify(const Columns& one, const Columns& many, std::uint32_t count, std::int32_t* state) {
  const float cx = *one.centre[0], cy = *one.centre[1], cz = *one.centre[2];
  const float nx = *one.normal[0], ny = *one.normal[1], nz = *one.normal[2], radius = *one.radius;
  const float px[3] = {*one.corner[0], *one.corner[3], *one.corner[6]},
              py[3] = {*one.corner[1], *one.corner[4], *one.corner[7]},
              pz[3] = {*one.corner[2], *one.corner[5], *one.corner[8]};
  const float *qx0 = many.corner[0], *qy0 = many.corner[1], *qz0 = many.corner[2], *qx1 = many.corner[3],
              *qy1 = many.corner[4], *qz1 = many.corner[5], *qx2 = many.corner[6], *qy2 = many.corner[7],
              *qz2 = many.corner[8], *mx = many.centre[0], *my = many.centre[1], *mz = many.centre[2],
              *ox = many.normal[0], *oy = many.normal[1], *oz = many.normal[2], *r = many.radius;
  for (std::uint32_t j = 0; j < count; ++j) {
    const float tolerance = kPlaneTolerance * (radius + r[j]);
    const float a0 = (qx0[j] - cx) * nx + (qy0[j] - cy) * ny + (qz0[j] - cz) * nz;
    const float a1 = (qx1[j] - cx) * nx + (qy1[j] - cy) * ny + (qz1[j] - cz) * nz;
    const float a2 = (qx2[j] - cx) * nx + (qy2[j] - cy) * ny + (qz2[j] - cz) * nz;
    const float b0 = (px[0] - mx[j]) * ox[j] + (py[0] - my[j]) * oy[j] + (pz[0] - mz[j]) * oz[j];
    const float b1 = (px[1] - mx[j]) * ox[j] + (py[1] - my[j]) * oy[j] + (pz[1] - mz[j]) * oz[j];
    const float b2 = (px[2] - mx[j]) * ox[j] + (py[2] - my[j]) * oy[j] + (pz[2] - mz[j]) * oz[j];
    const float highest_a = std::max(a0, std::max(a1, a2)), lowest_a = std::min(a0, std::min(a1, a2));
    const float highest_b = std::max(b0, std::max(b1, b2)), lowest_b = std::min(b0, std::min(b1, b2));
    const float dx = mx[j] - cx, dy = my[j] - cy, dz = mz[j] - cz, radii = radius + r[j];
    const float distance2 = dx * dx + dy * dy + dz * dz, limit2 = kFarRatio2 * radii * radii;
    const bool whole = lowest_a >= -tolerance && lowest_b >= -tolerance;
    const bool far = distance2 > limit2 || (distance2 > 0.25f * limit2 && whole);
    state[j] = highest_a <= tolerance || highest_b <= tolerance ? kNotFacing : (far ? kFar : kNear);
  }
}

/// Exchange area in m^2 (Cohen & Wallace 1993, ch. 4), 0 where the pair does not face:
///   G_ij = 1/pi int_Ai int_Aj cos_i cos_j / r^2 dA_j dA_i ~ A_i A_j / (9 pi) sum_pq (d.n_i)+ (-d.n_j)+ / |d|^4,
/// d from point p of the one to point q of the other, three points on each (Strang & Fix 1973, degree 2).
void nine_points(const Columns& one, const Columns& many, std::uint32_t count, const std::int32_t* state,
                 float* exchange) {
  const float nx = *one.normal[0], ny = *one.normal[1], nz = *one.normal[2];
  const float scale = *one.area / (9.0f * std::numbers::pi_v<float>);
  const float *ox = many.normal[0], *oy = many.normal[1], *oz = many.normal[2], *area = many.area;
  for (std::uint32_t j = 0; j < count; ++j)
    exchange[j] = 0.0f;
  for (std::size_t p = 0; p < 3; ++p) {
    const float x = *one.gauss[3 * p], y = *one.gauss[3 * p + 1], z = *one.gauss[3 * p + 2];
    for (std::size_t q = 0; q < 3; ++q) {
      const float *gx = many.gauss[3 * q], *gy = many.gauss[3 * q + 1], *gz = many.gauss[3 * q + 2];
      for (std::uint32_t j = 0; j < count; ++j) {
        const float dx = gx[j] - x, dy = gy[j] - y, dz = gz[j] - z;
        const float r2 = std::max(dx * dx + dy * dy + dz * dz, 1e-30f);
        const float a = std::max(0.0f, dx * nx + dy * ny + dz * nz);
        const float b = std::max(0.0f, -(dx * ox[j] + dy * oy[j] + dz * oz[j]));
        exchange[j] += (a / r2) * (b / r2);
      }
    }
  }
  for (std::uint32_t j = 0; j < count; ++j)
    exchange[j] = state[j] == kNotFacing ? 0.0f : exchange[j] * scale * area[j];
}

} // namespace

void PairRow(const PairArrays& a, std::uint32_t i, std::uint32_t first, std::uint32_t last, float* exchange_m2,
             std::int32_t* state) {
  const Columns one = columns_from(a, i), many = columns_from(a, first);
  classify(one, many, last - first, state);
  nine_points(one, many, last - first, state, exchange_m2);
}

} // namespace HWY_NAMESPACE
} // namespace daylit::radiosity
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::radiosity {

HWY_EXPORT(PairRow);

PairArrays::PairArrays(const PatchSet& set, std::span<const std::uint32_t> order, const glm::dvec3& shift) {
  for (const std::uint32_t index : order) {
    const Patch& e = set.patches[index];
    const glm::dvec3 middle = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
    double radius2 = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 at = e.corner[k] + shift, rule = 0.5 * (e.corner[k] + middle) + shift; // (2/3, 1/6, 1/6)
      radius2 = std::max(radius2, glm::dot(e.corner[k] - middle, e.corner[k] - middle));
      for (int axis = 0; axis < 3; ++axis) {
        corner[3 * k + static_cast<std::size_t>(axis)].push_back(static_cast<float>(at[axis]));
        gauss[3 * k + static_cast<std::size_t>(axis)].push_back(static_cast<float>(rule[axis]));
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      centre[static_cast<std::size_t>(axis)].push_back(static_cast<float>(middle[axis] + shift[axis]));
      normal[static_cast<std::size_t>(axis)].push_back(static_cast<float>(e.normal[axis]));
    }
    radius.push_back(static_cast<float>(std::sqrt(radius2)));
    area.push_back(static_cast<float>(e.area_m2));
  }
}

void pair_row(const PairArrays& a, std::uint32_t i, std::uint32_t first, std::uint32_t last, float* exchange_m2,
              std::int32_t* state) {
  HWY_DYNAMIC_DISPATCH(PairRow)(a, i, first, last, exchange_m2, state);
}

} // namespace daylit::radiosity
#endif
