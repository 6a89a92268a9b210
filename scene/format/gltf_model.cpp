#include "scene/format/gltf_model.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>

#include "scene/core/error_place.h"
#include "scene/format/gltf_accessors.h"
#include "scene/format/gltf_types.h"
#include "scene/image/image_formats.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kLargestModel_bytes = std::size_t{1} << 30;
constexpr int kDeepestNesting = 64; // brackets in the JSON: the library descends by recursion

bool is_binary(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

/// Of "... parse error at line 1, column 7: syntax error ...; last read: 'x'" the place and what was read there; of
/// other exceptions of the JSON parser what follows their name.
std::string what_is_damaged(const std::string& error) {
  constexpr std::size_t kLongest = 80;
  const auto after = [&](std::string_view words) {
    const std::size_t at = error.find(words);
    return at == std::string::npos ? std::string() : error.substr(at + words.size());
  };
  const std::string place = after("parse error at "), read = after("last read: "), rest = after("] ");
  if (place.empty())
    return rest.empty() ? "" : ": " + rest.substr(0, std::min(kLongest, rest.find('\n')));
  return " at " + place.substr(0, place.find(':')) +
         (read.empty() ? "" : ", where it says " + read.substr(0, std::min(kLongest, read.find('\n'))));
}

/// What the library says, its first line.
std::string why_unread(std::span<const std::uint8_t> bytes, const std::string& error) {
  const auto first = std::ranges::find_if(bytes, [](std::uint8_t c) { return !std::isspace(c); });
  if (!is_binary(bytes) && (first == bytes.end() || *first != '{'))
    return ": the file is neither a glTF binary, which begins with \"glTF\", nor JSON";
  if (error.starts_with("[json.exception"))
    return ": its JSON is damaged" + what_is_damaged(error);
  return error.empty() ? "" : ": " + error.substr(0, std::min<std::size_t>(error.find('\n'), 200));
}

/// The JSON part of either form.
std::span<const std::uint8_t> json_part(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 20 || !is_binary(bytes))
    return bytes;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, sizeof(length));
  return bytes.subspan(20, std::min<std::size_t>(length, bytes.size() - 20));
}

bool nested_too_deep(std::span<const std::uint8_t> json) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const auto c = static_cast<char>(json[i]);
    if (in_string) {
      i += c == '\\' ? 1 : 0;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kDeepestNesting)
        return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

/// Files come through the reader's callback; what it refused is remembered.
struct Files {
  const ReadFile& read;
  std::optional<Error> error;

  static std::string plain(const std::string& path) { return path.starts_with("./") ? path.substr(2) : path; }
  static bool exists(const std::string& path, void*) { return !path.empty(); }
  static std::string expand(const std::string& path, void*) { return path; }
  static bool fetch(std::vector<unsigned char>* out, std::string*, const std::string& path, void* self) {
    auto* files = static_cast<Files*>(self);
    Result<std::vector<std::uint8_t>> bytes = files->read(plain(path));
    if (!bytes) {
      files->error = bytes.error();
      return false;
    }
    *out = std::move(*bytes);
    return true;
  }
};

/// Keeps the encoded bytes of an image file. Those inside a buffer are looked up later, with their range checked.
bool keep_encoded(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes,
                  int size, void*) {
  if (image->bufferView < 0)
    image->image.assign(bytes, bytes + std::max(size, 0));
  return true;
}

/// Strips and fans as single triangles.
std::vector<std::uint32_t> unrolled(const std::vector<std::uint32_t>& indices, int mode) {
  if (mode == TINYGLTF_MODE_TRIANGLES)
    return {indices.begin(), indices.end() - static_cast<std::ptrdiff_t>(indices.size() % 3)};
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i + 2 < indices.size(); ++i) {
    const std::size_t a = mode == TINYGLTF_MODE_TRIANGLE_FAN ? 0 : i, odd = i % 2;
    if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
      corners.insert(corners.end(), {indices[a], indices[i + 1], indices[i + 2]});
    else
      corners.insert(corners.end(), {indices[i], indices[i + 1 + odd], indices[i + 2 - odd]});
  }
  return corners;
}

glm::dmat4 transform(const tinygltf::Node& n) {
  glm::dmat4 m(1.0);
  if (n.matrix.size() == 16) {
    for (int k = 0; k < 16; ++k)
      m[k / 4][k % 4] = n.matrix[static_cast<std::size_t>(k)];
    return m;
  }
  if (n.rotation.size() == 4)
    m = glm::mat4_cast(glm::normalize(glm::dquat(n.rotation[3], n.rotation[0], n.rotation[1], n.rotation[2])));
  if (n.scale.size() == 3)
    for (int k = 0; k < 3; ++k)
      m[k] *= n.scale[static_cast<std::size_t>(k)];
  if (n.translation.size() == 3)
    m[3] = glm::dvec4(n.translation[0], n.translation[1], n.translation[2], 1.0);
  return m;
}

/// Nodes where the walk starts: those of the chosen scene, or all that are nobody's child.
std::vector<int> roots_of(const tinygltf::Model& model) {
  if (!model.scenes.empty()) {
    const auto scene = static_cast<std::size_t>(std::max(model.defaultScene, 0));
    return model.scenes[std::min(scene, model.scenes.size() - 1)].nodes;
  }
  std::vector<bool> child(model.nodes.size(), false);
  for (const tinygltf::Node& n : model.nodes)
    for (const int c : n.children)
      if (c >= 0 && static_cast<std::size_t>(c) < child.size())
        child[static_cast<std::size_t>(c)] = true;
  std::vector<int> result;
  for (std::size_t i = 0; i < child.size(); ++i)
    if (!child[i])
      result.push_back(static_cast<int>(i));
  return result;
}

} // namespace

bool is_known_extension(const std::string& name) {
  static constexpr std::array kKnown = {"KHR_lights_punctual",
                                        "KHR_materials_anisotropy",
                                        "KHR_materials_clearcoat",
                                        "KHR_materials_dispersion",
                                        "KHR_materials_emissive_strength",
                                        "KHR_materials_ior",
                                        "KHR_materials_transmission",
                                        "KHR_materials_volume",
                                        "KHR_texture_transform"};
  return std::ranges::find(kKnown, name) != kKnown.end();
}

Result<tinygltf::Model> parse_gltf(std::span<const std::uint8_t> bytes, const std::string& name,
                                   const ReadFile& read_file) {
  if (bytes.size() > kLargestModel_bytes)
    return Error{ErrorCode::limit_exceeded, "the file is larger than 1 GiB", name, "split the model"};
  if (nested_too_deep(json_part(bytes)))
    return malformed_gltf("the JSON is nested deeper than any model", name);
  if (const auto wrong = check_material_types(json_part(bytes), name))
    return *wrong;
  Files files{read_file, std::nullopt};
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_encoded, nullptr);
  loader.SetFsCallbacks({&Files::exists, &Files::expand, &Files::fetch, nullptr, &files});
  tinygltf::Model model;
  std::string error, warning;
  bool read = false;
  const auto size = static_cast<unsigned int>(bytes.size());
  try { // the library lets those of its JSON parser through
    if (is_binary(bytes))
      read = loader.LoadBinaryFromMemory(&model, &error, &warning, bytes.data(), size, "");
    else
      read =
          loader.LoadASCIIFromString(&model, &error, &warning, reinterpret_cast<const char*>(bytes.data()), size, "");
  } catch (const std::exception& e) {
    error = e.what();
  }
  if (files.error)
    return placed_in(name, *files.error);
  if (!read)
    return malformed_gltf("no valid glTF 2.0" + why_unread(bytes, error), name);
  for (const std::string& extension : model.extensionsRequired)
    if (!is_known_extension(extension))
      return Error{ErrorCode::file_malformed, "the model requires an extension that is not read here",
                   name + ", " + extension.substr(0, 80), "export without it"};
  return model;
}

Result<GltfTriangles> read_triangles(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end())
    return malformed_gltf("a primitive without positions", "meshes");
  Result<std::vector<glm::dvec3>> positions = read_positions(model, position->second);
  if (!positions)
    return positions.error();
  const Result<std::vector<std::uint32_t>> indices = read_indices(model, primitive.indices, positions->size());
  if (!indices)
    return indices.error();
  return GltfTriangles{std::move(*positions), unrolled(*indices, primitive.mode)};
}

Result<GltfVertices> read_vertices(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                   std::size_t count, int uv_set) {
  GltfVertices v;
  const auto read = [&](const std::string& name, int type) -> Result<std::vector<float>> {
    const auto found = primitive.attributes.find(name);
    if (found == primitive.attributes.end())
      return std::vector<float>{};
    auto values = read_attribute(model, found->second, type, count);
    if (!values)
      return placed_in(name, values.error());
    return values;
  };
  const auto normals = read("NORMAL", TINYGLTF_TYPE_VEC3), tangents = read("TANGENT", TINYGLTF_TYPE_VEC4),
             uv = read(fmt::format("TEXCOORD_{}", uv_set), TINYGLTF_TYPE_VEC2);
  for (const auto* attribute : {&normals, &tangents, &uv})
    if (!*attribute)
      return attribute->error();
  for (std::size_t i = 0; i + 2 < normals->size(); i += 3)
    v.normals.emplace_back((*normals)[i], (*normals)[i + 1], (*normals)[i + 2]);
  for (std::size_t i = 0; i + 3 < tangents->size(); i += 4)
    v.tangents.emplace_back((*tangents)[i], (*tangents)[i + 1], (*tangents)[i + 2], (*tangents)[i + 3]);
  for (std::size_t i = 0; i + 1 < uv->size(); i += 2)
    v.uv.emplace_back((*uv)[i], (*uv)[i + 1]);
  if (const auto found = primitive.attributes.find("COLOR_0"); found != primitive.attributes.end()) {
    const bool known = found->second >= 0 && static_cast<std::size_t>(found->second) < model.accessors.size();
    const int type = known && model.accessors[static_cast<std::size_t>(found->second)].type == TINYGLTF_TYPE_VEC4
                         ? TINYGLTF_TYPE_VEC4
                         : TINYGLTF_TYPE_VEC3;
    const auto colour = read("COLOR_0", type);
    if (!colour)
      return colour.error();
    const std::size_t width = type == TINYGLTF_TYPE_VEC4 ? 4 : 3;
    for (std::size_t i = 0; i + width <= colour->size(); i += width)
      v.colour.emplace_back((*colour)[i], (*colour)[i + 1], (*colour)[i + 2]);
  }
  return v;
}

Result<void> walk_meshes(
    const tinygltf::Model& model, const std::string& name,
    const std::function<Result<void>(const tinygltf::Mesh&, const glm::dmat4&, const std::string& where)>& visit) {
  std::vector<bool> seen(model.nodes.size(), false);
  std::vector<std::pair<int, glm::dmat4>> open;
  for (const int r : roots_of(model))
    open.emplace_back(r, glm::dmat4(1.0));
  std::ranges::reverse(open);
  while (!open.empty()) {
    const auto [index, parent] = open.back();
    open.pop_back();
    const std::string where = fmt::format("node {}", index);
    if (index < 0 || static_cast<std::size_t>(index) >= model.nodes.size())
      return malformed_gltf("a node that is not there", name + ", " + where);
    if (seen[static_cast<std::size_t>(index)])
      return malformed_gltf("a node with two parents, or its own ancestor", name + ", " + where);
    seen[static_cast<std::size_t>(index)] = true;
    const tinygltf::Node& n = model.nodes[static_cast<std::size_t>(index)];
    const glm::dmat4 world = parent * transform(n);
    if (n.mesh >= 0) {
      if (static_cast<std::size_t>(n.mesh) >= model.meshes.size())
        return malformed_gltf("a mesh that is not there", name + ", " + where);
      if (Result<void> done = visit(model.meshes[static_cast<std::size_t>(n.mesh)], world, where); !done)
        return done;
    }
    for (auto c = n.children.rbegin(); c != n.children.rend(); ++c)
      open.emplace_back(*c, world);
  }
  return {};
}

Result<Rgb8Image> read_image(const tinygltf::Model& model, int index) {
  if (index < 0 || static_cast<std::size_t>(index) >= model.images.size())
    return malformed_gltf("an image that is not there", fmt::format("image {}", index));
  const tinygltf::Image& image = model.images[static_cast<std::size_t>(index)];
  const std::string where = image.uri.empty() ? fmt::format("image {}", index) : image.uri;
  std::span<const std::uint8_t> encoded(image.image.data(), image.image.size());
  if (image.bufferView >= 0) {
    const auto bytes = view_bytes(model, image.bufferView);
    if (!bytes)
      return placed_in(where, bytes.error());
    encoded = *bytes;
  }
  return read_ldr_image(encoded, where);
}

Result<Rgb> image_mean(const tinygltf::Model& model, int index) {
  const Result<Rgb8Image> pixels = read_image(model, index);
  if (!pixels)
    return pixels.error();
  std::array<double, 256> linear{};
  for (int v = 0; v < 256; ++v)
    linear[v] = static_cast<double>(srgb_decode(static_cast<float>(v) / 255.0f));
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i + 2 < pixels->bytes.size(); i += 3)
    sum += glm::dvec3(linear[pixels->bytes[i]], linear[pixels->bytes[i + 1]], linear[pixels->bytes[i + 2]]);
  return Rgb(sum / std::max(1.0, static_cast<double>(pixels->bytes.size() / 3)));
}

} // namespace daylit::detail
