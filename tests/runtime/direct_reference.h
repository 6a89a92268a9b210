#pragma once

// The slow twin of the direct light in the shaders: the same lights and cells, visibility by rays in place of maps.

#include <limits>

#include "runtime/gl/renderer.h"
#include "runtime/sky/direct_light.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"

namespace daylit::test {

struct DirectIrradiance {
  Rgb without{0.0f}; ///< past the room alone
  Rgb with{0.0f};    ///< past room and object
};

class DirectReference {
public:
  DirectReference(const Room& room, std::vector<Aperture> apertures, const ObjectSurface& object)
      : room_(*RayScene::build(room)), object_(*RayScene::build(object.positions, object.triangles)),
        apertures_(std::move(apertures)) {}

  /// The estimate of runtime/sky/direct_light.h.
  DirectIrradiance estimate(const LightSet& lights, std::span<const SkyMap> map, std::span<const ApertureCell> cells,
                            const glm::dvec3& x, const glm::dvec3& n) const {
    const Sums sky = sum(lights.sky, x, n), sun = sum(lights.sun, x, n);
    const Rgb open = open_sky_irradiance(map, cells, x, n);
    DirectIrradiance e;
    for (int c = 0; c < 3; ++c) {
      const float whole = sky.unblocked[c];
      e.without[c] = (whole > 0 ? open[c] * sky.past_room[c] / whole : open[c]) + sun.past_room[c];
      e.with[c] = (whole > 0 ? open[c] * sky.past_both[c] / whole : open[c]) + sun.past_both[c];
    }
    return e;
  }

  /// Without samples: every cell of a fine grid on the apertures is tested by a ray; the sun by its own lights.
  DirectIrradiance exact(std::span<const SkyMap> map, std::span<const ApertureCell> fine_cells,
                         const std::vector<DirectionalLight>& sun, const glm::dvec3& x, const glm::dvec3& n) const {
    const Sums s = sum(sun, x, n);
    DirectIrradiance e{s.past_room, s.past_both};
    for (const ApertureCell& cell : fine_cells) {
      const Rgb part = open_sky_irradiance(map, {&cell, 1}, x, n);
      if (part == Rgb(0.0f))
        continue;
      const glm::dvec3 w = glm::normalize(cell.centre - x);
      if (blocked(room_, x, w, n))
        continue;
      e.without += part;
      if (!blocked(object_, x, w, n))
        e.with += part;
    }
    return e;
  }

private:
  struct Sums {
    Rgb unblocked{0.0f}, past_room{0.0f}, past_both{0.0f};
  };

  static bool blocked(const RayScene& scene, const glm::dvec3& x, const glm::dvec3& w, const glm::dvec3& n) {
    return scene.occluded(scene.to_local(x + 1e-4 * n), glm::vec3(w), scene.surface_offset(),
                          std::numeric_limits<float>::infinity());
  }

  Sums sum(const std::vector<DirectionalLight>& lights, const glm::dvec3& x, const glm::dvec3& n) const {
    Sums s;
    for (const DirectionalLight& l : lights) {
      const double c = glm::dot(n, l.direction);
      int crossed = 0;
      if (c <= 0)
        continue;
      const Rgb t =
          aperture_transmittance(apertures_, x, l.direction, std::numeric_limits<double>::infinity(), &crossed);
      if (crossed == 0)
        continue;
      const Rgb e = l.irradiance * static_cast<float>(c) * t;
      s.unblocked += e;
      if (blocked(room_, x, l.direction, n))
        continue;
      s.past_room += e;
      if (!blocked(object_, x, l.direction, n))
        s.past_both += e;
    }
    return s;
  }

  RayScene room_, object_;
  std::vector<Aperture> apertures_;
};

} // namespace daylit::test
