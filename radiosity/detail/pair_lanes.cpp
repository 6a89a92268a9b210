// Compiled once for each set of vector instructions: the loops are plain, the compiler makes vectors of them.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "radiosity/detail/pair_lanes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "radiosity/detail/pair_lanes.h"

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace daylit::radiosity {
namespace HWY_NAMESPACE {
namespace {

/// Points of the R4 sequence (Roberts 2018), shifted: u[axis][lane] = frac(shift + (index + 1) / phi^(axis + 1)), phi
/// the root of x^5 = x + 1.
void r4_points(const std::uint32_t* index, const float (*shift)[16], float (*__restrict u)[16]) {
  // The powers as fractions of 2^32: the wrap of unsigned arithmetic takes the fractional part.
  constexpr std::uint32_t step[4] = {3679390609u, 3152041523u, 2700274806u, 2313257605u};
  for (int a = 0; a < 4; ++a)
    for (int k = 0; k < 16; ++k) {
      const auto bits = static_cast<std::int32_t>(((index[k] + 1) * step[a]) >> 8);
      const float x = shift[a][k] + static_cast<float>(bits) * 0x1p-24f;
      u[a][k] = x >= 1.0f ? x - 1.0f : x;
    }
}

/// Uniform on triangles (Heitz 2019), in place of u and v: the weights of the two edges.
void fold_to_triangle(float* __restrict u, float* __restrict v) {
  for (int k = 0; k < 16; ++k) {
    const float smaller = 0.5f * std::min(u[k], v[k]), difference = u[k] - v[k];
    u[k] = smaller + std::max(difference, 0.0f);
    v[k] = smaller + std::max(-difference, 0.0f);
  }
}

/// Rays between the points, and the kernel cos cos / r^2 of each as (d . n_from)+ (-d . n_to)+ / |d|^4, up to the
/// factors that all rays of a pair share.
void connect(const PairLanes& lanes, const float (*u)[16], float gap, RayPacket16& __restrict packet,
             float* __restrict weight) {
  const auto &from = lanes.from, &to = lanes.to;
  const auto &normal_from = lanes.normal_from, &normal_to = lanes.normal_to;
  for (int k = 0; k < 16; ++k) {
    const float x = from[0][k] + u[0][k] * from[3][k] + u[1][k] * from[6][k];
    const float y = from[1][k] + u[0][k] * from[4][k] + u[1][k] * from[7][k];
    const float z = from[2][k] + u[0][k] * from[5][k] + u[1][k] * from[8][k];
    const float dx = to[0][k] + u[2][k] * to[3][k] + u[3][k] * to[6][k] - x;
    const float dy = to[1][k] + u[2][k] * to[4][k] + u[3][k] * to[7][k] - y;
    const float dz = to[2][k] + u[2][k] * to[5][k] + u[3][k] * to[8][k] - z;
    const float r2 = std::max(dx * dx + dy * dy + dz * dz, 1e-30f);
    const float ca = std::max(0.0f, dx * normal_from[0][k] + dy * normal_from[1][k] + dz * normal_from[2][k]);
    const float cb = std::max(0.0f, -(dx * normal_to[0][k] + dy * normal_to[1][k] + dz * normal_to[2][k]));
    const float margin = std::min(0.25f, gap / std::sqrt(r2));
    packet.org_x[k] = x;
    packet.org_y[k] = y;
    packet.org_z[k] = z;
    packet.dir_x[k] = dx;
    packet.dir_y[k] = dy;
    packet.dir_z[k] = dz;
    packet.tnear[k] = margin;
    packet.tfar[k] = 1.0f - margin;
    weight[k] = (ca / r2) * (cb / r2);
  }
}

} // namespace

void PairRays(const PairLanes& lanes, float gap, RayPacket16& packet, float* weight) {
  alignas(64) float u[4][16];
  r4_points(lanes.index, lanes.shift, u);
  fold_to_triangle(u[0], u[1]);
  fold_to_triangle(u[2], u[3]);
  connect(lanes, u, gap, packet, weight);
}

void PlaneSides(const CornerHeights& h, std::uint32_t count, float tolerance, std::int32_t* side) {
  const float low = std::min(h.one[0], std::min(h.one[1], h.one[2])),
              high = std::max(h.one[0], std::max(h.one[1], h.one[2]));
  const std::int32_t above = low >= -tolerance, below = high <= tolerance;
  for (std::uint32_t j = 0; j < count; ++j) {
    const float l = std::min(h.c0[j], std::min(h.c1[j], h.c2[j])), u = std::max(h.c0[j], std::max(h.c1[j], h.c2[j]));
    const std::int32_t column_above = l >= -tolerance, column_below = u <= tolerance;
    const std::int32_t same = (above & column_above) | (below & column_below);
    const std::int32_t crossing = (above & column_below) - (below & column_above);
    side[j] = same ? 2 : crossing;
  }
}

void EdgeSides(const CornerHeights& plane, const CornerHeights& edge, std::uint32_t count, float tolerance,
               const std::int32_t* side, std::int32_t* outside, std::int32_t* inside) {
  for (std::uint32_t j = 0; j < count; ++j) {
    const float sign = static_cast<float>(side[j]);
    const float hb[3] = {plane.c0[j], plane.c1[j], plane.c2[j]}, sb[3] = {edge.c0[j], edge.c1[j], edge.c2[j]};
    float most = -1e30f, least = 1e30f, plain = -1e30f;
    for (int a = 0; a < 3; ++a) {
      plain = std::max(plain, std::max(edge.one[a], sb[a]));
      for (int b = 0; b < 3; ++b) {
        // Height of the crossing point over the edge, times |ha - hb|; and the tolerance times the same.
        const float height = sign * (plane.one[a] * sb[b] - hb[b] * edge.one[a]);
        const float margin = tolerance * sign * (plane.one[a] - hb[b]);
        most = std::max(most, height - margin);
        least = std::min(least, height + margin);
      }
    }
    const std::int32_t crosses = side[j] == 1 || side[j] == -1;
    outside[j] |= (plain <= tolerance) | (crosses & (most <= 0.0f));
    inside[j] &= crosses & (least >= 0.0f);
  }
}

} // namespace HWY_NAMESPACE
} // namespace daylit::radiosity
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::radiosity {

HWY_EXPORT(PairRays);

void pair_rays(const PairLanes& lanes, float gap, RayPacket16& packet, float* weight) {
  HWY_DYNAMIC_DISPATCH(PairRays)(lanes, gap, packet, weight);
}

HWY_EXPORT(PlaneSides);
HWY_EXPORT(EdgeSides);

void plane_sides(const CornerHeights& plane, std::uint32_t count, float tolerance, std::int32_t* side) {
  HWY_DYNAMIC_DISPATCH(PlaneSides)(plane, count, tolerance, side);
}

void edge_sides(const CornerHeights& plane, const CornerHeights& edge, std::uint32_t count, float tolerance,
                const std::int32_t* side, std::int32_t* outside, std::int32_t* inside) {
  HWY_DYNAMIC_DISPATCH(EdgeSides)(plane, edge, count, tolerance, side, outside, inside);
}

} // namespace daylit::radiosity
#endif
