#include "runtime/gl/depth_raster.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <tbb/enumerable_thread_specific.h>

#include "runtime/base/lane_vector.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

// Sixteen maps are drawn together, a lane each: in all of them a triangle covers about as many texels, so that vector
// instructions stay full however small it is.
constexpr int kLanes = 16;

// By value: a choice between references is a branch.
inline float least(float a, float b) { return a < b ? a : b; }
inline float most(float a, float b) { return a > b ? a : b; }

/// A vertex in every map: x, y in texels, z the depth.
struct alignas(64) LaneVertex {
  float x[kLanes], y[kLanes], z[kLanes];
};

/// Rows of the projection: x = dot(right, v) + offset.
struct alignas(64) LaneAxes {
  float right[3][kLanes], up[3][kLanes], toward[3][kLanes];
};

DAYLIT_LANE_CLONES void project(const glm::vec3* vertices, std::size_t count, const LaneAxes& a, float half,
                                LaneVertex* projected) {
  for (std::size_t i = 0; i < count; ++i) {
    const float vx = vertices[i].x, vy = vertices[i].y, vz = vertices[i].z;
    LaneVertex& p = projected[i];
    DAYLIT_EACH_LANE {
      p.x[k] = half + (a.right[0][k] * vx + a.right[1][k] * vy + a.right[2][k] * vz);
      p.y[k] = half + (a.up[0][k] * vx + a.up[1][k] * vy + a.up[2][k] * vz);
      p.z[k] = 0.5f - (a.toward[0][k] * vx + a.toward[1][k] * vy + a.toward[2][k] * vz);
    }
  }
}

/// Where texel (column, row) of a triangle's box lies in it, per map.
struct alignas(64) LaneTriangle {
  int first[kLanes]; ///< texel of all maps, the box's first
  int columns[kLanes], texels[kLanes];
  float b[kLanes], b_column[kLanes], b_row[kLanes]; ///< barycentric weights, linear over the map
  float c[kLanes], c_column[kLanes], c_row[kLanes];
  float z[kLanes], z_b[kLanes], z_c[kLanes]; ///< depth by weight
};

/// Returns the most texels of any map. The first texel whose centre is not before x is int(x + 1/2), x not negative.
inline int set_up(const LaneVertex& a, const LaneVertex& b, const LaneVertex& c, int side, LaneTriangle& t) {
  const float end = static_cast<float>(side);
  int most_texels = 0;
#pragma omp simd reduction(max : most_texels)
  for (int k = 0; k < kLanes; ++k) {
    const float left = most(least(a.x[k], least(b.x[k], c.x[k])), 0.0f);
    const float right = least(most(a.x[k], most(b.x[k], c.x[k])), end);
    const float low = most(least(a.y[k], least(b.y[k], c.y[k])), 0.0f);
    const float high = least(most(a.y[k], most(b.y[k], c.y[k])), end);
    const int x0 = static_cast<int>(left + 0.5f), x1 = static_cast<int>(most(right, 0.0f) + 0.5f);
    const int y0 = static_cast<int>(low + 0.5f), y1 = static_cast<int>(most(high, 0.0f) + 0.5f);
    const float ab_x = b.x[k] - a.x[k], ab_y = b.y[k] - a.y[k], ac_x = c.x[k] - a.x[k], ac_y = c.y[k] - a.y[k];
    const float area = ab_x * ac_y - ab_y * ac_x;
    const bool drawn = (x0 < x1) & (y0 < y1) & (area != 0.0f);
    const float scale = 1.0f / (drawn ? area : 1.0f);
    const float dx = static_cast<float>(x0) + 0.5f - a.x[k], dy = static_cast<float>(y0) + 0.5f - a.y[k];
    t.b_column[k] = ac_y * scale;
    t.b_row[k] = -ac_x * scale;
    t.c_column[k] = -ab_y * scale;
    t.c_row[k] = ab_x * scale;
    t.b[k] = t.b_column[k] * dx + t.b_row[k] * dy;
    t.c[k] = t.c_column[k] * dx + t.c_row[k] * dy;
    t.z[k] = drawn ? a.z[k] : 1.0f; // changes nothing
    t.z_b[k] = drawn ? b.z[k] - a.z[k] : 0.0f;
    t.z_c[k] = drawn ? c.z[k] - a.z[k] : 0.0f;
    t.columns[k] = x1 - x0;
    t.texels[k] = drawn ? (x1 - x0) * (y1 - y0) : 0;
    t.first[k] = drawn ? (k * side + y0) * side + x0 : k * side * side;
    most_texels = t.texels[k] > most_texels ? t.texels[k] : most_texels;
  }
  return most_texels;
}

/// `maps`: of all lanes, side^2 each.
DAYLIT_LANE_CLONES void draw_triangles(const std::array<std::uint32_t, 3>* triangles, std::size_t count,
                                       const LaneVertex* projected, int side, float* maps) {
  LaneTriangle t;
  for (std::size_t i = 0; i < count; ++i) {
    const int steps =
        set_up(projected[triangles[i][0]], projected[triangles[i][1]], projected[triangles[i][2]], side, t);
    alignas(64) int column[kLanes] = {}, row[kLanes] = {};
    for (int step = 0; step < steps; ++step) {
      alignas(64) float depth[kLanes];
      alignas(64) int texel[kLanes];
      // Without branches: half of the texels are outside. A map whose box is done goes on at its first texel.
      DAYLIT_EACH_LANE {
        const float u = static_cast<float>(column[k]), v = static_cast<float>(row[k]);
        const float pb = t.b[k] + u * t.b_column[k] + v * t.b_row[k], pc = t.c[k] + u * t.c_column[k] + v * t.c_row[k];
        const float outside = least(least(pb, pc), 1.0f - pb - pc), z = t.z[k] + pb * t.z_b[k] + pc * t.z_c[k];
        const float nearest = outside >= 0.0f ? 0.0f : 1.0f; // 1: changes nothing
        depth[k] = most(z, nearest);
        texel[k] = t.first[k] + row[k] * side + column[k];
        const int next = column[k] + 1, ends = next >= t.columns[k] ? 1 : 0, goes_on = step + 1 < t.texels[k] ? 1 : 0;
        column[k] = goes_on * (1 - ends) * next;
        row[k] = goes_on * (row[k] + ends);
      }
      DAYLIT_EACH_LANE
      maps[texel[k]] = least(maps[texel[k]], depth[k]);
    }
  }
}

DAYLIT_LANE_CLONES void quantise(const float* depths, std::size_t count, std::uint16_t* texels) {
  for (std::size_t i = 0; i < count; ++i) // none is below 0 or above 1
    texels[i] = static_cast<std::uint16_t>(static_cast<int>(depths[i] * DepthRaster::kNothing + 0.5f));
}

} // namespace

bool DepthRaster::meets(const MapAxes& axes) const {
  const float reach = 1.02f * half_width; // filters reach a texel further
  return std::any_of(triangles.begin(), triangles.end(), [&](const std::array<std::uint32_t, 3>& t) {
    glm::vec2 p[3];
    for (int k = 0; k < 3; ++k)
      p[k] = {glm::dot(axes.right, vertices[t[k]]), glm::dot(axes.up, vertices[t[k]])};
    // The axes that may separate a triangle from the square.
    const glm::vec2 normals[] = {{1.0f, 0.0f}, {0.0f, 1.0f}, p[1] - p[0], p[2] - p[1], p[0] - p[2]};
    for (int k = 0; k < 5; ++k) {
      const glm::vec2 n = k < 2 ? normals[k] : glm::vec2(-normals[k].y, normals[k].x);
      const float a = glm::dot(n, p[0]), b = glm::dot(n, p[1]), c = glm::dot(n, p[2]);
      const float square = reach * (std::fabs(n.x) + std::fabs(n.y));
      if (std::min({a, b, c}) > square || std::max({a, b, c}) < -square)
        return false;
    }
    return true;
  });
}

void DepthRaster::draw(std::span<const MapAxes> axes, std::span<std::uint16_t> maps) const {
  const std::size_t size = static_cast<std::size_t>(texels) * static_cast<std::size_t>(texels);
  const float half = 0.5f * static_cast<float>(texels), scale = half / half_width, depth = 0.5f / half_depth;
  struct Memory {
    std::vector<LaneVertex> projected;
    std::vector<float> depths; ///< of all lanes, also of those that are not asked for
  };
  tbb::enumerable_thread_specific<Memory> memory;
  const std::size_t groups = (axes.size() + kLanes - 1) / kLanes;
  parallel_for(std::size_t{0}, groups, [&](std::size_t group) {
    Memory& m = memory.local();
    m.projected.resize(vertices.size());
    const std::size_t first = group * kLanes, used = std::min<std::size_t>(kLanes, axes.size() - first);
    LaneAxes lanes;
    for (std::size_t k = 0; k < kLanes; ++k)
      for (int c = 0; c < 3; ++c) {
        const MapAxes& a = axes[first + std::min(k, used - 1)];
        lanes.right[c][k] = scale * a.right[c];
        lanes.up[c][k] = scale * a.up[c];
        lanes.toward[c][k] = depth * a.toward[c];
      }
    m.depths.assign(kLanes * size, 1.0f);
    project(vertices.data(), vertices.size(), lanes, half, m.projected.data());
    draw_triangles(triangles.data(), triangles.size(), m.projected.data(), texels, m.depths.data());
    quantise(m.depths.data(), used * size, maps.data() + first * size);
  });
}

} // namespace daylit
