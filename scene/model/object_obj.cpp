#include <map>
#include <system_error>

#include <glm/geometric.hpp>

#include "scene/core/read_file.h"
#include "scene/format/obj_text.h"
#include "scene/model/triangle_soup.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMostLibraryBytes = std::size_t{1} << 24;

struct ObjSurface {
  Rgb reflectance{0.5f};
  std::int32_t texture = -1;
};

bool in_unit_range(const Rgb& c) { return c.r >= 0 && c.r <= 1 && c.g >= 0 && c.g <= 1 && c.b >= 0 && c.b <= 1; }

/// Materials of the MTL files beside the OBJ, by name; the first of a name counts. A missing file has none.
Result<std::map<std::string, MtlMaterial>> read_libraries(const ObjText& obj, const std::filesystem::path& folder) {
  std::map<std::string, MtlMaterial> all;
  for (const std::string& library : obj.libraries) {
    std::error_code failed;
    const std::filesystem::path file = folder / library;
    if (!std::filesystem::is_regular_file(file, failed))
      continue;
    const auto bytes = read_whole_file(file, kMostLibraryBytes);
    if (!bytes)
      return bytes.error();
    auto materials = parse_mtl_text({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, file.string());
    if (!materials)
      return materials.error();
    for (MtlMaterial& m : *materials)
      all.try_emplace(m.name, std::move(m));
  }
  return all;
}

class ObjectReader {
public:
  ObjectReader(const ObjText& obj, std::filesystem::path path) : obj_(obj), path_(std::move(path)) {}

  Result<TriangleSoup> run(Rgb fallback) {
    const auto materials = read_libraries(obj_, path_.parent_path());
    if (!materials)
      return materials.error();
    for (const std::string& name : obj_.material_names) {
      const auto material = materials->find(name);
      const auto surface = material == materials->end() ? ObjSurface{fallback} : surface_of(material->second, fallback);
      if (!surface)
        return surface.error();
      surfaces_.push_back(*surface);
    }
    soup_.positions.assign(obj_.vertices.begin(), obj_.vertices.end());
    soup_.normals.assign(obj_.normals.begin(), obj_.normals.end());
    for (const ObjFace& face : obj_.faces)
      if (const auto added = add_face(face); !added)
        return added.error();
    return std::move(soup_);
  }

private:
  /// Kd, times map_Kd (a file beside the OBJ) where there is one.
  Result<ObjSurface> surface_of(const MtlMaterial& m, Rgb fallback) {
    ObjSurface surface{m.reflectance.value_or(m.texture.empty() ? fallback : Rgb(1.0f))};
    if (!in_unit_range(surface.reflectance))
      return Error{ErrorCode::value_invalid, "reflectance Kd outside 0..1", path_.string() + ", material " + m.name,
                   "give Kd between 0 and 1"};
    if (m.texture.empty())
      return surface;
    const auto [known, is_new] = textures_.try_emplace(m.texture, -1);
    if (is_new) {
      const std::filesystem::path file = path_.parent_path() / m.texture;
      const auto added = add_texture(soup_, read_ldr_image(file), file.string());
      if (!added)
        return added.error();
      known->second = *added;
    }
    surface.texture = known->second;
    return surface;
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
      corners.push_back({c.vertex, has_normal ? static_cast<std::int32_t>(c.normal) : -1,
                         glm::vec2(uv.x, 1.0 - uv.y)}); // origin turned from bottom left to top left
    }
    const ObjSurface& surface = surfaces_[face.material];
    const std::size_t before = soup_.triangles.size();
    if (!append_polygon(corners, surface.reflectance, soup_))
      return error(face, "is a concave polygon; triangulate it on export");
    for (std::size_t k = before; k < soup_.triangles.size(); ++k)
      soup_.triangles[k].texture = has_uv ? surface.texture : -1;
    return {};
  }

  Error error(const ObjFace& face, const char* what) const {
    return {ErrorCode::file_malformed, std::string("the face ") + what,
            path_.string() + ", line " + std::to_string(face.line), "export the object again"};
  }

  const ObjText& obj_;
  std::filesystem::path path_;
  TriangleSoup soup_;
  std::vector<ObjSurface> surfaces_; ///< by index of material_names
  std::map<std::string, std::int32_t> textures_;
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
