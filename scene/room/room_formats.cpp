#include "scene/room/room_formats.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "scene/core/checksum.h"
#include "scene/core/lower_case.h"
#include "scene/core/read_file.h"
#include "scene/format/foreign_model.h"
#include "scene/format/obj_text.h"
#include "scene/room/face_collector.h"
#include "scene/room/glass.h"
#include "scene/room/room_hbjson.h"
#include "scene/room/room_rad.h"

namespace daylit {

namespace {

constexpr std::size_t kLargestFile_bytes = std::size_t{1} << 30;
constexpr float kDefaultReflectance = 0.5f;

using MaterialFile = std::map<std::string, detail::MtlMaterial>;

bool in_unit_range(const Rgb& c) {
  return c.r >= 0.0f && c.r <= 1.0f && c.g >= 0.0f && c.g <= 1.0f && c.b >= 0.0f && c.b <= 1.0f;
}

Error range_error(const std::string& quantity, const Rgb& c, const std::string& material) {
  return {ErrorCode::value_invalid, fmt::format("{} {:g} {:g} {:g} is outside 0..1", quantity, c.r, c.g, c.b),
          "material \"" + material + "\"", "set it to the fraction of light, 0 to 1, in the MTL file"};
}

Result<MaterialFile> read_libraries(const detail::ObjText& obj, const ReadLibrary& read_library, RoomReport& report) {
  MaterialFile all;
  for (const std::string& library : obj.libraries) {
    const Result<std::string> text = read_library(library);
    if (!text)
      return text.error();
    Result<std::vector<detail::MtlMaterial>> materials = detail::parse_mtl_text(*text, library);
    if (!materials)
      return materials.error();
    for (detail::MtlMaterial& m : *materials) {
      const std::string name = m.name;
      if (!all.try_emplace(name, std::move(m)).second)
        report.notes.push_back(fmt::format("material \"{}\" is defined more than once: the first one counts", name));
    }
  }
  return all;
}

/// A pane of `illum 7`: the Fresnel slab of index Ni, times Tf.
Result<Material> clear_glass(Material material, const detail::MtlMaterial& mtl, RoomReport& report) {
  const double index = mtl.refractive_index.value_or(kClearGlassIndex);
  if (!(index >= 1.0 && index <= kLargestGlassIndex))
    return Error{ErrorCode::value_invalid,
                 fmt::format("refractive index {:g} is outside 1..{:g}", index, kLargestGlassIndex),
                 "material \"" + material.name + "\"", "glass has Ni 1.52"};
  material.refractive_index = static_cast<float>(index);
  report.notes.push_back(fmt::format("window material \"{}\": {}, {:.4f} at normal incidence", material.name,
                                     pane_model_name(material.refractive_index), clear_slab_transmittance(1.0, index)));
  return material;
}

/// The definition of this name; else the first one of the same letters in another case.
MaterialFile::const_iterator find_material(const MaterialFile& file, const std::string& name, RoomReport& report) {
  if (const auto exact = file.find(name); exact != file.end())
    return exact;
  const auto similar = std::ranges::find_if(file, [&](const auto& entry) { return same_name(entry.first, name); });
  if (similar != file.end())
    report.notes.push_back(fmt::format("material \"{}\" is taken to be \"{}\"", name, similar->first));
  return similar;
}

Result<Material> make_material(const std::string& name, const MaterialFile& file, RoomReport& report) {
  Material material{.name = name, .reflectance = Rgb(kDefaultReflectance), .is_window = is_window_name(name)};
  const auto entry = find_material(file, name, report);
  if (entry == file.end()) {
    if (name.empty())
      report.notes.push_back("faces without a material: reflectance 0.5 assumed");
    else if (!material.is_window)
      return Error{ErrorCode::value_invalid, "the material is used but not defined", "material \"" + name + "\"",
                   "add it to the MTL file: newmtl " + name + " and Kd r g b"};
    return material;
  }
  const detail::MtlMaterial& mtl = entry->second;
  if (material.is_window) {
    material.reflectance = Rgb(0.0f);
    material.transmittance = mtl.transmittance.value_or(Rgb(1.0f));
    if (!in_unit_range(material.transmittance))
      return range_error("transmittance", material.transmittance, name);
    if (mtl.opacity && !mtl.transmittance && !mtl.is_glass())
      report.notes.push_back(
          fmt::format("window material \"{}\": d/Tr is not used, Tf is missing: transmittance 1", name));
    return mtl.is_glass() ? clear_glass(std::move(material), mtl, report) : material;
  }
  if (mtl.reflectance && !in_unit_range(*mtl.reflectance))
    return range_error("reflectance", *mtl.reflectance, name);
  if (!mtl.reflectance)
    report.notes.push_back(fmt::format("material \"{}\" has no Kd: reflectance 0.5 assumed", name));
  if (!mtl.texture.file.empty())
    report.notes.push_back(fmt::format("material \"{}\": the texture is not read, Kd counts", name));
  if (mtl.emits())
    report.notes.push_back(
        fmt::format("material \"{}\" emits light, which is ignored: light comes from the sky", name));
  material.reflectance = mtl.reflectance.value_or(material.reflectance);
  return material;
}

} // namespace

std::string content_hash(const Room& room) {
  Checksum hash;
  hash.add(room.vertices);
  hash.add(room.triangles);
  for (const Material& m : room.materials) {
    hash.add(std::as_bytes(std::span(m.name)));
    hash.add(std::vector<Rgb>{m.reflectance, m.transmittance, Rgb(m.is_window ? 1.0f : 0.0f), Rgb(m.refractive_index)});
  }
  return hash.hex();
}

Result<RoomFile> parse_obj_room(std::string_view text, const std::string& name, const ReadLibrary& read_library,
                                UpAxis up) {
  Result<detail::ObjText> obj = detail::parse_obj_text(text, name);
  if (!obj)
    return obj.error();
  RoomFile file;
  file.room.vertices = std::move(obj->vertices);
  if (up == UpAxis::y)
    for (glm::dvec3& v : file.room.vertices)
      v = glm::dvec3(v.x, -v.z, v.y);
  const Result<MaterialFile> libraries = read_libraries(*obj, read_library, file.report);
  if (!libraries)
    return libraries.error();
  for (const std::string& material_name : obj->material_names) {
    Result<Material> material = make_material(material_name, *libraries, file.report);
    if (!material) {
      Error error = material.error();
      error.where = name + ", " + error.where;
      return error;
    }
    file.room.materials.push_back(std::move(*material));
  }
  if (const Result<void> done = detail::collect_faces(*obj, name, file.room, file.report); !done)
    return done.error();
  if (!obj->ends_with_line_break)
    file.report.notes.push_back("the file does not end with a line break: check that it is complete");
  file.content_hash = content_hash(file.room);
  return file;
}

namespace {

/// A file that a model names: only beneath the model's own folder, also when links are followed.
Result<std::vector<std::uint8_t>> read_beneath(const std::filesystem::path& model_folder, const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const fs::path folder = fs::weakly_canonical(model_folder.empty() ? fs::path(".") : model_folder, failed);
  const fs::path wanted = fs::weakly_canonical(folder / file, failed);
  const fs::path relative = wanted.lexically_relative(folder);
  if (failed || fs::path(file).is_absolute() || relative.empty() || *relative.begin() == "..")
    return Error{ErrorCode::file_malformed, "the model names a file outside its own folder", "\"" + file + "\"",
                 "put the file beside the model, or export one .glb"};
  return read_whole_file(wanted, kLargestFile_bytes);
}

} // namespace

Result<RoomFile> read_room(const std::filesystem::path& path, UpAxis up) {
  const Result<std::vector<std::uint8_t>> bytes = read_whole_file(path, kLargestFile_bytes);
  if (!bytes)
    return bytes.error();
  if (bytes->empty())
    return Error{ErrorCode::file_malformed, "the file is empty", path.string(), "export the model again"};
  if (const auto foreign = detail::refuse_foreign_model(path, "OBJ, glTF (.glb or .gltf), .rad or .hbjson"))
    return *foreign;
  const std::string extension = lower_case(path.extension().string());
  if (extension == ".ply")
    return Error{ErrorCode::file_malformed, "a room is not read from .ply, which names no materials", path.string(),
                 "export it as OBJ or glTF"};
  const ReadFile read_file = [&path](const std::string& file) { return read_beneath(path.parent_path(), file); };
  if (extension == ".gltf" || extension == ".glb")
    return parse_gltf_room(*bytes, path.string(), read_file);
  const auto read_library = [&path](const std::string& library) -> Result<std::string> {
    const std::filesystem::path beside = path.parent_path() / library;
    const Result<std::vector<std::uint8_t>> text = read_whole_file(beside, kLargestFile_bytes);
    if (text)
      return std::string(text->begin(), text->end());
    Error error = text.error();
    error.hint = "put the material file named by mtllib beside the OBJ";
    return error;
  };
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  if (extension == ".rad")
    return parse_rad_room(text, path.string(), read_file, up);
  if (extension == ".hbjson")
    return parse_hbjson_room(text, path.string());
  return parse_obj_room(text, path.string(), read_library, up);
}

} // namespace daylit
