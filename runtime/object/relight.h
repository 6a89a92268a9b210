#pragma once

// Indirect light: region radiances to probes, probes to object vertices (Grosch et al. 2007, sections 6.2 and 6.3).

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>

#include "runtime/object/transfer.h"
#include "runtime/sky/direct_light.h"
#include "scene/volume/volume.h"

namespace daylit {

/// Transfer vectors turned from the object's frame into the world; `world_from_object` must be a rotation.
/// `turned`: as many, may be the same memory.
void rotate_transfer(std::span<const VertexTransfer> transfer, const glm::mat3& world_from_object,
                     std::span<VertexTransfer> turned);

/// rho/pi sum_lm L_lm C_lm, never below zero: nine coefficients can ring negative, radiance cannot.
Rgb reflected_radiance(const Sh9Rgb& light, const TransferVector& world_transfer, const Rgb& reflectance);

/// `radiance` with the reflection of a change of light, which may be negative; the sum may not.
Rgb add_reflected(const Rgb& radiance, const Sh9Rgb& change, const TransferVector& world_transfer,
                  const Rgb& reflectance);

/// Which probes light each vertex: found once per placement of the object, because it costs visibility rays.
struct VertexProbes {
  std::array<std::uint32_t, 8> probe{};
  std::array<float, 8> weight{};
  int count = 0; ///< 0: no light field there (outside the room, inside furniture): the vertex gets no indirect light
};
/// Positions in world metres.
std::vector<VertexProbes> find_vertex_probes(const LightFieldSampler& sampler, std::span<const glm::dvec3> positions);

/// A vertex without a light field (inside a wall, below the floor that the object stands on) is seen by nobody, but it
/// is interpolated into triangles that are: it takes the probes of the nearest vertex along the mesh that has some,
/// counted in edges. An object that has none anywhere stays dark. Returns how many had none.
std::size_t spread_vertex_probes(std::span<const std::array<std::uint32_t, 3>> triangles,
                                 std::vector<VertexProbes>& probes);

/// Reflected radiance on both sides of the surface.
struct TwoSided {
  Rgb front{0.0f}, back{0.0f};
};

/// Nine coefficients can ring: where an irradiance came out negative it was drawn as none.
struct Ringing {
  std::size_t vertices = 0;    ///< at which some channel was
  double added_fraction = 0.0; ///< light so added / indirect light of all vertices
};

/// L_lm(x) = sum_k w_k L_lm,k of the probes around.
std::vector<Sh9Rgb> light_between(const LightField& field, std::span<const VertexProbes> probes);

/// relight_vertices() of one vertex to which `light` comes from the room.
TwoSided relight_vertex(const Sh9Rgb& light, const VertexTransfer& world_transfer, const Rgb& reflectance);

/// Per vertex, reflected radiance of the indirect `light` that the room sends; all spans have one entry per vertex.
std::vector<TwoSided> relight_vertices(std::span<const Sh9Rgb> light, std::span<const VertexTransfer> world_transfer,
                                       std::span<const Rgb> reflectance, Ringing* ringing = nullptr);

} // namespace daylit
