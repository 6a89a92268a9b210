#include "runtime/object/divide_mesh.h"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/object/vertex_rays.h"
#include "scene/core/parallel.h"
#include "scene/model/mesh_edit.h"
#include "scene/room/ray_scene.h"

namespace daylit {

namespace {

constexpr float kLongest = 1.0f / 6.0f;   // of the radius
constexpr float kShortest = 1.0f / 24.0f; // of the radius: shorter edges are left
constexpr float kSteep = 3.0f;            // of the distance of other surfaces
constexpr int kRays = 64;                 // that look for them
constexpr int kRounds = 3;                // of edges near these: halved twice they are short
constexpr std::size_t kMostTriangles = 60'000;

using Triangle = std::array<std::uint32_t, 3>;

/// Whether the edge between two vertices is halved: the same for all between the same two places.
using IsHalved = std::function<bool(std::uint32_t, std::uint32_t)>;

/// One round: every edge that is halved gets a vertex in its middle.
class Divider {
public:
  Divider(ObjectMesh& mesh, IsHalved is_halved) : mesh_(mesh), is_halved_(std::move(is_halved)) {}

  bool any() const {
    return std::ranges::any_of(mesh_.triangles, [&](const Triangle& t) {
      return is_halved_(t[0], t[1]) || is_halved_(t[1], t[2]) || is_halved_(t[2], t[0]);
    });
  }
  void divide() {
    std::vector<Triangle> parts;
    std::vector<std::uint16_t> material;
    for (std::size_t k = 0; k < mesh_.triangles.size(); ++k) {
      add_parts(mesh_.triangles[k], parts);
      if (!mesh_.triangle_material.empty())
        material.resize(parts.size(), mesh_.triangle_material[k]);
    }
    mesh_.triangles = std::move(parts);
    mesh_.triangle_material = std::move(material);
    middle_.clear();
  }

private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  /// The vertex in the middle of an edge that is halved.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    if (!is_halved_(a, b))
      return kNone;
    const auto key = (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
    const auto [found, made] = middle_.emplace(key, static_cast<std::uint32_t>(mesh_.positions.size()));
    if (made)
      add_between(mesh_, std::min(a, b), std::max(a, b), 0.5f);
    return found->second;
  }

  /// Three halved edges: four triangles. Two: the corner between them, and two of the rest. One: two.
  void add_parts(const Triangle& t, std::vector<Triangle>& parts) {
    const Triangle m{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    const auto count = std::ranges::count_if(m, [](std::uint32_t v) { return v != kNone; });
    if (count == 0) {
      parts.push_back(t);
      return;
    }
    if (count == 3) {
      parts.insert(parts.end(), {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, m});
      return;
    }
    std::size_t k = 0; // turned so that edge k is halved and, of two, the one before it as well
    while (m[k] == kNone || (count == 2 && m[(k + 2) % 3] == kNone))
      ++k;
    const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3], ab = m[k], ca = m[(k + 2) % 3];
    if (count == 1)
      parts.insert(parts.end(), {{a, ab, c}, {ab, b, c}});
    else
      parts.insert(parts.end(), {{a, ab, ca}, {ab, b, c}, {ab, c, ca}});
  }

  ObjectMesh& mesh_;
  IsHalved is_halved_;
  std::unordered_map<std::uint64_t, std::uint32_t> middle_; ///< by the edge's vertices
};

/// Edges at one end of which, or in whose middle, other surfaces of the mesh, or the floor below it, are much nearer
/// than elsewhere on them.
class NearSurfaces {
public:
  NearSurfaces(const ObjectMesh& mesh, const RayScene& rays, float radius)
      : mesh_(mesh), rays_(rays), radius_(radius),
        floor_(std::ranges::min_element(mesh.positions, {}, &glm::vec3::z)->z),
        directions_(VertexRays(mesh, rays, kRays).directions()) {}

  /// After the mesh changed.
  void find() {
    const std::size_t known = distance_.size();
    distance_.resize(mesh_.positions.size());
    parallel_for(known, distance_.size(),
                 [&](std::size_t v) { distance_[v] = distance(mesh_.positions[v], mesh_.normals[v]); });
    const std::vector<Edge> edges = long_edges();
    std::vector<std::uint8_t> changes(edges.size());
    parallel_for(std::size_t{0}, edges.size(), [&](std::size_t i) { changes[i] = changes_along(edges[i]); });
    near_.clear();
    for (std::size_t i = 0; i < edges.size(); ++i)
      if (changes[i])
        near_.insert(places(edges[i][0], edges[i][1]));
  }
  bool operator()(std::uint32_t a, std::uint32_t b) const { return near_.contains(places(a, b)); }

private:
  using Edge = std::array<std::uint32_t, 2>;
  using Places = std::array<float, 6>;

  std::vector<Edge> long_edges() const {
    std::vector<Edge> edges;
    for (const Triangle& t : mesh_.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        if (const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
            glm::distance(mesh_.positions[a], mesh_.positions[b]) > kShortest * radius_)
          edges.push_back({a, b});
    std::ranges::sort(edges);
    edges.erase(std::ranges::unique(edges).begin(), edges.end());
    return edges;
  }
  Places places(std::uint32_t a, std::uint32_t b) const {
    const glm::vec3 &p = mesh_.positions[a], &q = mesh_.positions[b];
    const std::array<float, 3> one{p.x, p.y, p.z}, other{q.x, q.y, q.z};
    const auto& [low, high] = std::minmax(one, other);
    return {low[0], low[1], low[2], high[0], high[1], high[2]};
  }

  /// n / sum over the rays of 1 / d, the harmonic mean, which says how fast indirect light changes with the place
  /// (Ward, Rubinstein & Clear 1988); here of the mesh's own surfaces and of the plane that it stands on.
  float distance(const glm::vec3& position, const glm::vec3& normal) const {
    const glm::mat3 frame = VertexRays::frame(normal);
    const float off = 1e-4f * radius_;
    const glm::vec3 from = rays_.to_local(glm::dvec3(position)) + off * normal;
    float sum = 0.0f;
    for (const glm::vec3& d : directions_) {
      const glm::vec3 w = frame * d;
      RayHit hit;
      if (rays_.closest(from, w, 0.0f, 4.0f * radius_, hit))
        sum += 1.0f / std::max(hit.distance, off);
      else if (w.z < 0.0f)
        sum += -w.z / std::max(position.z - floor_, off);
    }
    return sum > 0.0f ? static_cast<float>(directions_.size()) / sum : std::numeric_limits<float>::infinity();
  }

  bool changes_along(const Edge& e) const {
    const glm::vec3 normal = mesh_.normals[e[0]] + mesh_.normals[e[1]];
    const float length = glm::distance(mesh_.positions[e[0]], mesh_.positions[e[1]]);
    if (glm::length(normal) < 0.5f)
      return false;
    const float middle = distance(0.5f * (mesh_.positions[e[0]] + mesh_.positions[e[1]]), glm::normalize(normal));
    const auto [least, most] = std::minmax({distance_[e[0]], middle, distance_[e[1]]});
    return length > kSteep * least && most > kSteep * least;
  }

  const ObjectMesh& mesh_;
  const RayScene& rays_;
  float radius_, floor_;
  std::vector<glm::vec3> directions_;
  std::vector<float> distance_; ///< of each vertex
  std::set<Places> near_;
};

/// Radius of the sphere around the mesh's box.
float radius_of(const ObjectMesh& mesh) {
  glm::vec3 low = mesh.positions[0], high = low;
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return 0.5f * glm::length(high - low);
}

void divide_near_surfaces(ObjectMesh& mesh, float radius) {
  const auto rays =
      RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  if (!rays)
    return; // it has no area: there is nothing to light
  NearSurfaces near(mesh, *rays, radius);
  Divider divider(mesh, std::cref(near));
  for (int round = 0; round < kRounds && mesh.triangles.size() < kMostTriangles; ++round) {
    near.find();
    divider.divide();
  }
}

} // namespace

void divide_coarse_mesh(ObjectMesh& mesh) {
  if (mesh.positions.empty())
    return;
  const float radius = radius_of(mesh), longest = kLongest * radius;
  Divider divider(mesh, [&](std::uint32_t a, std::uint32_t b) {
    return glm::distance(mesh.positions[a], mesh.positions[b]) > longest;
  });
  const std::size_t before = mesh.positions.size();
  while (mesh.triangles.size() < kMostTriangles && divider.any())
    divider.divide();
  if (mesh.positions.size() == before)
    return;
  divide_near_surfaces(mesh, radius);
  if (!mesh.textures.empty())
    set_reflectance(mesh); // of the textures on the smaller triangles
}

} // namespace daylit
