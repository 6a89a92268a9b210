#pragma once

// The picture by OpenGL 4.5: one shadow map per light, the triangle that every sample shows, and one lighting pass in
// which every pixel evaluates all lights. The picture is read back once, at the end.

#include <memory>

#include "runtime/gl/gl_context.h"
#include "runtime/picture/picture_renderer.h"

namespace daylit {

struct RenderSettings {
  int map_texels = 256;     ///< side of a shadow map
  int coverage_samples = 4; ///< per pixel, for object edges; as many as the driver can
};

class Renderer final : public PictureRenderer {
public:
  static Result<Renderer> make(std::unique_ptr<GlContext> context, const Room& room,
                               std::span<const Aperture> apertures, const RenderSettings& settings = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer() override;

  Result<void> set_camera(const PinholeCamera& camera) override;
  Result<void> set_objects(const ObjectSurface& objects) override;
  /// Error limit_exceeded: more than the driver's layers of a texture.
  Result<void> set_lights(const LightSet& lights) override;
  Result<std::vector<std::uint32_t>> vertices_in_view() override; ///< all
  Result<void> set_vertex_light(std::span<const std::uint32_t> vertices, std::span<const VertexLight> light) override;
  Result<void> draw(RenderedFrame& frame) override;
  bool room_point(int x, int y, RoomSurface& point) const override;

  std::uint64_t shadow_rays() const override { return 0; }
  std::string description() const override;
  std::size_t room_occluders() const override;

private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
