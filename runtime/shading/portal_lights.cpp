#include "runtime/shading/portal_lights.h"

#include <algorithm>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/shading/lane_kernels.h"
#include "scene/room/glass.h"

namespace daylit {

static_assert(sizeof(PortalLight) == 32 && sizeof(Portal) == 32, "std430 layout of shaders/portal_lights.glsl");

namespace {

/// The aperture's own plane, and planes through its edges along w with normals edge x w, turned to its middle.
void append_planes(const Aperture& a, const glm::dvec3& w, const glm::dvec3& origin, std::vector<glm::vec4>& planes) {
  const auto append = [&](const glm::dvec3& n, const glm::dvec3& on_plane) {
    if (const double length = glm::length(n); length > 0.0)
      planes.emplace_back(glm::vec3(n / length), static_cast<float>(-glm::dot(n, on_plane - origin) / length));
  };
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& c : a.corners)
    middle += c / static_cast<double>(a.corners.size());
  append(a.inward, a.corners[0]);
  for (std::size_t k = 0; k < a.corners.size(); ++k) {
    const glm::dvec3 corner = a.corners[k], edge = a.corners[(k + 1) % a.corners.size()] - corner;
    const glm::dvec3 n = glm::cross(edge, w);
    append(glm::dot(n, middle - corner) < 0.0 ? -n : n, corner);
  }
}

} // namespace

void PointBlock::set(int k, const glm::vec3& p, const glm::vec3& n) {
  x[k] = p.x;
  y[k] = p.y;
  z[k] = p.z;
  nx[k] = n.x;
  ny[k] = n.y;
  nz[k] = n.z;
}

void PointBlock::close(int count) {
  for (int k = count; k < kLanes; ++k)
    set(k, {x[0], y[0], z[0]}, glm::vec3(0.0f));
  lanes = (1u << count) - 1u;
  glm::vec3 lo(x[0], y[0], z[0]), hi = lo;
  for (int k = 0; k < kLanes; ++k) {
    const glm::vec3 p(x[k], y[k], z[k]);
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  }
  centre = 0.5f * (lo + hi);
  radius = 0.5f * glm::length(hi - lo) * 1.0001f;
}

PortalLights::PortalLights(std::span<const DirectionalLight> lights, std::span<const Aperture> apertures,
                           const glm::dvec3& origin) {
  for (const DirectionalLight& l : lights) {
    PortalLight light{glm::vec3(l.direction), static_cast<std::uint32_t>(portals_.size()), l.irradiance, 0};
    for (const Aperture& a : apertures) {
      const double cos_incidence = -glm::dot(a.inward, l.direction);
      if (cos_incidence <= 0.0 || a.corners.size() < 3)
        continue;
      const auto first = static_cast<std::uint32_t>(planes_.size());
      append_planes(a, l.direction, origin, planes_);
      portals_.push_back({pane_transmittance(a, cos_incidence), first, static_cast<std::uint32_t>(planes_.size())});
    }
    light.last_portal = static_cast<std::uint32_t>(portals_.size());
    lights_.push_back(light);
  }
  for (std::size_t first = 0; first < lights_.size(); first += kLanes) {
    DirectionBlock& block = blocks_.emplace_back();
    for (std::size_t k = 0; k < kLanes; ++k) {
      const glm::vec3& w = lights_[std::min(first + k, lights_.size() - 1)].direction;
      block.x[k] = w.x;
      block.y[k] = w.y;
      block.z[k] = w.z;
    }
  }
}

LaneMask PortalLights::received(std::size_t light, const PointBlock& points, LaneRgb& e) const {
  const PortalLight& l = lights_[light];
  return points.lanes & lanes::receive(points, l.direction,
                                       portals().subspan(l.first_portal, l.last_portal - l.first_portal),
                                       planes_.data(), e);
}

} // namespace daylit
