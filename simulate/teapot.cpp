#include "simulate/teapot.h"

#include <algorithm>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

/// Control ring of a turned surface: (radius, 0), (radius, tangent), (tangent, radius), (0, radius) at height z.
struct Ring {
  double radius, tangent, z;
};
using Profile = std::array<Ring, 4>;

// Rim, upper body, lower body, knob, lid, bottom of Newell's listing.
constexpr std::array<Profile, 6> kTurned = {{
    {{{1.4, 0.784, 2.4}, {1.3375, 0.749, 2.53125}, {1.4375, 0.805, 2.53125}, {1.5, 0.84, 2.4}}},
    {{{1.5, 0.84, 2.4}, {1.75, 0.98, 1.875}, {2.0, 1.12, 1.35}, {2.0, 1.12, 0.9}}},
    {{{2.0, 1.12, 0.9}, {2.0, 1.12, 0.45}, {1.5, 0.84, 0.225}, {1.5, 0.84, 0.15}}},
    {{{0.0, 0.0, 3.15}, {0.8, 0.45, 3.15}, {0.0, 0.0, 2.85}, {0.2, 0.112, 2.7}}},
    {{{0.2, 0.112, 2.7}, {0.4, 0.224, 2.55}, {1.3, 0.728, 2.55}, {1.3, 0.728, 2.4}}},
    {{{1.5, 0.84, 0.15}, {1.5, 0.84, 0.075}, {1.425, 0.798, 0.0}, {0.0, 0.0, 0.0}}},
}};

/// Half of a tube that is symmetric about y = 0: four cross-sections of x, z, and the half width of the two middle
/// points. The points of one section: (inner, 0), (inner, -w), (outer, -w), (outer, 0).
struct Section {
  double inner_x, inner_z, outer_x, outer_z, inner_w, outer_w;
};
using Tube = std::array<Section, 4>;

constexpr std::array<Tube, 4> kTubes = {{
    // handle, upper and lower half
    {{{-1.6, 2.025, -1.5, 2.25, 0.3, 0.3},
      {-2.3, 2.025, -2.5, 2.25, 0.3, 0.3},
      {-2.7, 2.025, -3.0, 2.25, 0.3, 0.3},
      {-2.7, 1.8, -3.0, 1.8, 0.3, 0.3}}},
    {{{-2.7, 1.8, -3.0, 1.8, 0.3, 0.3},
      {-2.7, 1.575, -3.0, 1.35, 0.3, 0.3},
      {-2.5, 1.125, -2.65, 0.9375, 0.3, 0.3},
      {-2.0, 0.9, -1.9, 0.6, 0.3, 0.3}}},
    // spout, root and tip
    {{{1.7, 1.425, 1.7, 0.6, 0.66, 0.66},
      {2.6, 1.425, 3.1, 0.825, 0.66, 0.66},
      {2.3, 2.1, 2.4, 2.025, 0.25, 0.25},
      {2.7, 2.4, 3.3, 2.4, 0.25, 0.25}}},
    {{{2.7, 2.4, 3.3, 2.4, 0.25, 0.25},
      {2.8, 2.475, 3.525, 2.49375, 0.25, 0.25},
      {2.9, 2.475, 3.45, 2.5125, 0.15, 0.15},
      {2.8, 2.4, 3.2, 2.4, 0.15, 0.15}}},
}};

/// Quarter turns of (x, y) about z.
glm::dvec3 turned(const glm::dvec3& p, int quarters) {
  switch (quarters & 3) {
  case 1:
    return {-p.y, p.x, p.z};
  case 2:
    return {-p.x, -p.y, p.z};
  case 3:
    return {p.y, -p.x, p.z};
  default:
    return p;
  }
}

std::array<double, 4> bernstein(double t) {
  const double s = 1.0 - t;
  return {s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t};
}
std::array<double, 4> bernstein_slope(double t) {
  const double s = 1.0 - t;
  return {-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t};
}

glm::dvec3 weighted(const BezierPatch& p, const std::array<double, 4>& wu, const std::array<double, 4>& wv) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 4; ++k)
      sum += wu[i] * wv[k] * p[i][k];
  return sum;
}

} // namespace

std::vector<BezierPatch> teapot_patches() {
  std::vector<BezierPatch> patches;
  for (const Profile& profile : kTurned)
    for (int quarter = 0; quarter < 4; ++quarter) {
      BezierPatch patch;
      for (std::size_t i = 0; i < 4; ++i) {
        const Ring& r = profile[i];
        const std::array<glm::dvec3, 4> arc = {
            {{r.radius, 0.0, r.z}, {r.radius, r.tangent, r.z}, {r.tangent, r.radius, r.z}, {0.0, r.radius, r.z}}};
        // Against the sense of rotation, so that cross(dv, du) points outwards as on the tubes.
        for (std::size_t k = 0; k < 4; ++k)
          patch[i][k] = turned(arc[3 - k], quarter);
      }
      patches.push_back(patch);
    }
  for (const Tube& tube : kTubes)
    for (const double side : {-1.0, 1.0}) {
      BezierPatch patch;
      for (std::size_t i = 0; i < 4; ++i) {
        const Section& s = tube[i];
        const std::array<glm::dvec3, 4> half = {{{s.inner_x, 0.0, s.inner_z},
                                                 {s.inner_x, side * s.inner_w, s.inner_z},
                                                 {s.outer_x, side * s.outer_w, s.outer_z},
                                                 {s.outer_x, 0.0, s.outer_z}}};
        // Both halves run the same way around the tube.
        for (std::size_t k = 0; k < 4; ++k)
          patch[i][k] = side < 0.0 ? half[k] : half[3 - k];
      }
      patches.push_back(patch);
    }
  return patches;
}

glm::dvec3 evaluate(const BezierPatch& patch, double u, double v) {
  return weighted(patch, bernstein(u), bernstein(v));
}

glm::dvec3 outward_normal(const BezierPatch& patch, double u, double v) {
  // A pole has no tangent along its collapsed row: the limit from just inside is the normal.
  for (const double inset : {0.0, 1e-4, 1e-3}) {
    const double a = std::clamp(u, inset, 1.0 - inset), b = std::clamp(v, inset, 1.0 - inset);
    const glm::dvec3 du = weighted(patch, bernstein_slope(a), bernstein(b));
    const glm::dvec3 dv = weighted(patch, bernstein(a), bernstein_slope(b));
    const glm::dvec3 n = glm::cross(dv, du);
    if (glm::length(n) > 1e-9 * (1.0 + glm::length(du) * glm::length(dv)))
      return glm::normalize(n);
  }
  return {0.0, 0.0, 1.0};
}

ObjectMesh tessellate_teapot(int steps, double width_m, Rgb reflectance) {
  constexpr double kLeft = -3.0, kRight = 3.525; // control hull of handle and spout; the surface touches both ends
  ObjectMesh mesh;
  double left = 0.0, right = 0.0;
  const auto side = static_cast<std::uint32_t>(steps + 1);
  for (const BezierPatch& patch : teapot_patches()) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t i = 0; i < side; ++i)
      for (std::uint32_t k = 0; k < side; ++k) {
        const double u = static_cast<double>(i) / steps, v = static_cast<double>(k) / steps;
        mesh.positions.emplace_back(evaluate(patch, u, v));
        mesh.normals.emplace_back(outward_normal(patch, u, v));
        mesh.reflectance.push_back(reflectance);
      }
    for (std::uint32_t i = 0; i + 1 < side; ++i)
      for (std::uint32_t k = 0; k + 1 < side; ++k) {
        const std::uint32_t a = first + i * side + k, b = a + 1, c = a + side, d = c + 1;
        for (const std::array<std::uint32_t, 3> t : {std::array<std::uint32_t, 3>{a, b, c}, {b, d, c}}) {
          const glm::vec3 e = mesh.positions[t[1]] - mesh.positions[t[0]],
                          f = mesh.positions[t[2]] - mesh.positions[t[0]];
          if (glm::length(glm::cross(e, f)) > 1e-7f)
            mesh.triangles.push_back(t);
        }
      }
  }
  for (const glm::vec3& p : mesh.positions) {
    left = std::min(left, static_cast<double>(p.x));
    right = std::max(right, static_cast<double>(p.x));
  }
  const float scale = static_cast<float>(width_m / std::clamp(right - left, 1e-6, kRight - kLeft));
  for (glm::vec3& p : mesh.positions)
    p *= scale;
  return mesh;
}

} // namespace daylit
