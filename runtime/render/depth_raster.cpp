#include "runtime/render/depth_raster.h"

#include <algorithm>
#include <vector>

#include <glm/geometric.hpp>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace daylit {

namespace {

/// First texel whose centre is not before x; x is not negative.
int texel_from(float x) { return static_cast<int>(x + 0.5f); }

/// x, y in texels, z the depth.
inline void draw_triangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, int texels, float* map) {
  const float side = static_cast<float>(texels);
  const float left = std::max(std::min({a.x, b.x, c.x}), 0.0f), right = std::min(std::max({a.x, b.x, c.x}), side);
  const float low = std::max(std::min({a.y, b.y, c.y}), 0.0f), high = std::min(std::max({a.y, b.y, c.y}), side);
  const int x0 = texel_from(left), x1 = texel_from(right), y0 = texel_from(low), y1 = texel_from(high);
  const float ab_x = b.x - a.x, ab_y = b.y - a.y, ac_x = c.x - a.x, ac_y = c.y - a.y;
  const float area = ab_x * ac_y - ab_y * ac_x;
  if (x0 >= x1 || y0 >= y1 || area == 0.0f)
    return;
  // Barycentric weights and depth are linear over the map.
  const float scale = 1.0f / area, bx = ac_y * scale, by = -ac_x * scale, cx = -ab_y * scale, cy = ab_x * scale;
  const float ab_z = b.z - a.z, ac_z = c.z - a.z, dx = static_cast<float>(x0) + 0.5f - a.x;
  for (int y = y0; y < y1; ++y) {
    const float dy = static_cast<float>(y) + 0.5f - a.y, wb = bx * dx + by * dy, wc = cx * dx + cy * dy;
    float* row = map + static_cast<std::ptrdiff_t>(y) * texels + x0;
    for (int k = 0; k < x1 - x0; ++k) { // without branches: half of the texels are outside, and none can be foretold
      const float pb = wb + static_cast<float>(k) * bx, pc = wc + static_cast<float>(k) * cx;
      const float depth = std::max(a.z + pb * ab_z + pc * ac_z, 0.0f), outside = std::min({pb, pc, 1.0f - pb - pc});
      row[k] = std::min(row[k], outside >= 0.0f ? depth : 1.0f);
    }
  }
}

__attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"))) void
draw_triangles(std::span<const std::array<std::uint32_t, 3>> triangles, const glm::vec3* projected, int texels,
               float* map) {
  for (const auto& t : triangles)
    draw_triangle(projected[t[0]], projected[t[1]], projected[t[2]], texels, map);
}

} // namespace

void DepthRaster::draw(std::span<const MapAxes> axes, std::span<float> maps) const {
  const std::size_t size = static_cast<std::size_t>(texels) * static_cast<std::size_t>(texels);
  const float half = 0.5f * static_cast<float>(texels), scale = half / half_width, depth = 0.5f / half_depth;
  tbb::enumerable_thread_specific<std::vector<glm::vec3>> projected;
  tbb::parallel_for(std::size_t{0}, axes.size(), [&](std::size_t k) {
    const MapAxes& m = axes[k];
    std::vector<glm::vec3>& p = projected.local();
    p.resize(vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i)
      p[i] = {half + scale * glm::dot(m.right, vertices[i]), half + scale * glm::dot(m.up, vertices[i]),
              0.5f - depth * glm::dot(m.toward, vertices[i])};
    float* map = maps.data() + k * size;
    std::fill_n(map, size, 1.0f);
    draw_triangles(triangles, p.data(), texels, map);
  });
}

} // namespace daylit
