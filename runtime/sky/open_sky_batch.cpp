// Unshadowed sky irradiance of many points at once: the fast twin of the one-point function, sixteen points per step.
// Angles come from a polynomial: off by less than 3e-6 radians, a thousandth of a texel of the finest map.
//
// What a cell shows of the sky changes little over an object: a texel of its map is about as large as the cell. Points
// that stand close together therefore use the same look-ups at a lattice no wider than half a cell, trilinear between.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/sky/direct_light.h"
#include "scene/core/parallel.h"

#define DAYLIT_LANE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

namespace daylit {

namespace {

constexpr int kPoints = 16;
constexpr float kPi = std::numbers::pi_v<float>;

struct alignas(64) Receivers {
  float x[kPoints], y[kPoints], z[kPoints], nx[kPoints], ny[kPoints], nz[kPoints];
};

/// What each receiver takes from a cell: weight x radiance at texel position (u, v), measured from texel centres.
struct alignas(64) CellView {
  float weight[kPoints], u[kPoints], v[kPoints];
};

struct CellConstants {
  float x, y, z, inward_x, inward_y, inward_z, area, index, width, height;
};

/// atan2 for y >= 0 after Abramowitz & Stegun 4.4.49 (error 2e-8 on |a| <= 1).
[[gnu::always_inline]] inline float upper_angle(float y, float x) {
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

/// Fresnel slab with all internal reflections (scene/glass.h): mean over both polarisations of 2ab / (a^2 + b^2).
[[gnu::always_inline]] inline float slab(float facing, float n, float inverse_n2) {
  const float glass = std::sqrt(1.0f - (1.0f - facing * facing) * inverse_n2 + 1e-12f);
  const float s = n * glass, p = n * facing;
  return facing * s / (facing * facing + s * s + 1e-20f) + p * glass / (p * p + glass * glass + 1e-20f);
}

/// Straight-line selections only: a branch would keep the loop from being vectorised.
DAYLIT_LANE_CLONES
void look_through(const CellConstants& c, const Receivers& r, CellView& view) {
  const float n = c.index > 0.0f ? c.index : 1.0f, has_slab = c.index > 0.0f ? 1.0f : 0.0f, inverse_n2 = 1.0f / (n * n);
#pragma omp simd
  for (int k = 0; k < kPoints; ++k) {
    const float dx = c.x - r.x[k], dy = c.y - r.y[k], dz = c.z - r.z[k];
    const float across2 = dx * dx + dy * dy, inverse = 1.0f / std::sqrt(across2 + dz * dz + 1e-20f);
    const float f = -(c.inward_x * dx + c.inward_y * dy + c.inward_z * dz) * inverse;
    const float q = (r.nx[k] * dx + r.ny[k] * dy + r.nz[k] * dz) * inverse;
    const float facing = f > 0.0f ? f : 0.0f, receiving = q > 0.0f ? q : 0.0f;
    view.weight[k] =
        facing * receiving * c.area * inverse * inverse * (1.0f + has_slab * (slab(facing, n, inverse_n2) - 1.0f));
    const float azimuth = upper_angle(std::fabs(dy), dx);
    const float turn = dy < 0.0f ? -1.0f : 1.0f;
    view.u[k] = (0.5f - turn * azimuth * (0.5f / kPi)) * c.width - 0.5f;
    view.v[k] = upper_angle(std::sqrt(across2), dz) * (1.0f / kPi) * c.height - 0.5f;
  }
}

Rgb interpolate(const SkyMap& map, float u, float v) {
  const float fu = std::floor(u), fv = std::floor(v), s = u - fu, t = v - fv;
  int x0 = static_cast<int>(fu), x1 = x0 + 1;
  x0 = x0 < 0 ? x0 + map.width : x0;
  x1 = x1 >= map.width ? x1 - map.width : x1;
  const int y0 = std::clamp(static_cast<int>(fv), 0, map.height - 1),
            y1 = std::clamp(static_cast<int>(fv) + 1, 0, map.height - 1);
  return (1.0f - t) * ((1.0f - s) * map.at(x0, y0) + s * map.at(x1, y0)) +
         t * ((1.0f - s) * map.at(x0, y1) + s * map.at(x1, y1));
}

CellConstants constants_of(const ApertureCell& cell, const SkyMap& map, const glm::dvec3& origin) {
  const glm::vec3 p(cell.centre - origin), inward(cell.inward);
  return {p.x,
          p.y,
          p.z,
          inward.x,
          inward.y,
          inward.z,
          static_cast<float>(cell.area_m2),
          cell.refractive_index,
          static_cast<float>(map.width),
          static_cast<float>(map.height)};
}

void set(Receivers& r, int k, const glm::vec3& p, const glm::vec3& n) {
  r.x[k] = p.x;
  r.y[k] = p.y;
  r.z[k] = p.z;
  r.nx[k] = n.x;
  r.ny[k] = n.y;
  r.nz[k] = n.z;
}

/// Looks the sky up for each point.
void gather(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells, const glm::dvec3& origin,
            const Receivers& receivers, int count, Rgb* irradiance) {
  CellView view;
  for (const ApertureCell& cell : cells) {
    const SkyMap& map = pyramid[cell.level];
    look_through(constants_of(cell, map, origin), receivers, view);
    for (int k = 0; k < count; ++k)
      if (view.weight[k] > 0.0f)
        irradiance[k] += view.weight[k] * cell.transmittance * interpolate(map, view.u[k], view.v[k]);
  }
}

/// Boxes around the points, and radiance x transmittance through each cell at their corners.
struct Lattice {
  glm::vec3 low{0.0f};
  float spacing = 1.0f;
  int boxes[3] = {1, 1, 1};
  std::vector<Rgb> radiance; ///< cell by cell, corners x first

  int corner_count() const { return (boxes[0] + 1) * (boxes[1] + 1) * (boxes[2] + 1); }
  int corner(int i, int j, int k) const { return (k * (boxes[1] + 1) + j) * (boxes[0] + 1) + i; }
  int box_count() const { return boxes[0] * boxes[1] * boxes[2]; }
  glm::vec3 corner_position(int index) const {
    const int nx = boxes[0] + 1, ny = boxes[1] + 1;
    return low + spacing * glm::vec3(index % nx, index / nx % ny, index / (nx * ny));
  }
  int box_of(const glm::vec3& p) const {
    const glm::vec3 q = (p - low) / spacing;
    const auto along = [&](int axis) { return std::clamp(static_cast<int>(q[axis]), 0, boxes[axis] - 1); };
    return (along(2) * boxes[1] + along(1)) * boxes[0] + along(0);
  }
};

/// Empty radiance: the points lie so near a window, or so far apart, that a lattice saves nothing.
Lattice make_lattice(std::span<const ApertureCell> cells, const glm::dvec3& origin, std::span<const glm::dvec3> x) {
  constexpr float kCellFraction = 0.5f;
  constexpr std::size_t kPointsPerCorner = 4;
  glm::vec3 low(x[0] - origin), high = low;
  for (const glm::dvec3& p : x) {
    low = glm::min(low, glm::vec3(p - origin));
    high = glm::max(high, glm::vec3(p - origin));
  }
  float spacing = std::numeric_limits<float>::infinity();
  for (const ApertureCell& cell : cells) {
    const glm::vec3 c(cell.centre - origin);
    const float distance = glm::length(c - glm::clamp(c, low, high));
    spacing = std::min({spacing, kCellFraction * std::sqrt(static_cast<float>(cell.area_m2)), 0.25f * distance});
  }
  Lattice lattice{low, spacing, {}, {}};
  double corners = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = std::max(std::ceil(static_cast<double>((high[axis] - low[axis]) / spacing)), 1.0);
    corners *= along + 1.0;
    if (!(corners * kPointsPerCorner <= static_cast<double>(x.size())))
      return lattice;
    lattice.boxes[axis] = static_cast<int>(along);
  }
  lattice.radiance.resize(cells.size() * static_cast<std::size_t>(corners));
  return lattice;
}

void look_up(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells, const glm::dvec3& origin,
             Lattice& lattice) {
  const int corners = lattice.corner_count();
  parallel_for(tbb::blocked_range<std::size_t>(0, cells.size(), 8), [&](const auto& range) {
    Receivers r;
    CellView view;
    for (int first = 0; first < corners; first += kPoints) {
      const int count = std::min(kPoints, corners - first);
      for (int k = 0; k < kPoints; ++k)
        set(r, k, lattice.corner_position(first + std::min(k, count - 1)), glm::vec3(0.0f));
      for (std::size_t c = range.begin(); c != range.end(); ++c) {
        const SkyMap& map = pyramid[cells[c].level];
        look_through(constants_of(cells[c], map, origin), r, view);
        Rgb* to = &lattice.radiance[c * static_cast<std::size_t>(corners) + static_cast<std::size_t>(first)];
        for (int k = 0; k < count; ++k)
          to[k] = cells[c].transmittance * interpolate(map, view.u[k], view.v[k]);
      }
    }
  });
}

/// Radiance through a cell in a box: sum over m of factor[c][m] times (1, x, y, xy, z, xz, yz, xyz), x, y, z in 0..1.
struct BoxRadiance {
  float factor[3][8];
};

void find_factors(const Lattice& lattice, int box, std::size_t cells, std::vector<BoxRadiance>& factors) {
  const int i = box % lattice.boxes[0], j = box / lattice.boxes[0] % lattice.boxes[1],
            k = box / (lattice.boxes[0] * lattice.boxes[1]);
  factors.resize(cells);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const Rgb* at = &lattice.radiance[cell * static_cast<std::size_t>(lattice.corner_count())];
    Rgb value[8];
    for (int m = 0; m < 8; ++m)
      value[m] = at[lattice.corner(i + (m & 1), j + (m >> 1 & 1), k + (m >> 2))];
    for (int step = 1; step < 8; step *= 2) // differences along x, then y, then z
      for (int m = 0; m < 8; ++m)
        if (m & step)
          value[m] -= value[m - step];
    for (int m = 0; m < 8; ++m)
      for (int c = 0; c < 3; ++c)
        factors[cell].factor[c][m] = value[m][c];
  }
}

struct alignas(64) BoxPoints {
  Receivers receivers;
  float x[kPoints], y[kPoints], z[kPoints]; ///< in the box, 0..1
};

DAYLIT_LANE_CLONES
void add_cell(const CellConstants& c, const BoxRadiance& radiance, const BoxPoints& p, float (&sum)[3][kPoints]) {
  const Receivers& r = p.receivers;
  const float n = c.index > 0.0f ? c.index : 1.0f, has_slab = c.index > 0.0f ? 1.0f : 0.0f, inverse_n2 = 1.0f / (n * n);
#pragma omp simd
  for (int k = 0; k < kPoints; ++k) {
    const float dx = c.x - r.x[k], dy = c.y - r.y[k], dz = c.z - r.z[k];
    const float inverse = 1.0f / std::sqrt(dx * dx + dy * dy + dz * dz + 1e-20f);
    const float f = -(c.inward_x * dx + c.inward_y * dy + c.inward_z * dz) * inverse;
    const float q = (r.nx[k] * dx + r.ny[k] * dy + r.nz[k] * dz) * inverse;
    const float facing = f > 0.0f ? f : 0.0f, receiving = q > 0.0f ? q : 0.0f;
    const float weight =
        facing * receiving * c.area * inverse * inverse * (1.0f + has_slab * (slab(facing, n, inverse_n2) - 1.0f));
    const float x = p.x[k], y = p.y[k], z = p.z[k], xy = x * y, xz = x * z, yz = y * z, xyz = xy * z;
    for (int channel = 0; channel < 3; ++channel) {
      const float* a = radiance.factor[channel];
      sum[channel][k] +=
          weight * (a[0] + a[1] * x + a[2] * y + a[3] * xy + a[4] * z + a[5] * xz + a[6] * yz + a[7] * xyz);
    }
  }
}

/// Points of one box; `order` lists them.
void gather_box(std::span<const CellConstants> cells, const Lattice& lattice, int box, const glm::dvec3& origin,
                std::span<const std::uint32_t> order, std::span<const glm::dvec3> x, std::span<const glm::vec3> n,
                std::vector<Rgb>& irradiance) {
  thread_local std::vector<BoxRadiance> factors; // keeps its memory
  find_factors(lattice, box, cells.size(), factors);
  const glm::vec3 low =
      lattice.low + lattice.spacing * glm::vec3(box % lattice.boxes[0], box / lattice.boxes[0] % lattice.boxes[1],
                                                box / (lattice.boxes[0] * lattice.boxes[1]));
  for (std::size_t first = 0; first < order.size(); first += kPoints) {
    const std::size_t count = std::min<std::size_t>(kPoints, order.size() - first);
    BoxPoints points;
    for (std::size_t k = 0; k < kPoints; ++k) {
      const std::uint32_t i = order[first + std::min(k, count - 1)];
      const glm::vec3 p(x[i] - origin), local = (p - low) / lattice.spacing;
      set(points.receivers, static_cast<int>(k), p, n[i]);
      points.x[k] = local.x;
      points.y[k] = local.y;
      points.z[k] = local.z;
    }
    alignas(64) float sum[3][kPoints] = {};
    for (std::size_t c = 0; c < cells.size(); ++c)
      add_cell(cells[c], factors[c], points, sum);
    for (std::size_t k = 0; k < count; ++k)
      irradiance[order[first + k]] = Rgb(sum[0][k], sum[1][k], sum[2][k]);
  }
}

void gather_in_boxes(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells, const glm::dvec3& origin,
                     Lattice& lattice, std::span<const glm::dvec3> x, std::span<const glm::vec3> n,
                     std::vector<Rgb>& irradiance) {
  look_up(pyramid, cells, origin, lattice);
  std::vector<CellConstants> constants;
  for (const ApertureCell& cell : cells)
    constants.push_back(constants_of(cell, pyramid[cell.level], origin));
  const std::size_t boxes = static_cast<std::size_t>(lattice.box_count());
  std::vector<std::uint32_t> box_of(x.size()), first(boxes + 1, 0), order(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    box_of[i] = static_cast<std::uint32_t>(lattice.box_of(glm::vec3(x[i] - origin)));
    ++first[box_of[i] + 1];
  }
  for (std::size_t b = 0; b < boxes; ++b)
    first[b + 1] += first[b];
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < x.size(); ++i)
    order[next[box_of[i]]++] = static_cast<std::uint32_t>(i);
  parallel_for(tbb::blocked_range<std::size_t>(0, boxes), [&](const auto& range) {
    for (std::size_t b = range.begin(); b != range.end(); ++b)
      if (first[b] < first[b + 1])
        gather_box(constants, lattice, static_cast<int>(b), origin, {&order[first[b]], first[b + 1] - first[b]}, x, n,
                   irradiance);
  });
}

} // namespace

std::vector<Rgb> open_sky_irradiance(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                                     std::span<const glm::dvec3> x, std::span<const glm::vec3> n) {
  std::vector<Rgb> irradiance(x.size(), Rgb(0.0f));
  if (cells.empty() || x.empty())
    return irradiance;
  const glm::dvec3 origin = cells[0].centre;
  const auto block = [&](std::size_t first) {
    const int count = static_cast<int>(std::min<std::size_t>(kPoints, x.size() - first));
    Receivers r;
    for (int k = 0; k < kPoints; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(std::min(k, count - 1));
      set(r, k, glm::vec3(x[i] - origin), n[i]);
    }
    gather(pyramid, cells, origin, r, count, &irradiance[first]);
  };
  if (x.size() <= kPoints) {
    block(0);
    return irradiance;
  }
  if (Lattice lattice = make_lattice(cells, origin, x); !lattice.radiance.empty()) {
    gather_in_boxes(pyramid, cells, origin, lattice, x, n, irradiance);
    return irradiance;
  }
  parallel_for(tbb::blocked_range<std::size_t>(0, (x.size() + kPoints - 1) / kPoints, 4), [&](const auto& range) {
    for (std::size_t b = range.begin(); b != range.end(); ++b)
      block(b * kPoints);
  });
  return irradiance;
}

} // namespace daylit
