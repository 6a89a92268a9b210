#pragma once

// Smooth boundaries between two transparent materials (Fresnel 1823).

#include <optional>

#include <glm/vec3.hpp>

namespace daylit {

/// Part of unpolarised light that the boundary reflects. `cosine` of the angle to the normal on the side the light
/// comes from, negative from inside; `ior`: refractive index inside over outside, > 0. 1: all of it (total reflection).
float fresnel_dielectric(float cosine, float ior);

/// Index of a boundary that reflects part `face_on` of light that comes along its normal: ((n - 1) / (n + 1))^2. At
/// most 199.
float ior_of(float face_on);

/// Mean of fresnel_dielectric() over light from everywhere outside: the integral of 2 c F(c).
float mean_fresnel(float ior);

/// Direction behind the boundary with normal `h` for a ray that leaves along `w`, w.h > 0, where the index behind is
/// `ior` times that in front (Snell 1621). Empty: total reflection.
std::optional<glm::vec3> refracted(const glm::vec3& w, const glm::vec3& h, float ior);

} // namespace daylit
