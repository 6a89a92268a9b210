#include "scene/room/dark_room.h"

#include <limits>

#include <glm/geometric.hpp>

#include "scene/core/orthonormal.h"
#include "scene/core/r2_points.h"
#include "scene/room/aperture.h"

namespace daylit {

namespace {

constexpr std::uint32_t kWalks = 64, kRays = 32;
constexpr double kSide_m = 1.2, kHeight_m = 1.5;
constexpr float kFar = std::numeric_limits<float>::infinity();

} // namespace

bool is_in_dark_room(const RayScene& scene, const Room& room, const std::vector<Aperture>& apertures,
                     const glm::dvec3& point) {
  const double off_m = 8.0 * static_cast<double>(scene.surface_offset());
  Bounds seen;
  for (std::uint32_t walk = 0; walk < kWalks; ++walk) {
    glm::dvec3 p = point, normal(0.0, 0.0, walk % 2 == 0 ? 1.0 : -1.0);
    for (std::uint32_t k = 0; k < kRays; ++k) {
      const glm::dvec3 d = cosine_direction(normal, r2_point(kRays * walk + k, glm::dvec2(0.5)));
      RayHit hit;
      if (!scene.closest(scene.to_local(p), glm::vec3(d), 0.0f, kFar, hit))
        return false;
      int crossed = 0;
      aperture_transmittance(apertures, p, d, static_cast<double>(hit.distance), &crossed);
      if (crossed > 0)
        return false;
      normal = glm::normalize(area_normal(room, room.triangles[hit.triangle]));
      normal = glm::dot(normal, d) < 0.0 ? normal : -normal;
      p += static_cast<double>(hit.distance) * d + off_m * normal;
      seen.include(p);
    }
  }
  const glm::dvec3 size = seen.size();
  return size.x >= kSide_m && size.y >= kSide_m && size.z >= kHeight_m;
}

} // namespace daylit
