#pragma once

// Direct skylight by brute force: stratified points on the panes, the analytic sky behind them, one visibility ray
// each. Shares neither samples, maps, cells, planes nor packets with runtime/.

#include <memory>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/render/picture_renderer.h"
#include "runtime/render/render_camera.h"
#include "scene/ray_scene.h"
#include "scene/room.h"
#include "scene/sky_model.h"

namespace daylit::bench {

/// A point of an object as a pixel shows it.
struct SeenPoint {
  int x = 0, y = 0;
  glm::dvec3 position{0.0}, normal{0.0}; ///< interpolated between the vertices
  Rgb reflectance{0.0f};
};

class DirectLightReference {
public:
  static Result<DirectLightReference> make(const Room& room, std::span<const Aperture> apertures,
                                           const ObjectSurface& object);

  /// Pixels `stride` apart that show the front of the object, all neighbours included.
  std::vector<SeenPoint> seen_points(const RenderCamera& camera, int stride) const;
  /// Irradiance from the sky; `side` x `side` points per pane.
  Rgb irradiance(const SeenPoint& at, const AnalyticSky& sky, int side) const;
  /// Equation 7 of Grosch et al. 2007: the lights that arrive, with nothing known of those that do not.
  Rgb irradiance(const SeenPoint& at, std::span<const DirectionalLight> lights) const;

private:
  struct State;
  bool open(const SeenPoint& at, const glm::dvec3& w) const;
  std::shared_ptr<const State> state_;
};

} // namespace daylit::bench
