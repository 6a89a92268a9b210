#pragma once

// Indirect light: region radiances to probes, probes to object vertices (Grosch et al. 2007, sections 6.2 and 6.3).

#include <span>
#include <vector>

#include <glm/mat3x3.hpp>

#include "runtime/object/transfer.h"
#include "scene/volume.h"

namespace daylit {

/// Transfer vectors turned from the object's frame into the world; `world_from_object` must be a rotation.
std::vector<TransferVector> rotate_transfer(std::span<const TransferVector> transfer,
                                            const glm::mat3& world_from_object);

/// rho/pi sum_lm L_lm C_lm, never below zero: nine coefficients can ring negative, radiance cannot.
Rgb reflected_radiance(const Sh9Rgb& light, const TransferVector& world_transfer, const Rgb& reflectance);

struct IndirectLight {
  std::vector<Rgb> radiance; ///< reflected, per vertex
  std::size_t outside = 0;   ///< vertices with no light field (outside the room, inside furniture): they are dark
};

/// All spans have one entry per vertex; positions in world metres.
IndirectLight relight_vertices(const LightFieldSampler& sampler, const LightField& field,
                               std::span<const glm::dvec3> positions, std::span<const TransferVector> world_transfer,
                               std::span<const Rgb> reflectance);

} // namespace daylit
