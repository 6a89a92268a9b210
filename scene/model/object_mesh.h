#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/material/material.h"
#include "scene/material/texture.h"

namespace daylit {

/// A virtual object in its own frame (metres, z up), shared vertices with unit normals and a reflectance each.
/// Normals are smooth where the file says so or where the crease angle is below 40 degrees, else vertices are split.
struct ObjectMesh {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<Rgb> reflectance; ///< per vertex, 0..1: what a vertex sends on to others; the mean of a texture around it
  std::vector<std::array<std::uint32_t, 3>> triangles;

  /// Multiplies the base colour of the material; per vertex, empty: white.
  std::vector<Rgb> colours;
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

/// OBJ with its MTL, PLY (vertex colours, diffuse) or glTF (y up is turned to z up), with their materials, and the
/// lobes beside them, as docs/materials.md has it. `fallback`: reflectance where the file gives none. `notes`: for
/// people, what was left out. Errors: the file or a picture that it names is missing, damaged or too large; a number
/// outside its range.
Result<ObjectMesh> read_object_mesh(const std::filesystem::path& path, Rgb fallback = Rgb(0.7f),
                                    std::vector<std::string>* notes = nullptr);

} // namespace daylit
