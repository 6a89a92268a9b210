#pragma once

// The light in a room under given skies, for any reflectances of its materials: the transport of the bake.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/exchange_matrix.h"
#include "radiosity/patches.h"
#include "radiosity/solve.h"
#include "radiosity/surface_mesh.h"
#include "scene/core/program.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"
#include "scene/sky/direct_sky.h"
#include "scene/sky/sky.h"

namespace daylit::calibration {

/// Where a ray meets the room.
struct SurfacePoint {
  glm::dvec3 position{0.0}, normal{0.0}; ///< world metres; unit, on the side that the ray came from
  std::uint32_t material = 0, plane = 0;
  std::int32_t patch = -1; ///< -1: a side that no light of the room reaches, or seen through an opening
};

class RoomTransport {
public:
  /// `room` is kept by reference. Errors: neither window nor hole, a mesh that is too fine, interrupted.
  static Result<std::unique_ptr<RoomTransport>> make(const Room& room, std::vector<Sky> skies,
                                                     const Progress& progress);

  std::size_t skies() const { return skies_.size(); }
  const std::vector<Aperture>& apertures() const { return apertures_.list; }
  /// The first surface on the way; empty: there is none.
  std::optional<SurfacePoint> first_surface(const glm::dvec3& origin, const glm::dvec3& unit_direction) const;
  /// Whether a ray from `origin` crosses an opening first, and the radiance that it then brings.
  std::optional<Rgb> seen_sky(const glm::dvec3& origin, const glm::dvec3& unit_direction, std::size_t sky) const;
  /// Light straight from the sky, radiance unit x sr.
  Rgb direct(const SurfacePoint& at, std::size_t sky) const;
  /// Patches that `rays` cosine-distributed directions from a point meet, -1 where they go out: the indirect irradiance
  /// is the mean of their radiosities, E = integral (B / pi) cos dw. `seed` turns the pattern.
  void gather(const SurfacePoint& at, std::uint32_t seed, std::span<std::int32_t> patches) const;
  /// Radiosity of every patch, columns channel x skies() + sky, for reflectances by material. Error: interrupted.
  Result<radiosity::Radiosity> solve(std::span<const Rgb> reflectance);

private:
  RoomTransport(const Room& room, std::vector<Sky> skies) : room_(room), skies_(std::move(skies)) {}
  Result<void> set_up(const Progress& progress);
  Result<void> light_patches(const Progress& progress);

  const Room& room_;
  std::vector<Sky> skies_;
  std::optional<RayScene> room_rays_, facet_rays_;
  Apertures apertures_;
  std::vector<DirectSky> direct_;
  radiosity::SurfaceMesh mesh_;
  radiosity::PatchSet patches_;
  radiosity::ExchangeMatrix exchange_;
  radiosity::FirstBounce light_;
};

} // namespace daylit::calibration
