// Compiled once for each set of vector instructions: the loops are plain, the compiler makes vectors of them.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "radiosity/detail/pair_sides.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "radiosity/detail/pair_sides.h"

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace daylit::radiosity {
namespace HWY_NAMESPACE {

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
