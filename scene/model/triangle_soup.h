#pragma once

// What the OBJ, PLY and glTF readers give; scene/model/object_mesh.cpp makes shared vertices with normals of it.

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "scene/core/read_file.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/model/object_mesh.h"
#include "scene/model/surface_list.h"

namespace daylit::detail {

struct SoupCorner {
  std::uint32_t position = 0;
  std::int32_t normal = -1, tangent = -1; ///< -1: the file gives none
  glm::vec2 uv{0.0f};                     ///< origin top left
  Rgb colour{1.0f};                       ///< multiplies the base colour
};
struct SoupTriangle {
  std::array<SoupCorner, 3> corner;
  std::uint32_t material = 0;
};

/// Invariant (of the readers): every index is in range, every number is finite.
struct TriangleSoup {
  std::vector<glm::vec3> positions; ///< metres
  std::vector<glm::vec3> normals;   ///< any length above zero
  std::vector<glm::vec4> tangents;  ///< unit, the sign of the bitangent in w
  std::vector<SoupTriangle> triangles;
  SurfaceList surfaces;
};

/// Splits a polygon into triangles (a quadrilateral along its shorter diagonal, the same from both sides, others as a
/// fan around the corner that keeps all triangles on one side; concave outlines without such a corner are refused:
/// false).
bool append_polygon(const std::vector<SoupCorner>& corners, std::uint32_t material, TriangleSoup& soup);

/// Triangles without area are left out, and, with a note, those that are there already. Vertices are shared where all
/// that they have is equal; normals that the file does not give are those of the faces around within the crease angle.
ObjectMesh build_mesh(TriangleSoup soup, std::vector<std::string>* notes = nullptr);

Result<TriangleSoup> parse_obj_soup(std::span<const std::uint8_t> bytes, const std::filesystem::path& path,
                                    Rgb fallback);
/// glTF 2.0, y up turned to z up. `read_file`: images and buffers beside it.
Result<TriangleSoup> parse_gltf_soup(std::span<const std::uint8_t> bytes, const std::string& name,
                                     const ReadFile& read_file, Rgb fallback);
Result<TriangleSoup> parse_ply_soup(std::span<const std::uint8_t> bytes, const std::string& name, Rgb fallback);

} // namespace daylit::detail
