#include <algorithm>
#include <cmath>
#include <map>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "scene/format/gltf_model.h"
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
      : model_(model), name_(name), fallback_(fallback) {}

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
  /// Base colour, and the index of its texture in the soup, or -1.
  Result<std::pair<Rgb, std::int32_t>> surface_of(int material, const std::string& where) {
    if (material < 0)
      return std::pair(fallback_, -1);
    if (static_cast<std::size_t>(material) >= model_.materials.size())
      return Error{ErrorCode::file_malformed, "a material that is not there", where, "export the model again"};
    const auto& given = model_.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness;
    Rgb colour(1.0f);
    for (int c = 0; c < 3 && c < static_cast<int>(given.baseColorFactor.size()); ++c) {
      colour[c] = static_cast<float>(given.baseColorFactor[static_cast<std::size_t>(c)]);
      if (!(colour[c] >= 0.0f && colour[c] <= 1.0f))
        return Error{ErrorCode::value_invalid, "a base colour outside 0..1", where,
                     "set it to the reflected fraction of light"};
    }
    const int texture = given.baseColorTexture.index;
    if (texture < 0 || given.baseColorTexture.texCoord != 0)
      return std::pair(colour, -1);
    if (static_cast<std::size_t>(texture) >= model_.textures.size())
      return Error{ErrorCode::file_malformed, "a texture that is not there", where, "export the model again"};
    const int image = model_.textures[static_cast<std::size_t>(texture)].source;
    if (const auto known = images_.find(image); known != images_.end())
      return std::pair(colour, known->second);
    const auto added = add_texture(soup_, read_image(model_, image), where);
    if (!added)
      return added.error();
    images_[image] = *added;
    return std::pair(colour, *added);
  }

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
    return {};
  }

  Result<void> add(const tinygltf::Primitive& p, const glm::dmat4& world, const std::string& where) {
    const auto triangles = read_triangles(model_, p);
    if (!triangles)
      return triangles.error();
    const auto vertices = read_vertices(model_, p, triangles->positions.size());
    if (!vertices)
      return vertices.error();
    const auto surface = surface_of(p.material, where);
    if (!surface)
      return surface.error();
    if (soup_.triangles.size() + triangles->corners.size() / 3 > kMostTriangles ||
        soup_.positions.size() + triangles->positions.size() > 3 * kMostTriangles)
      return Error{ErrorCode::limit_exceeded, "more than five million triangles with all instances", where,
                   "simplify the object"};
    const auto first = static_cast<std::uint32_t>(soup_.positions.size());
    const auto first_normal = static_cast<std::int32_t>(soup_.normals.size());
    if (const auto added = add_vertices(*triangles, *vertices, world, where); !added)
      return added;
    for (std::size_t k = 0; k + 2 < triangles->corners.size(); k += 3) {
      SoupTriangle t;
      t.reflectance = surface->first;
      t.texture = vertices->uv.empty() ? -1 : surface->second;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t i = triangles->corners[k + c];
        const std::int32_t normal = vertices->normals.empty() ? -1 : first_normal + static_cast<std::int32_t>(i);
        const bool usable = normal >= 0 && glm::length(soup_.normals[static_cast<std::size_t>(normal)]) > 1e-6f;
        t.corner[c] = {first + i, usable ? normal : -1, vertices->uv.empty() ? glm::vec2(0.0f) : vertices->uv[i]};
        if (!vertices->colour.empty())
          t.corner_colour[c] = glm::clamp(vertices->colour[i], Rgb(0.0f), Rgb(1.0f));
      }
      soup_.triangles.push_back(t);
    }
    return {};
  }

  const tinygltf::Model& model_;
  const std::string& name_;
  Rgb fallback_;
  TriangleSoup soup_;
  std::map<int, std::int32_t> images_;
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
