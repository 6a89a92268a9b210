#pragma once

// Radiance maps blurred by a Phong lobe, for glossy and diffuse reflection by one look-up (Kautz & McCool 2000;
// Unterguggenberger 2016, chapter 4):
//   L_s(r) = sum_i max(0, w_i . r)^s L_i / sum_i max(0, w_i . r)^s     over all texels i, which are of equal solid
//   angle,
// the mean of the radiance under a lobe about r. s = 1: irradiance / pi for the normal r. Dividing by the sum of the
// weights (algorithm 4.1 there) keeps a constant map constant whatever its side.
//
// Three methods, one interface; figures of error and time: docs/maps.md.

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "runtime/maps/radiance_map.h"
#include "scene/core/result.h"

namespace daylit {

enum class PrefilterMethod {
  exact,     ///< the sum; what cannot change it by `tolerance` is skipped, what is smooth is summed at fewer points
  mip_chain, ///< importance samples of the lobe, each read from the level of the map that is as coarse as it is wide
  harmonics, ///< product of spherical harmonics, up to the degree at which `tolerance` is met
};

/// A blurred map that is wanted.
struct Lobe {
  double exponent = 1.0; ///< s, from 1 to kMaxExponent
  int side = 0;          ///< of the result, texels: a power of two from 4 to kMaxMapSide
};
inline constexpr double kMaxExponent = 100000.0;

/// Part of a result: texels of the map of a lobe, by their index. A tile of the exact method is compact on the sphere.
struct MapTile {
  std::size_t lobe = 0;
  std::span<const std::uint32_t> texels;
};

struct PrefilterOptions {
  /// exact: largest error of a texel relative to itself, or to a millionth of the map's mean where that is more.
  /// harmonics: mean error of a texel relative to itself. mip_chain has a fixed number of samples.
  double tolerance = 1e-5;
  /// Asked between tiles; the call then returns ErrorCode::interrupted.
  std::stop_token stop;
  /// Called when a tile of the result is complete, from several threads, tiles in any order; the texels may be read
  /// during the call. exact and mip_chain work tile by tile, harmonics map by map.
  std::function<void(const MapTile&, const RadianceMap&)> tile_done;
};

/// One map per lobe. Results are the same for any number of threads. Nowhere negative: what truncated harmonics swing
/// below zero beside a bright light is set to zero, and counts in their error.
Result<std::vector<RadianceMap>> prefilter(const RadianceMap& source, std::span<const Lobe> lobes,
                                           PrefilterMethod method, const PrefilterOptions& options = {});

/// The sum as it is written above, in double, at some unit directions: the slow twin of all three. [direction]
std::vector<glm::dvec3> plain_prefilter(const RadianceMap& source, double exponent,
                                        std::span<const glm::dvec3> directions);

} // namespace daylit
