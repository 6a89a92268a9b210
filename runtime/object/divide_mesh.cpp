#include "runtime/object/divide_mesh.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/model/mesh_edit.h"

namespace daylit {

namespace {

constexpr float kLongest = 1.0f / 6.0f; // of the radius
constexpr std::size_t kMostTriangles = 60'000;

using Triangle = std::array<std::uint32_t, 3>;

/// One round: every long edge gets a vertex in its middle.
class Divider {
public:
  Divider(ObjectMesh& mesh, float longest) : mesh_(mesh), longest2_(longest * longest) {}

  bool any() const {
    return std::ranges::any_of(mesh_.triangles, [&](const Triangle& t) {
      return is_long(t[0], t[1]) || is_long(t[1], t[2]) || is_long(t[2], t[0]);
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

  bool is_long(std::uint32_t a, std::uint32_t b) const {
    const glm::vec3 d = mesh_.positions[b] - mesh_.positions[a];
    return glm::dot(d, d) > longest2_;
  }

  /// The vertex in the middle of a long edge.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    if (!is_long(a, b))
      return kNone;
    const auto key = (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
    const auto [found, made] = middle_.emplace(key, static_cast<std::uint32_t>(mesh_.positions.size()));
    if (made)
      add_between(mesh_, std::min(a, b), std::max(a, b), 0.5f);
    return found->second;
  }

  /// Three long edges: four triangles. Two: the corner between them, and two of the rest. One: two.
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
  float longest2_;
  std::unordered_map<std::uint64_t, std::uint32_t> middle_; ///< by the edge's vertices
};

} // namespace

void divide_long_edges(ObjectMesh& mesh) {
  if (mesh.positions.empty())
    return;
  glm::vec3 low = mesh.positions[0], high = low;
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  Divider divider(mesh, kLongest * 0.5f * glm::length(high - low));
  const std::size_t before = mesh.positions.size();
  while (mesh.triangles.size() < kMostTriangles && divider.any())
    divider.divide();
  if (mesh.positions.size() > before && !mesh.textures.empty())
    set_reflectance(mesh); // of the textures on the smaller triangles
}

} // namespace daylit
