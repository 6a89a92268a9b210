#pragma once

// The nine coefficients of a light field as other renderers store them. Documented in docs/interchange.md.

#include <array>

#include <glm/vec3.hpp>

#include "scene/volume/volume.h"

namespace daylit {

enum class ShLayout { unity, unreal, three };

/// Radiance coefficients (world frame: right-handed, z up) as 27 numbers in the order and frame of the engine.
/// unity:  SphericalHarmonicsL2, channel by channel; left-handed, y up: (x, z, y). Cosine lobe / pi and the constants
///         of the basis are inside: the polynomial s0 + s1 y + s2 z + s3 x + s4 xy + s5 yz + s6 (3zz - 1) + s7 xz +
///         s8 (xx - yy) is E / pi.
/// unreal: FSHVectorRGB3, channel by channel; left-handed, z up: (x, -y, z). Radiance; the basis has the sign of the
///         Condon-Shortley phase: odd m negative.
/// three:  SphericalHarmonics3 of three.js, coefficient by coefficient; right-handed, y up: (x, z, -y). Radiance, the
///         basis of daylit.
std::array<float, 27> to_engine(const Sh9Rgb& radiance, ShLayout layout);

/// A direction of daylit's world in the engine's axes.
glm::dvec3 engine_axes(const glm::dvec3& d, ShLayout layout);

} // namespace daylit
