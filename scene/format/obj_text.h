#pragma once

// The subset of Wavefront OBJ and MTL that rooms and objects need, read strictly: every line is either understood,
// known to be irrelevant, or an error with its number. A general reader would accept a damaged file without a word.
// Source: Wavefront Advanced Visualizer manual, appendices B1 (OBJ) and B5 (MTL).

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit::detail {

struct ObjFace {
  std::uint32_t first_corner = 0, corner_count = 0;
  std::uint32_t material = 0; ///< index into material_names
  int line = 0;               ///< in the file, from 1
};

struct ObjCorner {
  std::uint32_t vertex = 0;               ///< index into vertices, checked
  std::int64_t texture = -1, normal = -1; ///< indices, not checked; -1: none given
};

struct ObjText {
  // All numbers are finite, as written.
  std::vector<glm::dvec3> vertices;
  std::vector<glm::dvec2> textures; ///< vt: u, v from the bottom left
  std::vector<glm::dvec3> normals;  ///< vn: of any length
  std::vector<ObjCorner> corners;
  std::vector<ObjFace> faces;              ///< at least three corners each
  std::vector<std::string> material_names; ///< "" = faces before any usemtl
  std::vector<std::string> libraries;      ///< mtllib arguments, whole rest of the line
  bool ends_with_line_break = true;
};

/// `name` stands in errors. Errors: file_malformed (a line that is not understood, a vertex that does not exist),
/// value_invalid (a coordinate beyond 1e9), limit_exceeded; all with the number of the line.
Result<ObjText> parse_obj_text(std::string_view text, const std::string& name);

/// A picture with the options -s, -o and -clamp.
struct MtlTexture {
  std::string file; ///< "": none
  glm::dvec2 scale{1.0}, offset{0.0};
  bool clamp = false;
};

/// All numbers as written, whatever they are; nothing where the file has none. Pr and what follows it: the extension
/// for physically based materials that Blender and others write.
struct MtlMaterial {
  std::string name;
  std::optional<Rgb> reflectance, specular, transmittance, emission; ///< Kd, Ks, Tf, Ke
  std::optional<double> refractive_index, exponent;                  ///< Ni, Ns
  std::optional<double> opacity;                                     ///< d, or 1 - Tr
  std::optional<double> illumination;                                ///< illum
  std::optional<double> roughness, metallic;                         ///< Pr, Pm
  std::optional<double> clearcoat, clearcoat_roughness;              ///< Pc, Pcr
  std::optional<double> anisotropy, anisotropy_turns;                ///< aniso, anisor
  MtlTexture texture, emission_map, normal_map;                      ///< map_Kd, map_Ke, norm
  std::vector<std::string> unread;                                   ///< keywords of other maps, and unknown ones

  bool is_glass() const { return illumination == 7.0; } ///< refraction and Fresnel reflection
  bool emits() const { return emission && *emission != Rgb(0.0f); }
};

/// Errors as above: a number that is none, a colour before the first newmtl.
Result<std::vector<MtlMaterial>> parse_mtl_text(std::string_view text, const std::string& name);

} // namespace daylit::detail
