#pragma once

// The window integral for sixteen points at a time, compiled for several instruction sets. Plain loops over lanes:
// straight-line selections instead of branches, so that the compiler makes vectors of them.

#include <glm/vec3.hpp>

#include "runtime/sky/direct_light.h"

namespace daylit::open_sky {

constexpr int kLanes = 16;

/// Points and unit normals, metres from a common origin.
struct alignas(64) Receivers {
  float x[kLanes], y[kLanes], z[kLanes], nx[kLanes], ny[kLanes], nz[kLanes];

  void set(int k, const glm::vec3& p, const glm::vec3& n) {
    x[k] = p.x, y[k] = p.y, z[k] = p.z;
    nx[k] = n.x, ny[k] = n.y, nz[k] = n.z;
  }
};

/// An aperture cell, relative to that origin, and the size of the map that it shows.
struct CellConstants {
  float x, y, z, inward_x, inward_y, inward_z, area, index, width, height;

  CellConstants(const ApertureCell& cell, const SkyMap& map, const glm::dvec3& origin);
};

/// Per receiver: its weight for the radiance through the cell, sr, and where on the map that is, in texels measured
/// from texel centres. `distance2`: to its middle, squared.
struct alignas(64) CellView {
  float weight[kLanes], u[kLanes], v[kLanes], distance2[kLanes];
};
void view_cell(const CellConstants& cell, const Receivers& receivers, CellView& view);

/// Radiance through a cell in a box: sum over m of factor[c][m] times (1, x, y, xy, z, xz, yz, xyz), x, y, z in 0..1.
struct BoxRadiance {
  float factor[3][8];
};
/// Receivers and where they lie in the box.
struct alignas(64) BoxPoints {
  Receivers receivers;
  float x[kLanes], y[kLanes], z[kLanes];
};
/// Adds weight x radiance to the irradiance of each receiver, per channel.
void add_cell(const CellConstants& cell, const BoxRadiance& radiance, const BoxPoints& points, float (&sum)[3][kLanes]);

} // namespace daylit::open_sky
