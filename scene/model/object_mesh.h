#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/material/material.h"

namespace daylit {

/// A virtual object in its own frame (metres, z up), shared vertices with unit normals and a reflectance each.
/// Normals are smooth where the file says so or where the crease angle is below 40 degrees, else vertices are split.
struct ObjectMesh {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<Rgb> reflectance; ///< per vertex, 0..1: what a vertex sends on to others; the mean of a texture around it
  std::vector<std::array<std::uint32_t, 3>> triangles;

  /// Empty where no material has a texture; else per vertex, origin top left.
  std::vector<glm::vec2> uv;
  /// Unit direction in which u grows, times the sign of the bitangent n x t in w; per vertex, empty where no material
  /// needs one.
  std::vector<glm::vec4> tangents;
  std::vector<ObjectMaterial> materials;        ///< at least one
  std::vector<std::uint16_t> triangle_material; ///< per triangle; empty: all have the first
  std::vector<Texture> textures;

  /// Of a triangle; null for a mesh made without materials: diffuse, of the vertices' reflectance.
  const ObjectMaterial* material_or_null(std::size_t triangle) const {
    return materials.empty() ? nullptr : &materials[triangle_material.empty() ? 0 : triangle_material[triangle]];
  }
};

/// OBJ (Kd of the MTL, times map_Kd), PLY (vertex colours) or glTF (base colour, its texture, vertex colours; y up is
/// turned to z up). `fallback`: reflectance where the file gives none. Textures are kept at vertices: the mesh is
/// divided until its edges span about eight texels (at most 60,000 triangles).
Result<ObjectMesh> read_object_mesh(const std::filesystem::path& path, Rgb fallback = Rgb(0.7f));

} // namespace daylit
