#pragma once

#include "runtime/trace/traced_scene.h"
#include "runtime/trace/visible_surfaces.h"

namespace daylit {

/// What the sampling grid asks, answered by rays.
class RayVisibility final : public Visibility {
public:
  /// `receives`: per block of the picture, whether light may be lost on its way there.
  RayVisibility(const TracedScene& scene, const VisibleSurfaces& view, std::span<const std::uint8_t> receives)
      : scene_(scene), view_(view), receives_(receives), casters_(scene.casters()) {}

  PixelSurface surface(Layer layer, int x, int y, bool beside_outline) const override;
  std::uint64_t see_sky(Layer layer, PointSet& set) const override;
  std::uint64_t see_sun(Layer layer, const PixelSurface& at, std::span<KnownLights> objects,
                        std::span<KnownLights> room) const override;

private:
  const TracedScene& scene_;
  const VisibleSurfaces& view_;
  std::span<const std::uint8_t> receives_;
  ShadowCasters casters_;
};

} // namespace daylit
