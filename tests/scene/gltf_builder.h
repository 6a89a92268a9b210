#pragma once

// Writes small glTF files in memory: one buffer, one mesh per material.

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "scene/room/room.h"

namespace daylit::test {

struct GltfParts {
  std::vector<std::uint8_t> buffer;
  std::string views, accessors, meshes, materials, nodes; ///< JSON array bodies
  std::vector<int> roots;
  std::string more; ///< further top-level members, each with a leading comma

  template <class T>
  int add_view(const std::vector<T>& values) {
    while (buffer.size() % 4 != 0)
      buffer.push_back(0);
    const std::size_t at = buffer.size();
    buffer.resize(at + values.size() * sizeof(T));
    std::memcpy(buffer.data() + at, values.data(), values.size() * sizeof(T));
    views += fmt::format("{}{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{}}}", views.empty() ? "" : ",", at,
                         values.size() * sizeof(T));
    return view_count++;
  }
  int add_accessor(int view, int component, std::size_t count, const char* type) {
    accessors += fmt::format("{}{{\"bufferView\":{},\"componentType\":{},\"count\":{},\"type\":\"{}\"}}",
                             accessors.empty() ? "" : ",", view, component, count, type);
    return accessor_count++;
  }
  int add_material(const std::string& json) {
    materials += (materials.empty() ? "" : ",") + json;
    return material_count++;
  }
  /// z up positions are turned to the y up of the format.
  int add_mesh(const std::vector<glm::dvec3>& positions, const std::vector<std::uint16_t>& indices, int material) {
    std::vector<float> p;
    for (const glm::dvec3& v : positions)
      p.insert(p.end(), {static_cast<float>(v.x), static_cast<float>(v.z), static_cast<float>(-v.y)});
    const int a = add_accessor(add_view(p), 5126, positions.size(), "VEC3");
    const int i = add_accessor(add_view(indices), 5123, indices.size(), "SCALAR");
    meshes +=
        fmt::format("{}{{\"primitives\":[{{\"attributes\":{{\"POSITION\":{}}},\"indices\":{},\"material\":{}}}]}}",
                    meshes.empty() ? "" : ",", a, i, material);
    return mesh_count++;
  }
  int add_node(const std::string& json, bool root = true) {
    nodes += (nodes.empty() ? "" : ",") + json;
    if (root)
      roots.push_back(node_count);
    return node_count++;
  }

  std::string json(const std::string& buffer_uri = "") const {
    std::string root_list;
    for (const int r : roots)
      root_list += fmt::format("{}{}", root_list.empty() ? "" : ",", r);
    const std::string uri = buffer_uri.empty() ? "" : ",\"uri\":\"" + buffer_uri + "\"";
    return fmt::format("{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[{}]}}],\"nodes\":[{}],"
                       "\"meshes\":[{}],\"materials\":[{}],\"accessors\":[{}],\"bufferViews\":[{}],"
                       "\"buffers\":[{{\"byteLength\":{}{}}}]{}}}",
                       root_list, nodes, meshes, materials, accessors, views, buffer.size(), uri, more);
  }

  std::vector<std::uint8_t> glb() const { return glb(json()); }
  std::vector<std::uint8_t> glb(std::string text) const {
    while (text.size() % 4 != 0)
      text += ' ';
    std::vector<std::uint8_t> data = buffer;
    while (data.size() % 4 != 0)
      data.push_back(0);
    std::vector<std::uint8_t> out;
    const auto word = [&out](std::uint32_t w) {
      for (int k = 0; k < 4; ++k)
        out.push_back(static_cast<std::uint8_t>(w >> (8 * k)));
    };
    word(0x46546C67u);
    word(2);
    word(static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + data.size()));
    word(static_cast<std::uint32_t>(text.size()));
    word(0x4E4F534Au);
    out.insert(out.end(), text.begin(), text.end());
    word(static_cast<std::uint32_t>(data.size()));
    word(0x004E4942u);
    out.insert(out.end(), data.begin(), data.end());
    return out;
  }

  int view_count = 0, accessor_count = 0, material_count = 0, mesh_count = 0, node_count = 0;
};

/// A square of one metre in the file's x-y plane (in the world: upright, facing -y), u to the right, v down.
inline GltfParts square(const std::string& material, const std::string& attributes = "") {
  GltfParts parts;
  const std::vector<float> p{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, uv{0, 1, 1, 1, 1, 0, 0, 0},
      normal{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  const std::vector<std::uint8_t> colour{255, 0, 0, 255, 255, 0, 0, 255, 0, 255, 0, 255, 0, 255, 0, 255};
  parts.add_accessor(parts.add_view(p), 5126, 4, "VEC3");
  parts.add_accessor(parts.add_view(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3}), 5123, 6, "SCALAR");
  parts.add_accessor(parts.add_view(uv), 5126, 4, "VEC2");
  parts.add_accessor(parts.add_view(normal), 5126, 4, "VEC3");
  parts.add_accessor(parts.add_view(colour), 5121, 4, "VEC4");
  parts.add_material(material);
  parts.meshes = "{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":3" + attributes +
                 "},\"indices\":1,\"material\":0}]}";
  parts.add_node("{\"mesh\":0}");
  return parts;
}

/// The room as one mesh and node per material.
inline GltfParts gltf_of(const Room& room) {
  GltfParts parts;
  for (std::uint32_t m = 0; m < room.materials.size(); ++m) {
    const Rgb c = room.materials[m].reflectance;
    parts.add_material(fmt::format("{{\"name\":\"{}\",\"pbrMetallicRoughness\":{{\"baseColorFactor\":[{},{},{},1]}}}}",
                                   room.materials[m].name, c.r, c.g, c.b));
    std::vector<glm::dvec3> positions;
    std::vector<std::uint16_t> indices;
    for (const RoomTriangle& t : room.triangles)
      for (int k = 0; k < 3 && t.material == m; ++k) {
        indices.push_back(static_cast<std::uint16_t>(positions.size()));
        positions.push_back(room.corner(t, k));
      }
    if (!positions.empty())
      parts.add_node(fmt::format("{{\"mesh\":{}}}", parts.add_mesh(positions, indices, static_cast<int>(m))));
  }
  return parts;
}

} // namespace daylit::test
