#pragma once

// The picture by OpenGL: shadow maps of every light, the triangle that every sample shows, and the light of every
// pixel.

#include <memory>

#include "runtime/gl/gl_context.h"
#include "runtime/picture/picture_renderer.h"

namespace daylit {

struct RenderSettings {
  int sky_map_texels = 128; ///< shadow map side for sky samples
  int sun_map_texels = 256; ///< for samples of the sun, which carries most of the light in few samples
  int coverage_samples = 4; ///< per pixel, for object edges
  /// Where the objects are not small in the picture, one pixel of the room in sixteen asks the lights, and those
  /// between only where these do not agree (room_grid.h); false: every pixel asks all.
  bool share_lights = true;
  /// Who draws many small triangles, in shadow maps and of the objects in the picture: the processor where OpenGL is
  /// software, unless said.
  enum class Raster { automatic, opengl, processor } raster = Raster::automatic;
};

class Renderer final : public PictureRenderer {
public:
  static Result<Renderer> make(std::unique_ptr<GlContext> context, const Room& room,
                               std::span<const Aperture> apertures, const RenderSettings& settings = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer() override;

  Result<void> set_camera(const RenderCamera& camera) override;
  Result<void> set_objects(const ObjectSurface& objects) override;
  Result<void> set_lights(const LightSet& lights) override;
  Result<std::vector<std::uint8_t>> vertices_in_view() override; ///< all where OpenGL draws the objects
  Result<void> set_vertex_light(std::span<const VertexLight> light) override;
  Result<void> draw(RenderedFrame& frame) override;
  Result<RenderedFrame> draw();

  bool room_point(int x, int y, RoomSurface& point) const override;

  std::uint64_t shadow_rays() const override { return 0; }
  std::string description() const override;
  std::size_t room_occluders() const override;
  bool is_software() const; ///< the driver draws on the processor

private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
