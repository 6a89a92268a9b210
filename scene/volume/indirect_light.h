#pragma once

// The indirect light of a volume under one sky, at any point: interpolated between the probes, and corrected by what
// the surfaces near the point send it of sky and sun.

#include <memory>
#include <optional>
#include <vector>

#include "scene/room/aperture.h"
#include "scene/sky/sky.h"
#include "scene/volume/first_reflection.h"
#include "scene/volume/linear_radiance.h"

namespace daylit {

class IndirectLight {
public:
  /// Keeps references: volume and `scene`, its rays_of_light(), must outlive it. Errors of LightFieldSampler.
  static Result<IndirectLight> make(const BasisVolume& volume, const RayScene& scene, const Sky& sky);

  /// Empty where the volume has no light field. Thread-safe.
  std::optional<ShRadiance> at(const glm::dvec3& world_point) const;

private:
  /// The elements of the volume, and what sky and sun do to them.
  struct LitSurfaces {
    FirstReflection elements;
    ApertureCrossings crossings;
    std::vector<Rgb> stored;           ///< radiance of each element as the volume has it
    LinearRadiance of_sky;             ///< the same without the sun
    std::vector<std::uint8_t> sunlit;  ///< of each element; empty: no small sun
    std::vector<glm::dvec3> direction; ///< points of the sun's disc
    Rgb normal_irradiance{0.0f};
  };
  IndirectLight(const BasisVolume& volume, const RayScene& scene, LightFieldSampler sampler)
      : volume_(&volume), scene_(&scene), sampler_(std::move(sampler)) {}
  void add_surfaces(std::span<const Rgb> node_radiance, const std::optional<SunDisc>& sun);
  Rgb sunlit(const LitSurfaces& lit, const FirstReflection::Element& element, const glm::dvec3& point,
             const glm::dvec3& to_sun) const;
  Rgb sent(const LitSurfaces& lit, std::size_t element, const FirstReflection::Triangle& piece) const;

  const BasisVolume* volume_;
  const RayScene* scene_;
  LightFieldSampler sampler_;
  LightField field_;
  std::shared_ptr<const LitSurfaces> lit_; ///< null: the volume does not name its elements
};

} // namespace daylit
