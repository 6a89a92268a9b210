#pragma once

// What a baked volume is judged by: skies of every kind, and the path tracer's indirect light at points of a room under
// each of them.

#include <filesystem>
#include <string>
#include <vector>

#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/room/aperture.h"
#include "scene/room/room.h"
#include "scene/sky/sky.h"
#include "scene/volume/volume.h"
#include "simulate/irradiance.h"

namespace daylit::bench {

struct BenchSky {
  std::string name;
  bool small_sun = false; ///< most of its light may come from a small part of it
  Sky sky;
  SkyLight light; ///< the same for the path tracer
};

/// Overcast, a coloured gradient, CIE clear with the sun at 45 degrees, a small low sun, and the pictures. The suns
/// look in through the largest opening, 20 degrees off its normal.
Result<std::vector<BenchSky>> bench_skies(const std::vector<Aperture>& apertures,
                                          const std::vector<std::filesystem::path>& pictures);

/// Light at the points: coefficients, and the irradiance on the six axes.
struct ReferenceLight {
  std::vector<glm::dvec3> points;
  std::vector<CoefficientEstimate> coefficients;
  std::vector<IrradianceEstimate> irradiance; ///< [point][+x -x +y -y +z -z]
};

/// Points in the air of the room, spread evenly, 0.05 of its longest side off all surfaces.
Result<std::vector<glm::dvec3>> reference_points(const Room& room, const std::vector<Aperture>& apertures,
                                                 std::size_t count);

Result<ReferenceLight> trace_reference(const Room& room, const std::vector<Aperture>& apertures, const BenchSky& sky,
                                       const std::vector<glm::dvec3>& points, int samples, const Progress& progress);

/// Errors of a volume, nrms over points and channels. The noise of the reference is taken out of the coefficients'
/// (its square, from that of the error), because it is of their size.
struct LightError {
  double coefficients = 0, irradiance = 0;
  double coefficient_noise = 0, irradiance_noise = 0; ///< of the reference
  /// Irradiance: what the reference's own coefficients leave, its noise taken out; nine, and with those of l = 4.
  double nine_coefficients = 0, with_band4 = 0;
};
Result<LightError> light_error(const BasisVolume& volume, const BenchSky& sky, const ReferenceLight& reference);

} // namespace daylit::bench
