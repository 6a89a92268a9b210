#pragma once

// The picture by rays on the processor: for machines whose OpenGL is software. Visibility is exact; work is done only
// for pixels that show an object or that some light could reach only through the objects' bounding sphere.

#include <memory>

#include "runtime/picture/picture_renderer.h"

namespace daylit {

struct TraceSettings {
  /// Visibility from the adaptive sampling grid (shading/sampling_grid.h); otherwise every pixel traces every light. A
  /// shadow narrower than four pixels may be missed.
  bool use_grid = true;
};

class TracedRenderer final : public PictureRenderer {
public:
  static Result<TracedRenderer> make(const Room& room, std::span<const Aperture> apertures,
                                     const TraceSettings& settings = {});
  TracedRenderer(TracedRenderer&&) noexcept;
  TracedRenderer& operator=(TracedRenderer&&) noexcept;
  ~TracedRenderer() override;

  Result<void> set_camera(const PinholeCamera& camera) override;
  Result<void> set_objects(const ObjectSurface& objects) override;
  Result<void> set_lights(const LightSet& lights) override;
  Result<std::vector<std::uint32_t>> vertices_in_view() override;
  Result<void> set_vertex_light(std::span<const std::uint32_t> vertices, std::span<const VertexLight> light) override;
  Result<void> draw(RenderedFrame& frame) override;
  bool room_point(int x, int y, RoomSurface& point) const override;
  std::size_t room_parts(int x, int y, std::span<RoomSurfacePart, kMostRoomParts> parts) const override;

  std::uint64_t shadow_rays() const override;
  std::string description() const override;
  std::size_t room_occluders() const override;

private:
  struct State;
  explicit TracedRenderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
