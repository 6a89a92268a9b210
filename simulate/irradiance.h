#pragma once

// The oracle: irradiance and SH coefficients at points of a room by path tracing, with standard errors.

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/volume/volume.h"
#include "simulate/trace_scene.h"

namespace daylit {

struct Receiver {
  glm::dvec3 position{0.0};         ///< world metres, in the air
  glm::dvec3 normal{0.0, 0.0, 1.0}; ///< unit; not used for coefficients
};

struct IrradianceSettings {
  int samples = 8192; ///< paths per receiver, at least kBatches
  std::uint32_t seed = 0;
  bool indirect = true; ///< light from surfaces
  bool direct = false;  ///< light that comes straight through the openings
};

/// Independent batches whose spread gives the standard error; each is one scrambled low-discrepancy set.
constexpr int kBatches = 16;

struct IrradianceEstimate {
  Rgb value{0.0f};          ///< radiance unit x sr
  Rgb standard_error{0.0f}; ///< of value, from kBatches batches (15 degrees of freedom)
};
struct CoefficientEstimate {
  Sh9Rgb value{}, standard_error{};
  Band4Rgb band4{}, band4_error{}; ///< of Y_4m, index m + 4: value and standard error
};

/// Same settings, same bits, for any number of threads. Error: interrupted, or samples < kBatches.
Result<std::vector<IrradianceEstimate>> trace_irradiance(const TraceScene& scene, std::span<const Receiver> receivers,
                                                         const IrradianceSettings& settings,
                                                         const Progress& progress = {});
/// L_lm, l = 0, 1, 2 and 4, of the radiance that arrives at the receivers' positions.
Result<std::vector<CoefficientEstimate>> trace_coefficients(const TraceScene& scene,
                                                            std::span<const Receiver> receivers,
                                                            const IrradianceSettings& settings,
                                                            const Progress& progress = {});

} // namespace daylit
