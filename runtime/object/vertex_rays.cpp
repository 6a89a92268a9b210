#include "runtime/object/vertex_rays.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "runtime/base/sh_rotation.h"
#include "runtime/object/mesh_topology.h"
#include "scene/core/orthonormal.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

constexpr float kOnePlane = 0.999f;   ///< cosine between faces that count as one plane
constexpr float kAtEdge = 0.2f;       ///< mean of the unit vectors to the middles of a vertex's faces, at least
constexpr float kInwards = 4.0f;      ///< surface offsets
constexpr float kOfItsSurface = 0.1f; ///< cosine of a face's normal with that of a vertex of its smooth surface

/// The bits of i mirrored at the binary point (van der Corput 1935).
double radical_inverse_2(std::uint32_t i) {
  i = (i << 16) | (i >> 16);
  i = ((i & 0x00FF00FFu) << 8) | ((i & 0xFF00FF00u) >> 8);
  i = ((i & 0x0F0F0F0Fu) << 4) | ((i & 0xF0F0F0F0u) >> 4);
  i = ((i & 0x33333333u) << 2) | ((i & 0xCCCCCCCCu) >> 2);
  i = ((i & 0x55555555u) << 1) | ((i & 0xAAAAAAAAu) >> 1);
  return i * 0x1p-32;
}

/// Cosine-weighted directions around +z, pdf = cos / pi: Hammersley's points on a disc, lifted (Malley).
std::vector<glm::dvec3> cosine_directions(std::size_t count) {
  std::vector<glm::dvec3> directions;
  for (std::uint32_t k = 0; k < count; ++k) {
    const double u = (k + 0.5) / static_cast<double>(count), angle = 2.0 * std::numbers::pi * radical_inverse_2(k);
    directions.emplace_back(std::sqrt(u) * std::cos(angle), std::sqrt(u) * std::sin(angle), std::sqrt(1.0 - u));
  }
  return directions;
}

/// Neighbours together: rings of about equal width, and around each of them runs of `fan`. Directions that ascend from
/// the axis, as they do here, are in rings already.
void sort_into_fans(std::span<glm::dvec3> directions, std::size_t fan) {
  const auto azimuth = [](const glm::dvec3& d) { return std::atan2(d.y, d.x); };
  const std::size_t fans = directions.size() / fan;
  const auto rings = static_cast<std::size_t>(std::max(1.0, std::round(0.5 * std::sqrt(static_cast<double>(fans)))));
  for (std::size_t r = 0; r < rings; ++r) {
    const std::size_t first = fans * r / rings, last = fans * (r + 1) / rings;
    std::ranges::sort(directions.subspan(first * fan, (last - first) * fan), {}, azimuth);
  }
}

/// The faces' index lists one after the other: `first[g]` to `first[g + 1]` are those of group g.
void list_faces(const ObjectMesh& mesh, const std::vector<std::uint32_t>& group, std::vector<std::uint32_t>& first,
                std::vector<std::uint32_t>& face) {
  first.assign(group.empty() ? 1 : std::ranges::max(group) + 2, 0);
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t)
      ++first[group[v] + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  face.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i])
      face[next[group[v]]++] = i;
}

/// Barycentric weights of corners 1 and 2 where a line meets the plane of a triangle (Moeller & Trumbore 1997).
glm::vec2 weights(const glm::vec3 (&corner)[3], const glm::vec3& origin, const glm::vec3& w) {
  const glm::vec3 a = corner[1] - corner[0], b = corner[2] - corner[0], s = origin - corner[0], p = glm::cross(w, b);
  return glm::vec2(glm::dot(s, p), glm::dot(w, glm::cross(s, a))) / glm::dot(a, p);
}

/// In 65535ths; 0 of what is no number (a triangle without area).
std::uint16_t fraction16(float f) {
  return f > 0.0f ? static_cast<std::uint16_t>(65535.0f * std::min(f, 1.0f) + 0.5f) : std::uint16_t{0};
}

} // namespace

VertexRays::VertexRays(const ObjectMesh& mesh, const RayScene& scene, int rays)
    : mesh_(&mesh), scene_(&scene), fans_((static_cast<std::size_t>(std::max(rays, 1)) + kFan - 1) / kFan) {
  const std::size_t count = fans_.size() * kFan;
  std::vector<glm::dvec3> directions = cosine_directions(count);
  sort_into_fans(directions, kFan);
  for (std::size_t k = 0; k < count; ++k) {
    Fan& fan = fans_[k / kFan];
    const std::size_t lane = k % kFan;
    const glm::vec3 d(directions[k]);
    fan.x[lane] = d.x, fan.y[lane] = d.y, fan.z[lane] = d.z;
    const std::array<float, 9> y = sh::evaluate9(d);
    for (int i = 0; i < 9; ++i)
      fan.harmonics[i][lane] = std::numbers::pi_v<float> * y[i];
  }
  find_faces();
  find_starts();
}

glm::mat3 VertexRays::frame(const glm::vec3& normal) {
  const OrthonormalBasis basis{glm::dvec3(normal)};
  return {glm::vec3(basis.u), glm::vec3(basis.v), normal};
}

std::vector<glm::vec3> VertexRays::directions() const {
  std::vector<glm::vec3> all;
  for (const Fan& fan : fans_)
    for (std::size_t k = 0; k < kFan; ++k)
      all.emplace_back(fan.x[k], fan.y[k], fan.z[k]);
  return all;
}

void VertexRays::find_faces() {
  group_ = position_groups(*mesh_);
  list_faces(*mesh_, group_, first_face_, face_);
  for (const auto& t : mesh_->triangles) {
    const glm::vec3 a = mesh_->positions[t[0]];
    const glm::vec3 n = glm::cross(mesh_->positions[t[1]] - a, mesh_->positions[t[2]] - a);
    const float length = glm::length(n);
    face_normal_.push_back(length > 0.0f ? n / length : glm::vec3(0.0f));
  }
}

/// Sheets that touch along an edge have vertices of their own there, in the plane of the other sheet: a ray that starts
/// in it passes it. Vertices at the edge of faces in one plane look from a little inside these.
void VertexRays::find_starts() {
  const std::size_t count = mesh_->positions.size();
  std::vector<glm::vec3> normal(count, glm::vec3(0.0f));
  std::vector<float> faces(count, 0.0f);
  inwards_.assign(count, glm::vec3(0.0f));
  for (std::size_t i = 0; i < mesh_->triangles.size(); ++i) {
    const auto& t = mesh_->triangles[i];
    const glm::vec3 middle = (mesh_->positions[t[0]] + mesh_->positions[t[1]] + mesh_->positions[t[2]]) / 3.0f;
    for (const std::uint32_t v : t)
      if (const glm::vec3 d = middle - mesh_->positions[v]; glm::dot(d, d) > 0.0f) {
        inwards_[v] += glm::normalize(d);
        normal[v] += face_normal_[i];
        faces[v] += 1.0f;
      }
  }
  for (std::size_t v = 0; v < count; ++v) {
    const float length = glm::length(inwards_[v]);
    const bool at_flat_edge = glm::length(normal[v]) > kOnePlane * faces[v] && length > kAtEdge * faces[v];
    inwards_[v] = at_flat_edge ? kInwards / length * inwards_[v] : glm::vec3(0.0f);
  }
}

/// Above the smooth normal's plane and below the plane of a face that meets at this vertex, or the other way round.
bool VertexRays::dips_below(std::uint32_t vertex, const glm::vec3& normal, const glm::vec3& w) const {
  const auto begin = face_.begin() + first_face_[group_[vertex]], end = face_.begin() + first_face_[group_[vertex] + 1];
  return std::any_of(begin, end, [&](std::uint32_t face) {
    const float cosine = glm::dot(face_normal_[face], normal);
    return std::abs(cosine) > kOfItsSurface && glm::dot(face_normal_[face], w) * cosine < 0.0f;
  });
}

/// A direction above the smooth normal's tangent plane may dip below a coarse mesh's own facets and leave through its
/// far side: that hit, on the back of a face, is no occluder. A face of another sheet, across this one, is.
VertexRays::Hit VertexRays::classify(std::uint32_t vertex, const glm::vec3& normal, const glm::vec3& w,
                                     std::uint32_t triangle) const {
  if (glm::dot(face_normal_[triangle], w) < 0.0f)
    return Hit::front;
  return dips_below(vertex, normal, w) ? Hit::none : Hit::back;
}

SeenPoint VertexRays::seen_point(const glm::vec3& origin, const glm::vec3& w, std::uint32_t triangle,
                                 bool on_back) const {
  const auto& t = mesh_->triangles[triangle];
  const auto local = [&](std::uint32_t v) { return scene_->to_local(glm::dvec3(mesh_->positions[v])); };
  const glm::vec2 at = weights({local(t[0]), local(t[1]), local(t[2])}, origin, w);
  return {triangle & 0x7FFFFFFFu, on_back, fraction16(at.x), fraction16(at.y)};
}

/// The sum over blocked directions is taken around +z and turned once: Y_lm of the fans' directions is known. Rays
/// start off the facets that meet at the vertex.
SideView VertexRays::look(std::uint32_t vertex, const glm::vec3& normal) const {
  const glm::mat3 local = frame(normal);
  const float offset = scene_->surface_offset();
  const glm::vec3 origin =
      scene_->to_local(glm::dvec3(mesh_->positions[vertex])) + offset * (normal + inwards_[vertex]);
  SideView view;
  std::array<float, 9> sum{};
  RayPacket16 packet;
  std::array<std::uint32_t, kFan> triangle;
  for (const Fan& fan : fans_) {
    for (std::size_t k = 0; k < kFan; ++k)
      packet.set(k, origin, local * glm::vec3(fan.x[k], fan.y[k], fan.z[k]), offset,
                 std::numeric_limits<float>::infinity());
    std::uint16_t& hidden = view.hidden.emplace_back();
    for (std::uint32_t met = scene_->closest16(packet, kFan, triangle); met != 0; met &= met - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(met));
      const glm::vec3 w = packet.direction(k);
      const Hit hit = classify(vertex, normal, w, triangle[k]);
      if (hit == Hit::none)
        continue;
      hidden |= static_cast<std::uint16_t>(1u << k);
      view.seen.push_back(seen_point(origin, w, triangle[k], hit == Hit::back));
      for (std::size_t i = 0; i < sum.size(); ++i)
        sum[i] += fan.harmonics[i][k];
    }
  }
  for (float& s : sum)
    s /= static_cast<float>(rays());
  view.blocked = rotate9(local, sum);
  view.seen.shrink_to_fit();
  return view;
}

} // namespace daylit
