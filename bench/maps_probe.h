#pragma once

// The probes of `daylit-bench maps`, as an octahedral map and as the thesis' angular map.

#include <string>

#include "bench/angular_map.h"
#include "runtime/maps/radiance_map.h"
#include "scene/core/result.h"

namespace daylit::bench {

inline constexpr int kProbeSide = 512;

/// A light probe in both layouts. Frame: x right, y up, z forward.
struct Probe {
  std::string name;
  RadianceMap map;    ///< kProbeSide texels a side; 16 samples of the picture to a texel
  AngularMap angular; ///< kProbeSide pixels across, 16 samples to a pixel
  AngularMap texels;  ///< the texels of `map`, for references that take pixels
  double largest_over_mean = 0.0;
};

/// An angular map (square) or a vertical cross of cube faces (3 x 4), Radiance .hdr or EXR.
Result<Probe> read_probe(const std::string& path);

/// A room of the size of an office: two windows with a sky of 20 to 60 times the walls, the sun of 0.53 degrees through
/// one of them, its patch on the floor, lamps. Nothing is random.
Probe generated_probe();

} // namespace daylit::bench
