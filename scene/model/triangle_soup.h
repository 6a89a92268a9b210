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

#include "scene/core/read_file.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit::detail {

struct SoupCorner {
  std::uint32_t position = 0;
  std::int32_t normal = -1; ///< -1: the file gives none
  glm::vec2 uv{0.0f};       ///< of the triangle's texture, origin top left
};
struct SoupTriangle {
  std::array<SoupCorner, 3> corner;
  Rgb reflectance{0.5f};
  std::int32_t texture = -1; ///< of TriangleSoup; its colour multiplies `reflectance`
  std::array<Rgb, 3> corner_colour{Rgb(1.0f), Rgb(1.0f), Rgb(1.0f)}; ///< multiplies `reflectance`
};

/// Invariant (of the readers): every index is in range, every number is finite.
struct TriangleSoup {
  std::vector<glm::vec3> positions; ///< metres
  std::vector<glm::vec3> normals;   ///< any length above zero
  std::vector<Rgb> vertex_colour;   ///< 0..1, empty or one per position; overrides the triangle's reflectance
  std::vector<SoupTriangle> triangles;
  std::vector<Rgb8Image> textures; ///< sRGB, repeated beyond 0..1
};

/// Takes over a texture that fits in with the others. Error: empty, or more texels than an object may have.
Result<std::int32_t> add_texture(TriangleSoup& soup, Result<Rgb8Image> texture, const std::string& where);

/// Turns textures into corner colours. Reflectance lives at vertices, because light does: triangles are first divided,
/// all into the same number (so that no crack opens), until their edges span about eight texels or the mesh has 60,000
/// triangles; then each corner takes the mean of the texels that its part of the surface covers.
void resolve_textures(TriangleSoup& soup);

/// Splits a polygon into triangles (a quadrilateral along its shorter diagonal, others as a fan around the corner that
/// keeps all triangles on one side; concave outlines without such a corner are refused: false).
bool append_polygon(const std::vector<SoupCorner>& corners, Rgb reflectance, TriangleSoup& soup);

Result<TriangleSoup> parse_obj_soup(std::span<const std::uint8_t> bytes, const std::filesystem::path& path,
                                    Rgb fallback);
/// glTF 2.0, y up turned to z up. `read_file`: images and buffers beside it.
Result<TriangleSoup> parse_gltf_soup(std::span<const std::uint8_t> bytes, const std::string& name,
                                     const ReadFile& read_file, Rgb fallback);
Result<TriangleSoup> parse_ply_soup(std::span<const std::uint8_t> bytes, const std::string& name, Rgb fallback);

} // namespace daylit::detail
