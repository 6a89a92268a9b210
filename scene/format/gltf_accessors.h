#pragma once

// Numbers of a glTF 2.0 model (Khronos Group, chapter 3.6), every range checked before it is read.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/format/gltf_library.h"

namespace daylit::detail {

/// file_malformed, with the advice to export again.
Error malformed_gltf(const std::string& what, const std::string& where);

/// Errors: file_malformed where an index or a range leads outside.
Result<std::span<const std::uint8_t>> view_bytes(const tinygltf::Model& model, int buffer_view);

/// Floats, finite; metres of the model.
Result<std::vector<glm::dvec3>> read_positions(const tinygltf::Model& model, int accessor);

/// Below `vertices`; accessor -1: one vertex after another.
Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& model, int accessor, std::size_t vertices);

/// [count][components of `type`, TINYGLTF_TYPE_*]; unsigned integers are normalised to 0..1.
Result<std::vector<float>> read_attribute(const tinygltf::Model& model, int accessor, int type, std::size_t count);

} // namespace daylit::detail
