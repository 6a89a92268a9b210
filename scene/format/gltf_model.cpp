#include "scene/format/gltf_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>

#include "scene/image/image_formats.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kLargestModel_bytes = std::size_t{1} << 30;
constexpr int kDeepestNesting = 64; // brackets in the JSON: the library descends by recursion
constexpr std::size_t kMostCorners = 60'000'000;

Error malformed(const std::string& what, const std::string& where) {
  return {ErrorCode::file_malformed, what, where, "export the model again, as one .glb"};
}

/// The JSON part of either form.
std::span<const std::uint8_t> json_part(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 20 || std::memcmp(bytes.data(), "glTF", 4) != 0)
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

Result<std::span<const std::uint8_t>> view_bytes(const tinygltf::Model& model, int index) {
  const std::string where = fmt::format("bufferView {}", index);
  if (index < 0 || static_cast<std::size_t>(index) >= model.bufferViews.size())
    return malformed("a buffer view that is not there", where);
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(index)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size())
    return malformed("a buffer that is not there", where);
  const std::vector<unsigned char>& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    return malformed("a range outside its buffer", where);
  return std::span<const std::uint8_t>(data.data() + view.byteOffset, view.byteLength);
}

/// Elements of an accessor: `count` times `size` bytes, `stride` apart, all inside the buffer.
struct Elements {
  const std::uint8_t* first;
  std::size_t count, stride;
  int component;
};

Result<Elements> elements_of(const tinygltf::Model& model, int index, int type) {
  const std::string where = fmt::format("accessor {}", index);
  if (index < 0 || static_cast<std::size_t>(index) >= model.accessors.size())
    return malformed("an accessor that is not there", where);
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(index)];
  if (a.sparse.isSparse)
    return Error{ErrorCode::file_malformed, "sparse accessors are not read", where, "export without sparse accessors"};
  const int component_bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType));
  if (a.type != type || component_bytes <= 0)
    return malformed("an accessor of the wrong type", where);
  const auto bytes = view_bytes(model, a.bufferView);
  if (!bytes)
    return bytes.error();
  const std::size_t size = static_cast<std::size_t>(component_bytes) *
                           static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
  const std::size_t given = model.bufferViews[static_cast<std::size_t>(a.bufferView)].byteStride;
  const std::size_t stride = given > 0 ? given : size;
  if (stride < size || stride > 4096 || a.byteOffset > bytes->size() || a.count > kMostCorners ||
      (a.count > 0 && (a.count - 1) * stride + size > bytes->size() - a.byteOffset))
    return malformed("an accessor outside its buffer view", where);
  return Elements{bytes->data() + a.byteOffset, a.count, stride, a.componentType};
}

Result<std::vector<glm::dvec3>> read_positions(const tinygltf::Model& model, int accessor) {
  const Result<Elements> e = elements_of(model, accessor, TINYGLTF_TYPE_VEC3);
  if (!e)
    return e.error();
  if (e->component != TINYGLTF_COMPONENT_TYPE_FLOAT)
    return Error{ErrorCode::file_malformed, "positions are not stored as float", fmt::format("accessor {}", accessor),
                 "export without quantisation"};
  std::vector<glm::dvec3> positions;
  positions.reserve(e->count);
  for (std::size_t i = 0; i < e->count; ++i) {
    std::array<float, 3> p{};
    std::memcpy(p.data(), e->first + i * e->stride, sizeof(p));
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      return Error{ErrorCode::value_invalid, "a position is not finite",
                   fmt::format("accessor {}, element {}", accessor, i), "export the model again"};
    positions.emplace_back(p[0], p[1], p[2]);
  }
  return positions;
}

Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& model, int accessor, std::size_t vertices) {
  std::vector<std::uint32_t> indices;
  if (accessor < 0) {
    for (std::uint32_t i = 0; i < vertices; ++i)
      indices.push_back(i);
    return indices;
  }
  const Result<Elements> e = elements_of(model, accessor, TINYGLTF_TYPE_SCALAR);
  if (!e)
    return e.error();
  const std::size_t size = e->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? 1
                           : e->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? 2
                           : e->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT   ? 4
                                                                                    : 0;
  if (size == 0)
    return malformed("indices are no unsigned integers", fmt::format("accessor {}", accessor));
  indices.reserve(e->count);
  for (std::size_t i = 0; i < e->count; ++i) {
    std::uint32_t value = 0;
    std::memcpy(&value, e->first + i * e->stride, size); // little-endian, as glTF
    if (value >= vertices)
      return malformed("an index beyond the positions", fmt::format("accessor {}, element {}", accessor, i));
    indices.push_back(value);
  }
  return indices;
}

/// Components of an attribute as numbers; unsigned integers are normalised to 0..1.
Result<std::vector<float>> read_attribute(const tinygltf::Model& model, int accessor, int type, std::size_t count) {
  const Result<Elements> e = elements_of(model, accessor, type);
  if (!e)
    return e.error();
  const std::string where = fmt::format("accessor {}", accessor);
  if (e->count != count)
    return malformed("an attribute with another number of elements than the positions", where);
  const auto width = static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
  std::vector<float> values;
  values.reserve(count * width);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < width; ++k) {
      const std::uint8_t* at = e->first + i * e->stride;
      float value = 0.0f;
      std::uint16_t word = 0;
      if (e->component == TINYGLTF_COMPONENT_TYPE_FLOAT)
        std::memcpy(&value, at + 4 * k, 4);
      else if (e->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE)
        value = static_cast<float>(at[k]) / 255.0f;
      else if (e->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT)
        std::memcpy(&word, at + 2 * k, 2), value = static_cast<float>(word) / 65535.0f;
      else
        return malformed("an attribute of a type that is not allowed", where);
      if (!(std::fabs(value) < 1e6f))
        return Error{ErrorCode::value_invalid, "an attribute is not finite or absurdly large",
                     fmt::format("{}, element {}", where, i), "export the model again"};
      values.push_back(value);
    }
  return values;
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
    return malformed("the JSON is nested deeper than any model", name);
  Files files{read_file, std::nullopt};
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_encoded, nullptr);
  loader.SetFsCallbacks({&Files::exists, &Files::expand, &Files::fetch, nullptr, &files});
  tinygltf::Model model;
  std::string error, warning;
  bool read = false;
  const auto size = static_cast<unsigned int>(bytes.size());
  try { // the library lets those of its JSON parser through
    if (bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0)
      read = loader.LoadBinaryFromMemory(&model, &error, &warning, bytes.data(), size, "");
    else
      read =
          loader.LoadASCIIFromString(&model, &error, &warning, reinterpret_cast<const char*>(bytes.data()), size, "");
  } catch (const std::exception& e) {
    error = e.what();
  }
  if (files.error)
    return *files.error;
  if (!read) {
    const std::string first = error.substr(0, error.find('\n'));
    return malformed("no valid glTF 2.0" + (first.empty() ? "" : ": " + first.substr(0, 200)), name);
  }
  for (const std::string& extension : model.extensionsRequired)
    if (!is_known_extension(extension))
      return Error{ErrorCode::file_malformed, "the model requires an extension that is not read here",
                   name + ", " + extension.substr(0, 80), "export without it"};
  return model;
}

Result<GltfTriangles> read_triangles(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end())
    return malformed("a primitive without positions", "meshes");
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
    return found == primitive.attributes.end() ? std::vector<float>{}
                                               : read_attribute(model, found->second, type, count);
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
      return malformed("a node that is not there", name + ", " + where);
    if (seen[static_cast<std::size_t>(index)])
      return malformed("a node with two parents, or its own ancestor", name + ", " + where);
    seen[static_cast<std::size_t>(index)] = true;
    const tinygltf::Node& n = model.nodes[static_cast<std::size_t>(index)];
    const glm::dmat4 world = parent * transform(n);
    if (n.mesh >= 0) {
      if (static_cast<std::size_t>(n.mesh) >= model.meshes.size())
        return malformed("a mesh that is not there", name + ", " + where);
      if (Result<void> done = visit(model.meshes[static_cast<std::size_t>(n.mesh)], world, where); !done)
        return done;
    }
    for (auto c = n.children.rbegin(); c != n.children.rend(); ++c)
      open.emplace_back(*c, world);
  }
  return {};
}

Result<Rgb8Image> read_image(const tinygltf::Model& model, int index) {
  const std::string where = fmt::format("image {}", index);
  if (index < 0 || static_cast<std::size_t>(index) >= model.images.size())
    return malformed("an image that is not there", where);
  const tinygltf::Image& image = model.images[static_cast<std::size_t>(index)];
  std::span<const std::uint8_t> encoded(image.image.data(), image.image.size());
  if (image.bufferView >= 0) {
    const auto bytes = view_bytes(model, image.bufferView);
    if (!bytes)
      return bytes.error();
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
