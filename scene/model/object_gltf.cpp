#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "scene/core/error_place.h"
#include "scene/format/gltf_model.h"
#include "scene/model/gltf_material.h"
#include "scene/model/triangle_soup.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMostTriangles = 5'000'000; // with all instances
constexpr double kLargestCoordinate = 1e12;

/// y up to z up.
glm::vec3 turned(const glm::dvec3& v) { return glm::vec3(v.x, -v.z, v.y); }

class GltfObject {
public:
  GltfObject(const tinygltf::Model& model, const std::string& name, Rgb fallback)
      : model_(model), name_(name), materials_(model, name, fallback, soup_.surfaces) {}

  Result<TriangleSoup> run() {
    const auto walked = walk_meshes(
        model_, name_, [this](const tinygltf::Mesh& mesh, const glm::dmat4& world, const std::string& where) {
          for (const tinygltf::Primitive& p : mesh.primitives)
            if (p.mode == TINYGLTF_MODE_TRIANGLES || p.mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
                p.mode == TINYGLTF_MODE_TRIANGLE_FAN)
              if (Result<void> done = add(p, world, name_ + ", " + where); !done)
                return done;
          return Result<void>();
        });
    if (!walked)
      return walked.error();
    return std::move(soup_);
  }

private:
  Result<void> add_vertices(const GltfTriangles& t, const GltfVertices& v, const glm::dmat4& world,
                            const std::string& where) {
    for (const glm::dvec3& p : t.positions) {
      const glm::dvec3 q(world * glm::dvec4(p, 1.0));
      if (!(std::abs(q.x) < kLargestCoordinate && std::abs(q.y) < kLargestCoordinate &&
            std::abs(q.z) < kLargestCoordinate))
        return Error{ErrorCode::value_invalid, "a transformed position is not finite or absurdly large", where,
                     "check the transforms of the node and its parents"};
      soup_.positions.push_back(turned(q));
    }
    const glm::dmat3 linear(world);
    const bool invertible = std::fabs(glm::determinant(linear)) > 1e-30;
    const glm::dmat3 normal_matrix = invertible ? glm::transpose(glm::inverse(linear)) : linear;
    for (const glm::vec3& n : v.normals) {
      const glm::dvec3 m = normal_matrix * glm::dvec3(n);
      const double length = glm::length(m);
      soup_.normals.push_back(length > 0.0 && std::isfinite(length) ? turned(m / length) : glm::vec3(0.0f));
    }
    const float side = glm::determinant(linear) < 0.0 ? -1.0f : 1.0f; // a mirrored node turns the bitangent over
    for (const glm::vec4& tangent : v.tangents) {
      const glm::dvec3 m = linear * glm::dvec3(tangent);
      const double length = glm::length(m);
      soup_.tangents.emplace_back(length > 0.0 && std::isfinite(length) ? turned(m / length) : glm::vec3(0.0f),
                                  tangent.w < 0.0f ? -side : side);
    }
    return {};
  }

  Result<void> add(const tinygltf::Primitive& p, const glm::dmat4& world, const std::string& where) {
    const auto triangles = read_triangles(model_, p);
    if (!triangles)
      return placed_in(where, triangles.error());
    auto surface = materials_.at(p.material);
    if (!surface)
      return surface.error();
    const auto vertices = read_vertices(model_, p, triangles->positions.size(), surface->uv_set);
    if (!vertices)
      return placed_in(where, vertices.error());
    if (vertices->uv.empty()) {
      const auto plain = soup_.surfaces.without_textures(surface->material, where);
      if (!plain)
        return plain.error();
      surface->material = *plain;
    }
    if (soup_.triangles.size() + triangles->corners.size() / 3 > kMostTriangles ||
        soup_.positions.size() + triangles->positions.size() > 3 * kMostTriangles)
      return Error{ErrorCode::limit_exceeded, "more than five million triangles with all instances", where,
                   "simplify the object"};
    const bool turns_over = glm::determinant(glm::dmat3(world)) < 0.0; // glTF 2.0, 3.7.4
    const Offsets first{soup_.positions.size(), soup_.normals.size(), soup_.tangents.size()};
    if (const auto added = add_vertices(*triangles, *vertices, world, where); !added)
      return added;
    for (std::size_t k = 0; k + 2 < triangles->corners.size(); k += 3) {
      SoupTriangle t{{}, surface->material};
      for (std::size_t c = 0; c < 3; ++c)
        t.corner[c] = corner(triangles->corners[k + c], *vertices, first);
      if (turns_over)
        std::swap(t.corner[1], t.corner[2]);
      soup_.triangles.push_back(t);
    }
    return {};
  }

  /// Where the vertices of a primitive begin in the soup.
  struct Offsets {
    std::size_t position, normal, tangent;
  };
  SoupCorner corner(std::uint32_t i, const GltfVertices& v, const Offsets& first) const {
    SoupCorner c{.position = static_cast<std::uint32_t>(first.position) + i};
    if (!v.normals.empty() && glm::length(soup_.normals[first.normal + i]) > 1e-6f)
      c.normal = static_cast<std::int32_t>(first.normal + i);
    if (!v.tangents.empty() && glm::length(glm::vec3(soup_.tangents[first.tangent + i])) > 1e-6f)
      c.tangent = static_cast<std::int32_t>(first.tangent + i);
    if (!v.uv.empty())
      c.uv = v.uv[i];
    if (!v.colour.empty())
      c.colour = glm::clamp(v.colour[i], Rgb(0.0f), Rgb(1.0f));
    return c;
  }

  const tinygltf::Model& model_;
  const std::string& name_;
  TriangleSoup soup_;
  GltfMaterials materials_;
};

} // namespace

Result<TriangleSoup> parse_gltf_soup(std::span<const std::uint8_t> bytes, const std::string& name,
                                     const ReadFile& read_file, Rgb fallback) {
  const Result<tinygltf::Model> model = parse_gltf(bytes, name, read_file);
  if (!model)
    return model.error();
  return GltfObject(*model, name, fallback).run();
}

} // namespace daylit::detail
