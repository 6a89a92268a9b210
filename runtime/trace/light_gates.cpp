#include "runtime/trace/light_gates.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "scene/glass.h"

#define DAYLIT_LANE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

namespace daylit {

namespace {

struct Half {
  glm::dvec3 normal{0.0};
  double offset = 0.0;
};

/// Planes through the edges of the aperture along w, and the aperture's own plane; inside positive.
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

DAYLIT_LANE_CLONES
void lane_cosines(const PointBlock& p, const glm::vec3& w, float* c) {
  for (int k = 0; k < kLanes; ++k) {
    const float d = p.nx[k] * w.x + p.ny[k] * w.y + p.nz[k] * w.z;
    c[k] = d > 0.0f ? d : 0.0f;
  }
}

/// inside[k] = 1 where the lane is on the positive side of all planes, else 0.
DAYLIT_LANE_CLONES
void lanes_inside(const PointBlock& p, const glm::vec4* planes, std::size_t count, float* inside) {
  for (int k = 0; k < kLanes; ++k)
    inside[k] = 1.0f;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec4 q = planes[i];
    for (int k = 0; k < kLanes; ++k)
      inside[k] = p.x[k] * q.x + p.y[k] * q.y + p.z[k] * q.z + q.w >= 0.0f ? inside[k] : 0.0f;
  }
}

/// Multiplies in a pane where it is crossed.
DAYLIT_LANE_CLONES
void cross_pane(const float* inside, const Rgb& t, float (&product)[3][kLanes], float* crossed) {
  for (int k = 0; k < kLanes; ++k) {
    product[0][k] *= inside[k] > 0.0f ? t.r : 1.0f;
    product[1][k] *= inside[k] > 0.0f ? t.g : 1.0f;
    product[2][k] *= inside[k] > 0.0f ? t.b : 1.0f;
    crossed[k] = std::max(crossed[k], inside[k]);
  }
}

enum class Side { outside, across, inside };

Side side_of(const PointBlock& p, std::span<const glm::vec4> planes) {
  Side side = Side::inside;
  for (const glm::vec4& q : planes) {
    const float d = glm::dot(glm::vec3(q), p.centre) + q.w;
    if (d < -p.radius)
      return Side::outside;
    if (d < p.radius)
      side = Side::across;
  }
  return side;
}

} // namespace

void PointBlock::bound() {
  glm::vec3 lo(x[0], y[0], z[0]), hi = lo;
  for (int k = 0; k < kLanes; ++k) {
    lo = glm::vec3(std::min(lo.x, x[k]), std::min(lo.y, y[k]), std::min(lo.z, z[k]));
    hi = glm::vec3(std::max(hi.x, x[k]), std::max(hi.y, y[k]), std::max(hi.z, z[k]));
  }
  centre = 0.5f * (lo + hi);
  radius = 0.5f * glm::length(hi - lo) * 1.0001f;
}

LightGates::LightGates(std::span<const DirectionalLight> lights, std::span<const Aperture> apertures,
                       const glm::dvec3& origin) {
  for (const DirectionalLight& l : lights) {
    Light light{glm::vec3(l.direction), l.irradiance, static_cast<std::uint32_t>(gates_.size()), 0};
    for (const Aperture& a : apertures) {
      const double approach = -glm::dot(a.inward, l.direction);
      if (approach <= 0.0 || a.corners.size() < 3)
        continue;
      Gate gate;
      gate.first = static_cast<std::uint32_t>(planes_.size());
      append_planes(a, l.direction, origin, planes_);
      gate.last = static_cast<std::uint32_t>(planes_.size());
      gate.transmittance = pane_transmittance(a, approach);
      gates_.push_back(gate);
    }
    light.last_gate = static_cast<std::uint32_t>(gates_.size());
    lights_.push_back(light);
  }
}

std::uint32_t LightGates::received(std::size_t light, const PointBlock& points, float (&e)[3][kLanes]) const {
  const Light& l = lights_[light];
  alignas(64) float product[3][kLanes], crossed[kLanes], inside[kLanes], cosine[kLanes];
  bool any = false;
  for (std::uint32_t g = l.first_gate; g != l.last_gate; ++g) {
    const Gate& gate = gates_[g];
    const std::span<const glm::vec4> planes(planes_.data() + gate.first, gate.last - gate.first);
    const Side side = side_of(points, planes);
    if (side == Side::outside)
      continue;
    if (!any) {
      any = true;
      std::fill(&product[0][0], &product[0][0] + 3 * kLanes, 1.0f);
      std::fill(crossed, crossed + kLanes, 0.0f);
    }
    if (side == Side::inside)
      std::fill(inside, inside + kLanes, 1.0f);
    else
      lanes_inside(points, planes.data(), planes.size(), inside);
    cross_pane(inside, gate.transmittance, product, crossed);
  }
  if (!any)
    return 0;
  lane_cosines(points, l.direction, cosine);
  std::uint32_t lit = 0;
  for (int k = 0; k < kLanes; ++k) {
    const float c = cosine[k] * crossed[k];
    e[0][k] = c * product[0][k];
    e[1][k] = c * product[1][k];
    e[2][k] = c * product[2][k];
    lit |= static_cast<std::uint32_t>(c > 0.0f) << k;
  }
  return lit & points.lanes;
}

} // namespace daylit
