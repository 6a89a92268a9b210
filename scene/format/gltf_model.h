#pragma once

// A glTF file as the library parses it, made safe to walk: nothing here reads outside a buffer.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "scene/core/read_file.h"
#include "scene/core/result.h"
#include "scene/format/gltf_library.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit::detail {

/// Parses text or binary glTF. Files it names are read by `read_file`. Errors: malformed, a file missing, an extension
/// that is required and not known here.
Result<tinygltf::Model> parse_gltf(std::span<const std::uint8_t> bytes, const std::string& name,
                                   const ReadFile& read_file);

/// An extension whose content is read here or by the readers above.
bool is_known_extension(const std::string& name);

/// Corners of a primitive's triangles, three each, as indices into `positions`. Strips and fans are unrolled.
struct GltfTriangles {
  std::vector<glm::dvec3> positions; ///< the primitive's own frame, as written
  std::vector<std::uint32_t> corners;
};

/// Error: an index, accessor or buffer range outside its container, non-finite positions, unsupported storage.
Result<GltfTriangles> read_triangles(const tinygltf::Model& model, const tinygltf::Primitive& primitive);

/// Normals, tangents, texture coordinates and colours of a primitive's vertices; what the file lacks is empty.
struct GltfVertices {
  std::vector<glm::vec3> normals;
  std::vector<glm::vec4> tangents; ///< TANGENT, the sign of the bitangent in w
  std::vector<glm::vec2> uv;       ///< TEXCOORD_n, origin top left
  std::vector<Rgb> colour;         ///< COLOR_0, linear, 0..1
};
/// `count`: of the positions; `uv_set`: n of TEXCOORD_n. Error as for read_triangles, or another number of elements.
Result<GltfVertices> read_vertices(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                   std::size_t count, int uv_set = 0);

/// Calls `visit(mesh, world_from_mesh, where)` for every mesh that the scene shows, in order; matrices in the file's
/// own frame (y up). Stops at the first error. Error: nodes that are not there, or form no tree.
Result<void> walk_meshes(
    const tinygltf::Model& model, const std::string& name,
    const std::function<Result<void>(const tinygltf::Mesh&, const glm::dmat4&, const std::string& where)>& visit);

/// An image as stored. Error: not there, not decodable; its place is the name of its file, or "image" and its number.
Result<Rgb8Image> read_image(const tinygltf::Model& model, int image);
/// Mean over the pixels of an image, sRGB decoded to linear.
Result<Rgb> image_mean(const tinygltf::Model& model, int image);

} // namespace daylit::detail
