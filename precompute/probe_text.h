#pragma once

// What daylit-probe reads and prints, line by line.

#include <cstddef>
#include <optional>
#include <string>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/sky/sky_description.h"
#include "scene/volume/sh_layout.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

struct ProbePoint {
  glm::dvec3 position{0.0};         ///< world metres
  glm::dvec3 normal{0.0, 0.0, 1.0}; ///< unit
};

/// `x y z nx ny nz`, or `x y z` without a normal. Numbers are finite, the normal (any length) is not zero.
Result<ProbePoint> parse_probe_point(const std::string& line, std::size_t line_number, bool with_normal);

/// One line with its end; empty optional: outside the room.
std::string irradiance_text(const std::optional<Rgb>& irradiance, bool json);
/// Illuminance in lx: `efficacy` times the luminance of linear Rec. 709 colours; efficacy 1 for skies in cd/m2.
double illuminance(const Rgb& irradiance, double efficacy);
std::string illuminance_text(const std::optional<Rgb>& irradiance, double efficacy, bool json);
/// 27 values, coefficient-major: L00.r L00.g L00.b L1-1.r ...
std::string coefficients_text(const std::optional<Sh9Rgb>& coefficients, bool json);
/// 54: with those of l = 4 behind them, m = -4 to 4.
std::string order4_text(const std::optional<ShRadiance>& radiance, bool json);
/// The same light as 27 values in the order and axes of an engine.
std::string layout_text(const std::optional<Sh9Rgb>& coefficients, ShLayout layout, bool json);
bool is_outside(const std::string& answer, bool json);

/// What the file holds, as one JSON object.
std::string volume_info(const BasisVolume& volume);

} // namespace daylit::precompute
