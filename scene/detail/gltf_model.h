#pragma once

// A glTF file as the library parses it, made safe to walk: nothing here reads outside a buffer.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>

#include "scene/result.h"
#include "scene/rgb_image.h"
#include "scene/room_formats.h"

namespace daylit::detail {

/// Parses text or binary glTF. Files it names are read by `read_file`. Errors: malformed, a file missing, an extension
/// that is required and not known here.
Result<tinygltf::Model> parse_gltf(std::span<const std::uint8_t> bytes, const std::string& name,
                                   const ReadFile& read_file);

/// Corners of a primitive's triangles, three each, as indices into `positions`. Strips and fans are unrolled.
struct GltfTriangles {
  std::vector<glm::dvec3> positions; ///< the primitive's own frame, as written
  std::vector<std::uint32_t> corners;
};

/// Error: an index, accessor or buffer range that leaves its container, non-finite positions, unsupported storage.
Result<GltfTriangles> read_triangles(const tinygltf::Model& model, const tinygltf::Primitive& primitive);

/// Mean over the pixels of an image, sRGB decoded to linear.
Result<Rgb> image_mean(const tinygltf::Model& model, int image);

} // namespace daylit::detail
