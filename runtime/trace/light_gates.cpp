#include "runtime/trace/light_gates.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "runtime/base/lane_vector.h"
#include "scene/room/glass.h"

namespace daylit {

namespace {

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

/// e = cosine x product of the panes crossed, zero where none is.
DAYLIT_LANE_CLONES
std::uint32_t received_lanes(const PointBlock& p, const Gate* gates, std::size_t count, const glm::vec4* planes,
                             const glm::vec3& w, float (&e)[3][kLanes]) {
  alignas(64) float depth[kLanes], crossed[kLanes], cosine[kLanes];
  const float wx = w.x, wy = w.y, wz = w.z;
  DAYLIT_EACH_LANE {
    const float d = p.nx[k] * wx + p.ny[k] * wy + p.nz[k] * wz;
    cosine[k] = d > 0.0f ? d : 0.0f;
    crossed[k] = 0.0f;
    e[0][k] = cosine[k];
    e[1][k] = cosine[k];
    e[2][k] = cosine[k];
  }
  for (std::size_t g = 0; g < count; ++g) {
    DAYLIT_EACH_LANE depth[k] = 1.0f; // inside the nearest plane, or less than zero
    for (std::uint32_t i = gates[g].first; i < gates[g].last; ++i) {
      const float a = planes[i].x, b = planes[i].y, c = planes[i].z, d = planes[i].w;
      DAYLIT_EACH_LANE {
        const float side = p.x[k] * a + p.y[k] * b + p.z[k] * c + d;
        depth[k] = side < depth[k] ? side : depth[k];
      }
    }
    const float r = gates[g].transmittance.r, green = gates[g].transmittance.g, b = gates[g].transmittance.b;
    DAYLIT_EACH_LANE {
      const float inside = depth[k] >= 0.0f ? 1.0f : 0.0f;
      e[0][k] *= 1.0f + inside * (r - 1.0f);
      e[1][k] *= 1.0f + inside * (green - 1.0f);
      e[2][k] *= 1.0f + inside * (b - 1.0f);
      crossed[k] = inside > crossed[k] ? inside : crossed[k];
    }
  }
  std::uint32_t bits = 0;
  DAYLIT_EACH_LANE {
    e[0][k] *= crossed[k];
    e[1][k] *= crossed[k];
    e[2][k] *= crossed[k];
    cosine[k] *= crossed[k];
  }
#pragma omp simd reduction(| : bits)
  for (int k = 0; k < kLanes; ++k)
    bits |= cosine[k] > 0.0f ? 1u << k : 0u;
  return bits;
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
    lo = glm::vec3(std::min(lo.x, x[k]), std::min(lo.y, y[k]), std::min(lo.z, z[k]));
    hi = glm::vec3(std::max(hi.x, x[k]), std::max(hi.y, y[k]), std::max(hi.z, z[k]));
  }
  centre = 0.5f * (lo + hi);
  radius = 0.5f * glm::length(hi - lo) * 1.0001f;
}

LightGates::LightGates(std::span<const DirectionalLight> lights, std::span<const Aperture> apertures,
                       const glm::dvec3& origin) {
  for (const DirectionalLight& l : lights) {
    Light light{glm::vec3(l.direction), l.irradiance, static_cast<std::uint32_t>(gates_.size()), 0, true};
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
  for (std::size_t first = 0; first < lights_.size(); first += kLanes) {
    DirectionBlock& block = blocks_.emplace_back();
    for (int k = 0; k < kLanes; ++k) {
      const glm::vec3& w = lights_[std::min(first + static_cast<std::size_t>(k), lights_.size() - 1)].direction;
      block.x[k] = w.x;
      block.y[k] = w.y;
      block.z[k] = w.z;
    }
  }
}

void LightGates::find_room_shadows(const OccluderReach& room, const glm::vec3& centre, float radius) {
  room_may_block_any_ = false;
  for (Light& l : lights_) {
    l.room_may_block = room.meets(l.direction, centre, radius);
    room_may_block_any_ = room_may_block_any_ || l.room_may_block;
  }
}

std::uint32_t LightGates::received(std::size_t light, const PointBlock& points, float (&e)[3][kLanes]) const {
  const Light& l = lights_[light];
  return points.lanes & received_lanes(points, gates_.data() + l.first_gate, l.last_gate - l.first_gate, planes_.data(),
                                       l.direction, e);
}

} // namespace daylit
