#pragma once

// Sixteen sunlit points at a time as a vertex sees them, compiled for several instruction sets. Plain loops over lanes:
// straight-line selections instead of branches, so that the compiler makes vectors of them.

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "runtime/object/transfer.h"

namespace daylit::sunlit {

constexpr int kLanes = 16;

/// Points and unit normals, metres from an origin near the object, and 1 / (twice the spacing). Lanes of zeros send
/// nothing.
struct alignas(64) Points {
  float x[kLanes] = {}, y[kLanes] = {}, z[kLanes] = {};
  float nx[kLanes] = {}, ny[kLanes] = {}, nz[kLanes] = {};
  float per_reach[kLanes] = {};
};

/// A side of a vertex, and the surfaces that are known otherwise (SurfacesKnown), metres from that origin.
struct Receiver {
  glm::vec3 position;
  glm::mat3 world_from_local; ///< SenderSide's
  const TransferVector& transfer;
  glm::vec3 known_centre;
  float per_known_reach; ///< 1 / m; very large: nothing is known
};

/// Of each point: what a unit of its power sends there, 1 / m^2, if the receiver faces it (0: nothing); its direction
/// in the receiver's frame, whose z is the cosine; and what nine coefficients take for the cosine.
struct alignas(64) Views {
  float weight[kLanes], x[kLanes], y[kLanes], z[kLanes], coefficients[kLanes];
};

void view(const Points& points, const Receiver& receiver, Views& views);

} // namespace daylit::sunlit
