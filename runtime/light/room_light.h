#pragma once

// Light that the real room receives without the virtual objects: what the composite compares the lost light with.

#include <memory>
#include <optional>
#include <span>

#include <glm/vec3.hpp>

#include "runtime/light/direct_light.h"
#include "runtime/render/compose.h"
#include "scene/ray_scene.h"
#include "scene/volume.h"

namespace daylit {

/// Keeps references to everything given; they must outlive it. Thread-safe.
class RoomLight {
public:
  RoomLight(const Room& room, std::span<const Aperture> apertures, const RayScene& room_rays,
            const LightFieldSampler& sampler)
      : room_(room), apertures_(apertures), rays_(room_rays), sampler_(sampler) {}

  /// The light of one frame.
  void set_frame(const LightField& field, std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                 const LightSet& lights);

  /// Light at the surface that a ray from the camera meets first; empty where it leaves the room.
  std::optional<RoomPoint> at(const glm::dvec3& eye, const glm::dvec3& direction) const;

private:
  const Room& room_;
  std::span<const Aperture> apertures_;
  const RayScene& rays_;
  const LightFieldSampler& sampler_;
  const LightField* field_ = nullptr;
  std::span<const SkyMap> pyramid_;
  std::span<const ApertureCell> cells_;
  Rgb sun_normal_irradiance_{0.0f};
};

} // namespace daylit
