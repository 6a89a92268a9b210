#pragma once

// The indirect light of a volume under one sky, at any point: interpolated between the probes, and close to a sun patch
// corrected by the patch itself.

#include <memory>
#include <optional>
#include <vector>

#include "scene/room/aperture.h"
#include "scene/sky/sky.h"
#include "scene/volume/first_reflection.h"

namespace daylit {

class IndirectLight {
public:
  /// Keeps references: volume and `scene`, the reflecting surfaces of its room, must outlive it. Errors of
  /// LightFieldSampler.
  static Result<IndirectLight> make(const BasisVolume& volume, const RayScene& scene, const Sky& sky);

  /// Empty where the volume has no light field. Thread-safe.
  std::optional<ShRadiance> at(const glm::dvec3& world_point) const;

private:
  /// The sun, and what it does to the elements of the volume.
  struct SunPatch {
    FirstReflection surfaces;
    ApertureCrossings crossings;
    std::vector<glm::dvec3> direction; ///< points of its disc
    Rgb normal_irradiance{0.0f};
    std::vector<Rgb> stored; ///< radiance of each element
  };
  IndirectLight(const BasisVolume& volume, const RayScene& scene, LightFieldSampler sampler)
      : volume_(&volume), scene_(&scene), sampler_(std::move(sampler)) {}
  void add_sun(const SunDisc& sun);
  Rgb sunlit(const SunPatch& patch, std::size_t element, const glm::dvec3& point) const;

  const BasisVolume* volume_;
  const RayScene* scene_;
  LightFieldSampler sampler_;
  LightField field_;
  std::shared_ptr<const SunPatch> sun_; ///< null: none, or the volume does not name its elements
};

} // namespace daylit
