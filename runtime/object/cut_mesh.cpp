#include "runtime/object/cut_mesh.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"
#include "scene/model/mesh_edit.h"
#include "scene/room/ray_scene.h"

namespace daylit {

namespace {

constexpr float kEnd = 0.02f;   // of an edge: no cuts so close to its ends
constexpr float kSlit = 0.001f; // of an edge, to each side: so that the light of a cut is found on its own side
constexpr float kSame = 1e-3f;  // of an edge: vertices closer are one point
constexpr int kMostHits = 16;   // along an edge

using Triangle = std::array<std::uint32_t, 3>;

/// Vertices in the order of their positions, so that edges on both sides of a seam are cut alike.
struct Edge {
  std::uint32_t from = 0, to = 0;
  bool operator==(const Edge&) const = default;
  auto operator<=>(const Edge&) const = default;
};

class Cutter {
public:
  Cutter(ObjectMesh& mesh, const RayScene& rays) : mesh_(mesh), rays_(rays) {
    for (const Triangle& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        edges_.push_back(ordered(t[k], t[(k + 1) % 3]));
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }

  /// Edges are tested one by one, in parallel; vertices and triangles are then added in the order of the edges.
  std::size_t cut() {
    std::vector<float> at(edges_.size(), -1.0f);
    parallel_for(tbb::blocked_range<std::size_t>(0, edges_.size(), 256), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        at[i] = crossing(edges_[i]).value_or(-1.0f);
    });
    const auto cuts = static_cast<std::size_t>(std::count_if(at.begin(), at.end(), [](float t) { return t >= 0.0f; }));
    if (cuts == 0)
      return 0;
    ends_.assign(edges_.size(), kNone);
    for (std::size_t i = 0; i < edges_.size(); ++i)
      if (at[i] >= 0.0f) {
        ends_[i] = static_cast<std::uint32_t>(mesh_.positions.size());
        add_between(mesh_, edges_[i].from, edges_[i].to, at[i] - kSlit);
        add_between(mesh_, edges_[i].from, edges_[i].to, at[i] + kSlit);
      }
    std::vector<Triangle> parts;
    std::vector<std::uint16_t> material;
    for (std::size_t k = 0; k < mesh_.triangles.size(); ++k) {
      add_parts(mesh_.triangles[k], parts);
      if (!mesh_.triangle_material.empty())
        material.resize(parts.size(), mesh_.triangle_material[k]);
    }
    mesh_.triangles = std::move(parts);
    mesh_.triangle_material = std::move(material);
    return cuts;
  }

private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  /// Of one cut: the new vertex beside the edge's first and beside its second vertex.
  using Ends = std::array<std::uint32_t, 2>;

  /// By position, then by number: the edges on both sides of a seam get the same direction.
  Edge ordered(std::uint32_t a, std::uint32_t b) const {
    const glm::vec3 &p = mesh_.positions[a], &q = mesh_.positions[b];
    const std::array<float, 3> first{p.x, p.y, p.z}, second{q.x, q.y, q.z};
    return first < second || (first == second && a < b) ? Edge{a, b} : Edge{b, a};
  }

  /// The triangle meets an end of the edge: it is a neighbour, and no part that crosses it.
  bool touches(std::uint32_t triangle, const Edge& e) const {
    const glm::vec3 &a = mesh_.positions[e.from], &b = mesh_.positions[e.to];
    const float same = kSame * glm::distance(a, b);
    return std::any_of(mesh_.triangles[triangle].begin(), mesh_.triangles[triangle].end(), [&](std::uint32_t v) {
      return glm::distance(mesh_.positions[v], a) <= same || glm::distance(mesh_.positions[v], b) <= same;
    });
  }

  /// Where on the edge, 0 to 1, the one triangle is that crosses it.
  std::optional<float> crossing(const Edge& e) const {
    const glm::vec3 p = rays_.to_local(glm::dvec3(mesh_.positions[e.from]));
    const glm::vec3 along = mesh_.positions[e.to] - mesh_.positions[e.from];
    std::optional<float> found;
    float start = kEnd;
    RayHit hit;
    for (int k = 0; k < kMostHits && rays_.closest(p, along, start, 1.0f - kEnd, hit); ++k) {
      start = hit.distance + 1e-4f;
      if (touches(hit.triangle, e))
        continue;
      if (found && hit.distance > *found + 1e-3f) // closer: the same surface, at an edge of it
        return std::nullopt;
      found = found ? found : hit.distance;
    }
    return found;
  }

  /// Seen from corner a: its own side first.
  std::optional<Ends> ends(std::uint32_t a, std::uint32_t b) const {
    const Edge e = ordered(a, b);
    const auto i = static_cast<std::size_t>(std::lower_bound(edges_.begin(), edges_.end(), e) - edges_.begin());
    if (ends_[i] == kNone)
      return std::nullopt;
    return e.from == a ? Ends{ends_[i], ends_[i] + 1} : Ends{ends_[i] + 1, ends_[i]};
  }

  /// One cut: two triangles. Two: the corner between them, and two triangles of the rest. Three: three corners and the
  /// middle.
  void add_parts(const Triangle& t, std::vector<Triangle>& parts) const {
    std::array<std::optional<Ends>, 3> cut; // of the edges from each corner to the next
    std::size_t cuts = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      cut[k] = ends(t[k], t[(k + 1) % 3]);
      cuts += cut[k].has_value();
    }
    if (cuts == 0) {
      parts.push_back(t);
      return;
    }
    if (cuts == 3) {
      for (std::size_t k = 0; k < 3; ++k)
        parts.push_back({t[k], (*cut[k])[0], (*cut[(k + 2) % 3])[1]});
      parts.push_back({(*cut[0])[1], (*cut[1])[1], (*cut[2])[1]});
      return;
    }
    std::size_t k = 0; // turned so that edge k is cut and, of two, the one before it as well
    while (!cut[k] || (cuts == 2 && !cut[(k + 2) % 3]))
      ++k;
    const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
    const Ends& ab = *cut[k];
    if (cuts == 1) {
      parts.insert(parts.end(), {{a, ab[0], c}, {ab[1], b, c}});
      return;
    }
    const Ends& ca = *cut[(k + 2) % 3];
    parts.insert(parts.end(), {{a, ab[0], ca[1]}, {ab[1], b, c}, {ab[1], c, ca[0]}});
  }

  ObjectMesh& mesh_;
  const RayScene& rays_;
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> ends_; ///< per edge: first of its two new vertices
};

} // namespace

Result<std::size_t> cut_where_parts_cross(ObjectMesh& mesh) {
  const std::vector<glm::dvec3> positions(mesh.positions.begin(), mesh.positions.end());
  const auto rays = RayScene::build(positions, mesh.triangles);
  if (!rays)
    return rays.error();
  return Cutter(mesh, *rays).cut();
}

} // namespace daylit
