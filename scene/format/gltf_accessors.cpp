#include "scene/format/gltf_accessors.h"

#include <array>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

namespace daylit::detail {

namespace {

constexpr std::size_t kMostCorners = 60'000'000;

/// Elements of an accessor: `count` times `size` bytes, `stride` apart, all inside the buffer.
struct Elements {
  const std::uint8_t* first;
  std::size_t count, stride;
  int component;
};

Result<Elements> elements_of(const tinygltf::Model& model, int index, int type) {
  const std::string where = fmt::format("accessor {}", index);
  if (index < 0 || static_cast<std::size_t>(index) >= model.accessors.size())
    return malformed_gltf("an accessor that is not there", where);
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(index)];
  if (a.sparse.isSparse)
    return Error{ErrorCode::file_malformed, "sparse accessors are not read", where, "export without sparse accessors"};
  const int component_bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType));
  if (a.type != type || component_bytes <= 0)
    return malformed_gltf("an accessor of the wrong type", where);
  const auto bytes = view_bytes(model, a.bufferView);
  if (!bytes)
    return bytes.error();
  const std::size_t size = static_cast<std::size_t>(component_bytes) *
                           static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
  const std::size_t given = model.bufferViews[static_cast<std::size_t>(a.bufferView)].byteStride;
  const std::size_t stride = given > 0 ? given : size;
  if (stride < size || stride > 4096 || a.byteOffset > bytes->size() || a.count > kMostCorners ||
      (a.count > 0 && (a.count - 1) * stride + size > bytes->size() - a.byteOffset))
    return malformed_gltf("an accessor outside its buffer view", where);
  return Elements{bytes->data() + a.byteOffset, a.count, stride, a.componentType};
}

} // namespace

Error malformed_gltf(const std::string& what, const std::string& where) {
  return {ErrorCode::file_malformed, what, where, "export the model again, as one .glb"};
}

Result<std::span<const std::uint8_t>> view_bytes(const tinygltf::Model& model, int index) {
  const std::string where = fmt::format("bufferView {}", index);
  if (index < 0 || static_cast<std::size_t>(index) >= model.bufferViews.size())
    return malformed_gltf("a buffer view that is not there", where);
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(index)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size())
    return malformed_gltf("a buffer that is not there", where);
  const std::vector<unsigned char>& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    return malformed_gltf("a range outside its buffer", where);
  return std::span<const std::uint8_t>(data.data() + view.byteOffset, view.byteLength);
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
    return malformed_gltf("indices are no unsigned integers", fmt::format("accessor {}", accessor));
  indices.reserve(e->count);
  for (std::size_t i = 0; i < e->count; ++i) {
    std::uint32_t value = 0;
    std::memcpy(&value, e->first + i * e->stride, size); // little-endian, as glTF
    if (value >= vertices)
      return malformed_gltf("an index beyond the positions", fmt::format("accessor {}, element {}", accessor, i));
    indices.push_back(value);
  }
  return indices;
}

Result<std::vector<float>> read_attribute(const tinygltf::Model& model, int accessor, int type, std::size_t count) {
  const Result<Elements> e = elements_of(model, accessor, type);
  if (!e)
    return e.error();
  const std::string where = fmt::format("accessor {}", accessor);
  if (e->count != count)
    return malformed_gltf("an attribute with another number of elements than the positions", where);
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
        return malformed_gltf("an attribute of a type that is not allowed", where);
      if (!(std::fabs(value) < 1e6f))
        return Error{ErrorCode::value_invalid, "an attribute is not finite or absurdly large",
                     fmt::format("{}, element {}", where, i), "export the model again"};
      values.push_back(value);
    }
  return values;
}

} // namespace daylit::detail
