#include <algorithm>
#include <map>
#include <span>
#include <system_error>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>

#include "scene/core/read_file.h"
#include "scene/format/obj_text.h"
#include "scene/model/mtl_material.h"
#include "scene/model/triangle_soup.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMostLibraryBytes = std::size_t{1} << 24, kMostNamed = 5;

struct Materials {
  std::map<std::string, MtlMaterial> of;
  bool complete = true; ///< every file is there
};

/// Materials of the MTL files beside the OBJ, by name; the first of a name counts. A missing file has none, and is
/// noted.
Result<Materials> read_libraries(const ObjText& obj, const std::filesystem::path& folder, SurfaceList& list) {
  Materials all;
  for (const std::string& library : obj.libraries) {
    std::error_code failed;
    const std::filesystem::path file = folder / library;
    if (!std::filesystem::is_regular_file(file, failed)) {
      list.note(file.string() + " is not there: its materials are diffuse");
      all.complete = false;
      continue;
    }
    const auto bytes = read_whole_file(file, kMostLibraryBytes);
    if (!bytes)
      return bytes.error();
    auto materials = parse_mtl_text({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, file.string());
    if (!materials)
      return materials.error();
    for (MtlMaterial& m : *materials)
      all.of.try_emplace(m.name, std::move(m));
  }
  return all;
}

class ObjectReader {
public:
  ObjectReader(const ObjText& obj, std::filesystem::path path) : obj_(obj), path_(std::move(path)) {}

  Result<TriangleSoup> run(Rgb fallback) {
    if (!obj_.ends_with_line_break)
      soup_.surfaces.note(path_.string() + ": the file does not end with a line break: check that it is complete");
    const auto materials = read_libraries(obj_, path_.parent_path(), soup_.surfaces);
    if (!materials)
      return materials.error();
    for (const std::string& name : obj_.material_names) {
      const auto material = materials->of.find(name);
      const auto surface = material == materials->of.end()
                               ? soup_.surfaces.add({.name = name, .base_colour = fallback}, path_.string())
                               : surface_of(material->second, fallback);
      if (!surface)
        return surface.error();
      surfaces_.push_back(*surface);
    }
    note_unknown(*materials);
    soup_.positions.assign(obj_.vertices.begin(), obj_.vertices.end());
    soup_.normals.assign(obj_.normals.begin(), obj_.normals.end());
    for (const ObjFace& face : obj_.faces)
      if (const auto added = add_face(face); !added)
        return added.error();
    return std::move(soup_);
  }

private:
  void note_unknown(const Materials& known) {
    std::vector<std::string> unknown;
    for (const std::string& name : obj_.material_names)
      if (known.complete && !name.empty() && !known.of.contains(name))
        unknown.push_back(fmt::format("\"{}\"", name));
    if (!unknown.empty())
      soup_.surfaces.note(fmt::format("{}: in no material file: {}{}; diffuse", path_.string(),
                                      fmt::join(std::span(unknown).first(std::min(unknown.size(), kMostNamed)), ", "),
                                      unknown.size() > kMostNamed ? ", ..." : ""));
  }

  Result<std::uint32_t> surface_of(const MtlMaterial& mtl, Rgb fallback) {
    const std::string where = path_.string() + ", material " + mtl.name;
    auto m = material_from_mtl(mtl, fallback, where);
    if (!m)
      return m.error();
    for (const auto& [map, coding, use] : {std::tuple(&mtl.texture, TextureCoding::srgb, &m->base_colour_texture),
                                           std::tuple(&mtl.emission_map, TextureCoding::srgb, &m->emission_texture),
                                           std::tuple(&mtl.normal_map, TextureCoding::linear, &m->normal_texture)})
      if (const auto added = add_texture(*map, coding, where, *use); !added)
        return added.error();
    if (m->normal_texture)
      soup_.surfaces.check_normal_map(m->normal_texture.texture, where);
    for (const std::string& keyword : mtl.unread)
      soup_.surfaces.note(where + ": " + keyword + " is not read");
    return soup_.surfaces.add(std::move(*m), where);
  }

  /// A file beside the OBJ. Options count from the bottom left, textures from the top left.
  Result<void> add_texture(const MtlTexture& map, TextureCoding coding, const std::string& where, TextureUse& use) {
    if (map.file.empty())
      return {};
    const std::filesystem::path file = path_.parent_path() / map.file;
    const TextureWrap wrap = map.clamp ? TextureWrap::clamp : TextureWrap::repeat;
    const auto added = soup_.surfaces.add_texture(
        {file.string(), coding, wrap, wrap}, [&] { return read_ldr_image(file); }, where);
    if (!added)
      return added.error();
    use.texture = *added;
    use.uv_from_mesh[0].x = static_cast<float>(map.scale.x);
    use.uv_from_mesh[1].y = static_cast<float>(map.scale.y);
    use.uv_from_mesh[2] = glm::vec3(map.offset.x, 1.0 - map.scale.y - map.offset.y, 1.0);
    return {};
  }

  Result<void> add_face(const ObjFace& face) {
    std::vector<SoupCorner> corners;
    bool has_uv = true;
    for (std::uint32_t k = 0; k < face.corner_count; ++k) {
      const ObjCorner& c = obj_.corners[face.first_corner + k];
      has_uv = has_uv && c.texture >= 0;
      if (c.texture >= std::ssize(obj_.textures) || c.normal >= std::ssize(obj_.normals))
        return error(face, "uses a normal or a texture coordinate that does not exist");
      const bool has_normal = c.normal >= 0 && glm::length(soup_.normals[static_cast<std::size_t>(c.normal)]) > 1e-6f;
      const glm::dvec2 uv = c.texture >= 0 ? obj_.textures[static_cast<std::size_t>(c.texture)] : glm::dvec2(0.0);
      corners.push_back({.position = c.vertex,
                         .normal = has_normal ? static_cast<std::int32_t>(c.normal) : -1,
                         .uv = glm::vec2(uv.x, 1.0 - uv.y)}); // origin turned from bottom left to top left
    }
    Result<std::uint32_t> material = surfaces_[face.material];
    if (!has_uv)
      material = soup_.surfaces.without_textures(*material, path_.string());
    if (!material)
      return material.error();
    if (!append_polygon(corners, *material, soup_))
      return error(face, "is a concave polygon; triangulate it on export");
    return {};
  }

  Error error(const ObjFace& face, const char* what) const {
    return {ErrorCode::file_malformed, std::string("the face ") + what,
            path_.string() + ", line " + std::to_string(face.line), "export the object again"};
  }

  const ObjText& obj_;
  std::filesystem::path path_;
  TriangleSoup soup_;
  std::vector<std::uint32_t> surfaces_; ///< materials, by index of material_names
};

} // namespace

Result<TriangleSoup> parse_obj_soup(std::span<const std::uint8_t> bytes, const std::filesystem::path& path,
                                    Rgb fallback) {
  const auto obj = parse_obj_text({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path.string());
  if (!obj)
    return obj.error();
  return ObjectReader(*obj, path).run(fallback);
}

} // namespace daylit::detail
