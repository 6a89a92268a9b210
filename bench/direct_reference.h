#pragma once

// Direct skylight by brute force: stratified points on the panes, the analytic sky behind them, one visibility ray
// each. Shares neither samples, maps, cells, planes nor packets with runtime/.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/picture/picture_renderer.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"
#include "scene/sky/sky_model.h"

namespace daylit::bench {

/// A point of an object.
struct SeenPoint {
  glm::dvec3 position{0.0}, normal{0.0}; ///< interpolated between the vertices
  Rgb reflectance{0.0f};
};
/// A pixel shows the mean of what lies in it: creases are narrower than a pixel.
struct SeenPixel {
  int x = 0, y = 0;
  std::vector<SeenPoint> points;
};

class DirectLightReference {
public:
  static Result<DirectLightReference> make(const Room& room, std::span<const Aperture> apertures,
                                           const ObjectSurface& object);

  /// Pixels `stride` apart that show the front of the object, all neighbours within two pixels included, by
  /// `side` x `side` stratified points each; one: their centres.
  std::vector<SeenPixel> seen_pixels(const RenderCamera& camera, int stride, int side) const;
  /// Irradiance from the sky; `side` x `side` points per pane, placed by `seed`.
  Rgb irradiance(const SeenPoint& at, const AnalyticSky& sky, int side, std::uint32_t seed) const;
  /// Equation 7 of Grosch et al. 2007: the lights that arrive, with nothing known of those that do not.
  Rgb irradiance(const SeenPoint& at, std::span<const DirectionalLight> lights) const;

private:
  struct State;
  bool seen(const glm::dvec3& eye, const glm::dvec3& w, SeenPoint& point) const;
  bool open(const SeenPoint& at, const glm::dvec3& w) const;
  std::shared_ptr<const State> state_;
};

} // namespace daylit::bench
