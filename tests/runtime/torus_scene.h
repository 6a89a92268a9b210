#pragma once

// A torus on the floor of the small room, drawn by rays.

#include <algorithm>

#include "runtime/trace/traced_renderer.h"
#include "test_scene.h"

namespace daylit::test {

constexpr int kWidth = 128, kHeight = 124; ///< of its picture, pixels

struct TorusScene {
  Room room = box_room();
  std::vector<Aperture> windows = box_window();
  ObjectSurface object = place(torus(0.15f, 0.07f, 160, 80), {2.0, 3.4, 0.23}, 1.2);
  SkyMap sky = overcast_sky();
  std::optional<DetectedSun> sun;
  RenderCamera camera = look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2}, kWidth, kHeight, 0.6);
  int samples = 64; ///< of the sky
  std::vector<SkyMap> pyramid;
  LightSet lights;
  std::vector<ApertureCell> cells;

  Result<RenderedFrame> render(PictureRenderer& renderer) {
    pyramid = sky_map_pyramid(sky);
    const BoundingSphere sphere = object.bounds();
    lights = sample_lights(sky, sun, windows, sphere, samples);
    cells = aperture_cells(windows, sphere, pyramid);
    const std::vector<Rgb> open = open_sky_irradiance(pyramid, cells, object.positions, object.normals);
    std::vector<VertexLight> light(open.size());
    for (std::size_t i = 0; i < open.size(); ++i)
      light[i].open_sky_front = open[i];
    RenderedFrame frame;
    for (const auto& step : {renderer.set_camera(camera), renderer.set_objects(object), renderer.set_lights(lights),
                             renderer.set_vertex_light(every_vertex(light.size()), light), renderer.draw(frame)})
      if (!step)
        return step.error();
    return frame;
  }
  Result<RenderedFrame> trace(bool use_grid = true) {
    auto renderer = TracedRenderer::make(room, windows, {use_grid});
    return renderer ? render(*renderer) : renderer.error();
  }
};

inline DetectedSun sun_through_the_window() {
  DetectedSun sun;
  sun.direction = glm::normalize(glm::dvec3(0.1, 1.6, 1.3));
  sun.normal_irradiance = Rgb(5.0f);
  return sun;
}

inline DrawnPixel at(const RenderedFrame& frame, int x, int y) {
  return frame.shown(x, y) ? frame.at(x, y) : DrawnPixel{};
}

} // namespace daylit::test
