// From loose triangles to shared vertices.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/model/mesh_edit.h"
#include "scene/model/triangle_soup.h"

namespace daylit::detail {

namespace {

const double kCreaseCosine = std::cos(40.0 * std::numbers::pi / 180.0);

/// Representative of all positions with exactly equal coordinates (OBJ files repeat them along texture seams).
std::vector<std::uint32_t> weld(const std::vector<glm::vec3>& positions) {
  std::vector<std::uint32_t> order(positions.size()), welded(positions.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) { return std::tuple(positions[i].x, positions[i].y, positions[i].z); };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b) || (key(a) == key(b) && a < b); });
  for (std::size_t i = 0; i < order.size(); ++i)
    welded[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? welded[order[i - 1]] : order[i];
  return welded;
}

struct Incidence {
  std::vector<std::uint32_t> begin;  ///< per position
  std::vector<std::uint32_t> corner; ///< 3 * triangle + corner, ascending
};

Incidence corners_at_positions(const TriangleSoup& soup, const std::vector<std::uint32_t>& welded) {
  Incidence at;
  at.begin.assign(soup.positions.size() + 1, 0);
  for (const SoupTriangle& t : soup.triangles)
    for (const auto& c : t.corner)
      ++at.begin[welded[c.position] + 1];
  for (std::size_t i = 1; i < at.begin.size(); ++i)
    at.begin[i] += at.begin[i - 1];
  std::vector<std::uint32_t> next(at.begin.begin(), at.begin.end() - 1);
  at.corner.resize(3 * soup.triangles.size());
  for (std::size_t t = 0; t < soup.triangles.size(); ++t)
    for (std::uint32_t k = 0; k < 3; ++k)
      at.corner[next[welded[soup.triangles[t].corner[k].position]]++] = static_cast<std::uint32_t>(3 * t) + k;
  return at;
}

struct FaceShape {
  std::vector<glm::dvec3> normal;           ///< unit
  std::vector<std::array<double, 3>> angle; ///< radians, at the corners: the weight of the face in a vertex normal
};

FaceShape face_shapes(const TriangleSoup& soup) {
  FaceShape shape;
  for (const SoupTriangle& t : soup.triangles) {
    std::array<glm::dvec3, 3> p;
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = soup.positions[t.corner[k].position];
    shape.normal.push_back(glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0])));
    std::array<double, 3> angle;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 a = p[(k + 1) % 3] - p[k], b = p[(k + 2) % 3] - p[k];
      angle[k] = std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
    }
    shape.angle.push_back(angle);
  }
  return shape;
}

/// Triangles without area carry no light and have no normal.
void drop_degenerate(TriangleSoup& soup) {
  std::erase_if(soup.triangles, [&](const SoupTriangle& t) {
    const glm::dvec3 a(soup.positions[t.corner[0].position]), b(soup.positions[t.corner[1].position]),
        c(soup.positions[t.corner[2].position]);
    const double longest = std::max({glm::length(b - a), glm::length(c - a), glm::length(c - b)});
    return !(glm::length(glm::cross(b - a, c - a)) > 1e-10 * longest * longest);
  });
}

/// Of triangles with the same three corners, as programs write them for the two sides of a face, the first is kept:
/// light falls on both sides of each. Returns how many are left out.
std::size_t drop_repeated(const std::vector<std::uint32_t>& welded, TriangleSoup& soup) {
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::size_t>> all;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = welded[soup.triangles[t].corner[k].position];
    std::ranges::sort(corners);
    all.emplace_back(corners, t);
  }
  std::ranges::sort(all);
  std::vector<std::uint8_t> repeated(soup.triangles.size(), 0);
  for (std::size_t i = 1; i < all.size(); ++i)
    repeated[all[i].second] = all[i].first == all[i - 1].first;
  std::size_t t = 0;
  return std::erase_if(soup.triangles, [&](const SoupTriangle&) { return repeated[t++] != 0; });
}

/// Normal of a corner that the file gives none for: mean of the faces around it within the crease angle of its own.
/// The sum runs in the same order for every corner of the vertex, so that equal sets give equal bits and are merged.
glm::vec3 smooth_normal(std::size_t triangle, std::uint32_t position, const Incidence& at, const FaceShape& shape) {
  glm::dvec3 sum{0.0};
  for (std::uint32_t i = at.begin[position]; i < at.begin[position + 1]; ++i) {
    const std::size_t other = at.corner[i] / 3;
    if (glm::dot(shape.normal[other], shape.normal[triangle]) >= kCreaseCosine)
      sum += shape.angle[other][at.corner[i] % 3] * shape.normal[other];
  }
  return glm::vec3(glm::normalize(sum));
}

/// What tells vertices at one position apart.
struct Vertex {
  glm::vec3 normal{0.0f};
  Rgb colour{1.0f};
  glm::vec2 uv{0.0f};
  glm::vec4 tangent{0.0f}; ///< of the file; else (0, 0, 0, side): on a seam where a texture is mirrored, two vertices
  std::uint32_t material = 0;
  bool operator==(const Vertex&) const = default;
};

class VertexPool {
public:
  explicit VertexPool(std::size_t positions) : first_(positions, kNone) {}
  std::uint32_t add(std::uint32_t position, const glm::vec3& point, const Vertex& vertex, ObjectMesh& mesh) {
    for (std::uint32_t v = first_[position]; v != kNone; v = next_[v])
      if (vertices_[v] == vertex)
        return v;
    const auto number = static_cast<std::uint32_t>(vertices_.size());
    vertices_.push_back(vertex);
    mesh.positions.push_back(point);
    mesh.normals.push_back(vertex.normal);
    next_.push_back(first_[position]);
    first_[position] = number;
    return number;
  }
  const std::vector<Vertex>& vertices() const { return vertices_; }

private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<Vertex> vertices_;
  std::vector<std::uint32_t> first_, next_; ///< chains of the vertices at a position
};

/// -1 where a texture is seen from behind.
float texture_side(const SoupTriangle& t) {
  const glm::vec2 a = t.corner[1].uv - t.corner[0].uv, b = t.corner[2].uv - t.corner[0].uv;
  return a.x * b.y - a.y * b.x < 0.0f ? -1.0f : 1.0f;
}

/// What vertices of this mesh have; of the rest nothing is kept.
struct Kept {
  bool uv = false, tangents = false, file_tangents = false;
};
Kept kept_of(const TriangleSoup& soup) {
  Kept kept;
  kept.tangents = std::ranges::any_of(soup.surfaces.materials, &ObjectMaterial::needs_tangents);
  kept.file_tangents = kept.tangents && std::ranges::all_of(soup.triangles, [](const SoupTriangle& t) {
                         return std::ranges::all_of(t.corner, [](const auto& c) { return c.tangent >= 0; });
                       });
  kept.uv = !soup.surfaces.textures.empty() || (kept.tangents && !kept.file_tangents);
  return kept;
}

Vertex vertex_of(const TriangleSoup& soup, const SoupTriangle& t, std::size_t k, const Kept& kept) {
  const auto& corner = t.corner[k];
  Vertex vertex{.colour = corner.colour, .material = t.material};
  if (kept.uv)
    vertex.uv = corner.uv;
  if (kept.tangents)
    vertex.tangent = kept.file_tangents ? soup.tangents[static_cast<std::size_t>(corner.tangent)]
                                        : glm::vec4(0.0f, 0.0f, 0.0f, texture_side(t));
  return vertex;
}

/// Vertices and triangles; the rest of the mesh is the pool's.
VertexPool shared_vertices(const TriangleSoup& soup, const std::vector<std::uint32_t>& welded, const Kept& kept,
                           ObjectMesh& mesh) {
  const Incidence at = corners_at_positions(soup, welded);
  const FaceShape shape = face_shapes(soup);
  VertexPool pool(soup.positions.size());
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& corner = soup.triangles[t].corner[k];
      const std::uint32_t position = welded[corner.position];
      Vertex vertex = vertex_of(soup, soup.triangles[t], k, kept);
      vertex.normal = corner.normal >= 0 ? glm::normalize(soup.normals[static_cast<std::size_t>(corner.normal)])
                                         : smooth_normal(t, position, at, shape);
      triangle[k] = pool.add(position, soup.positions[position], vertex, mesh);
    }
    mesh.triangles.push_back(triangle);
  }
  return pool;
}

void keep_attributes(const std::vector<Vertex>& vertices, const Kept& kept, ObjectMesh& mesh) {
  if (std::ranges::any_of(vertices, [](const Vertex& v) { return v.colour != Rgb(1.0f); }))
    for (const Vertex& v : vertices)
      mesh.colours.push_back(v.colour);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (kept.uv)
      mesh.uv.push_back(vertices[v].uv);
    if (kept.file_tangents)
      mesh.tangents.push_back(vertices[v].tangent);
  }
}

} // namespace

ObjectMesh build_mesh(TriangleSoup soup, std::vector<std::string>* notes) {
  if (notes)
    notes->insert(notes->end(), soup.surfaces.notes.begin(), soup.surfaces.notes.end());
  drop_degenerate(soup);
  const std::vector<std::uint32_t> welded = weld(soup.positions);
  const std::size_t repeated = drop_repeated(welded, soup);
  if (notes && repeated > 0)
    notes->push_back(fmt::format("{} of the triangles are there twice: one of each is left out", repeated));
  const Kept kept = kept_of(soup);
  ObjectMesh mesh;
  keep_attributes(shared_vertices(soup, welded, kept, mesh).vertices(), kept, mesh);
  if (soup.surfaces.materials.size() > 1)
    for (const SoupTriangle& t : soup.triangles)
      mesh.triangle_material.push_back(static_cast<std::uint16_t>(t.material));
  mesh.materials = std::move(soup.surfaces.materials);
  mesh.textures = std::move(soup.surfaces.textures);
  set_tangents(mesh);
  if (mesh.textures.empty())
    mesh.uv.clear();
  set_reflectance(mesh);
  return mesh;
}

} // namespace daylit::detail
