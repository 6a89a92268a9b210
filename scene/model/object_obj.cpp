#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>
#include <string_view>
#include <system_error>

#include <glm/geometric.hpp>
#include <tiny_obj_loader.h>

#include "scene/core/atomic_file.h"
#include "scene/model/triangle_soup.h"

namespace daylit::detail {

namespace {

/// Reads MTL files beside the OBJ: regular files of sane size only. A missing one leaves the fallback reflectance.
class MaterialBeside : public tinyobj::MaterialReader {
public:
  explicit MaterialBeside(std::filesystem::path folder) : folder_(std::move(folder)) {}
  bool operator()(const std::string& id, std::vector<tinyobj::material_t>* materials, std::map<std::string, int>* map,
                  std::string* warnings, std::string* errors) override {
    std::error_code ec;
    const std::filesystem::path path = folder_ / id;
    if (!std::filesystem::is_regular_file(path, ec))
      return false;
    const auto bytes = read_whole_file(path, std::size_t{1} << 24);
    if (!bytes)
      return false;
    std::istringstream text(std::string(bytes->begin(), bytes->end()));
    tinyobj::LoadMtl(map, materials, &text, warnings, errors);
    return true;
  }

private:
  std::filesystem::path folder_;
};

bool all_finite(const std::vector<tinyobj::real_t>& values) {
  for (const tinyobj::real_t v : values)
    if (!(std::abs(v) < 1e15))
      return false;
  return true;
}

/// The parser reads "nan" and other non-numbers as 0 without a word; such a vertex line is looked for first.
/// Number of the first line (from 1) whose v or vn entry is not at least three plain numbers, or 0.
std::size_t bad_vertex_line(std::string_view text) {
  std::size_t line_number = 0;
  while (!text.empty()) {
    ++line_number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    const std::size_t key = line.starts_with("v ") || line.starts_with("v\t")     ? 1
                            : line.starts_with("vn ") || line.starts_with("vn\t") ? 2
                                                                                  : 0;
    if (key == 0)
      continue;
    line.remove_prefix(key);
    for (int i = 0; i < 3; ++i) {
      line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
      if (line.starts_with('+'))
        line.remove_prefix(1);
      double value = 0;
      const auto [stop, code] = std::from_chars(line.data(), line.data() + line.size(), value);
      if (code != std::errc() || !std::isfinite(value))
        return line_number;
      line.remove_prefix(static_cast<std::size_t>(stop - line.data()));
    }
  }
  return 0;
}

Error obj_error(const std::filesystem::path& path, const std::string& what) {
  return {ErrorCode::file_malformed, what, path.string(), "the file is damaged: export it again as OBJ"};
}

struct ObjSurface {
  Rgb reflectance{0.5f};
  std::int32_t texture = -1;
};

/// Kd, times map_Kd (a file beside the OBJ, below its folder) where there is one.
Result<std::vector<ObjSurface>> surfaces_of(const std::vector<tinyobj::material_t>& materials,
                                            const std::filesystem::path& path, TriangleSoup& soup) {
  std::vector<ObjSurface> out;
  std::map<std::string, std::int32_t> textures;
  for (const tinyobj::material_t& m : materials) {
    out.push_back(
        {Rgb(static_cast<float>(m.diffuse[0]), static_cast<float>(m.diffuse[1]), static_cast<float>(m.diffuse[2]))});
    for (int c = 0; c < 3; ++c)
      if (!(out.back().reflectance[c] >= 0 && out.back().reflectance[c] <= 1))
        return Error{ErrorCode::value_invalid, "reflectance Kd outside 0..1", path.string() + ", material " + m.name,
                     "give Kd between 0 and 1"};
    if (m.diffuse_texname.empty())
      continue;
    const auto known = textures.find(m.diffuse_texname);
    if (known == textures.end()) {
      const std::filesystem::path file = path.parent_path() / m.diffuse_texname;
      const auto added = add_texture(soup, read_ldr_image(file), file.string());
      if (!added)
        return added.error();
      textures[m.diffuse_texname] = *added;
    }
    out.back().texture = textures[m.diffuse_texname];
  }
  return out;
}

/// Origin turned from bottom left to top left.
glm::vec2 texture_coordinate(const tinyobj::attrib_t& attrib, int index) {
  if (index < 0 || 2 * static_cast<std::size_t>(index) + 1 >= attrib.texcoords.size())
    return glm::vec2(0.0f);
  const std::size_t at = 2 * static_cast<std::size_t>(index);
  return glm::vec2(attrib.texcoords[at], 1.0 - attrib.texcoords[at + 1]);
}

Result<void> add_shapes(const tinyobj::attrib_t& attrib, const std::vector<tinyobj::shape_t>& shapes,
                        const std::vector<ObjSurface>& surfaces, const std::filesystem::path& path, Rgb fallback,
                        TriangleSoup& soup) {
  if (!all_finite(attrib.vertices) || !all_finite(attrib.normals) || !all_finite(attrib.texcoords))
    return obj_error(path, "a coordinate is NaN, infinite or above 1e15");
  for (std::size_t i = 0; i + 2 < attrib.vertices.size(); i += 3)
    soup.positions.emplace_back(attrib.vertices[i], attrib.vertices[i + 1], attrib.vertices[i + 2]);
  for (std::size_t i = 0; i + 2 < attrib.normals.size(); i += 3)
    soup.normals.emplace_back(attrib.normals[i], attrib.normals[i + 1], attrib.normals[i + 2]);
  std::vector<SoupCorner> corners;
  for (const tinyobj::shape_t& shape : shapes) {
    std::size_t first = 0;
    for (std::size_t f = 0; f < shape.mesh.num_face_vertices.size(); ++f) {
      const std::size_t n = shape.mesh.num_face_vertices[f];
      if (n > shape.mesh.indices.size() - first)
        return obj_error(path, "a face has missing corners");
      corners.clear();
      bool has_uv = true;
      for (std::size_t k = 0; k < n; ++k) {
        const tinyobj::index_t index = shape.mesh.indices[first + k];
        if (index.vertex_index < 0 || static_cast<std::size_t>(index.vertex_index) >= soup.positions.size() ||
            index.normal_index >= static_cast<int>(soup.normals.size()))
          return obj_error(path, "face " + std::to_string(f) + " of \"" + shape.name.substr(0, 40) +
                                     "\" uses a vertex that does not exist");
        has_uv = has_uv && index.texcoord_index >= 0;
        const bool has_normal =
            index.normal_index >= 0 && glm::length(soup.normals[static_cast<std::size_t>(index.normal_index)]) > 1e-6f;
        corners.push_back({static_cast<std::uint32_t>(index.vertex_index), has_normal ? index.normal_index : -1,
                           texture_coordinate(attrib, index.texcoord_index)});
      }
      first += n;
      const int material = f < shape.mesh.material_ids.size() ? shape.mesh.material_ids[f] : -1;
      const bool known = material >= 0 && static_cast<std::size_t>(material) < surfaces.size();
      const ObjSurface surface = known ? surfaces[static_cast<std::size_t>(material)] : ObjSurface{fallback};
      const std::size_t before = soup.triangles.size();
      if (!append_polygon(corners, surface.reflectance, soup))
        return obj_error(path, "face " + std::to_string(f) + " is a concave polygon; triangulate it on export");
      for (std::size_t k = before; k < soup.triangles.size(); ++k)
        soup.triangles[k].texture = has_uv ? surface.texture : -1;
    }
  }
  return {};
}

} // namespace

Result<TriangleSoup> parse_obj_soup(std::span<const std::uint8_t> bytes, const std::filesystem::path& path,
                                    Rgb fallback) {
  const std::string_view text_view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (const std::size_t line = bad_vertex_line(text_view))
    return obj_error(path, "line " + std::to_string(line) + " is not a vertex with three finite numbers");
  tinyobj::attrib_t attrib;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warnings, errors;
  try {
    std::istringstream text{std::string(text_view)};
    MaterialBeside reader(path.parent_path());
    if (!tinyobj::LoadObj(&attrib, &shapes, &materials, &warnings, &errors, &text, &reader, /*triangulate=*/false))
      return obj_error(path, "not a readable OBJ file (" + errors.substr(0, 200) + ")");
  } catch (const std::exception& error) {
    return obj_error(path, std::string("not a readable OBJ file (") + error.what() + ")");
  }
  TriangleSoup soup;
  const auto surfaces = surfaces_of(materials, path, soup);
  if (!surfaces)
    return surfaces.error();
  if (const auto added = add_shapes(attrib, shapes, *surfaces, path, fallback, soup); !added)
    return added.error();
  return soup;
}

} // namespace daylit::detail
