#pragma once

// The subset of Wavefront OBJ and MTL that a room needs, read strictly: every line is either understood, known to be
// irrelevant, or an error with its number. A general reader would accept a damaged file without a word.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit::detail {

struct ObjFace {
  std::uint32_t first_corner = 0, corner_count = 0;
  std::uint32_t material = 0; ///< index into material_names
  int line = 0;               ///< in the file, from 1
};

struct ObjText {
  std::vector<glm::dvec3> vertices;        ///< finite, as written
  std::vector<std::uint32_t> corners;      ///< indices into vertices, checked
  std::vector<ObjFace> faces;              ///< at least three corners each
  std::vector<std::string> material_names; ///< "" = faces before any usemtl
  std::vector<std::string> libraries;      ///< mtllib arguments, whole rest of the line
  bool ends_with_line_break = true;
};

Result<ObjText> parse_obj_text(std::string_view text, const std::string& name);

struct MtlMaterial {
  std::string name;
  std::optional<Rgb> reflectance;         ///< Kd, as written
  std::optional<Rgb> transmittance;       ///< Tf, as written
  std::optional<double> refractive_index; ///< Ni, as written
  bool is_glass = false;                  ///< illum 7: refraction and Fresnel reflection
  bool has_texture = false, has_dissolve = false, emits = false;
};

Result<std::vector<MtlMaterial>> parse_mtl_text(std::string_view text, const std::string& name);

} // namespace daylit::detail
