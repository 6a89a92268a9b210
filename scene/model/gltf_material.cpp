#include "scene/model/gltf_material.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

namespace daylit::detail {

namespace {

/// One material while it is read. The first thing that is wrong is kept; what follows it is not looked at.
class Reader {
public:
  Reader(const tinygltf::Model& model, SurfaceList& list, std::string where)
      : model_(model), list_(list), where_(std::move(where)) {}

  std::optional<Error> error;
  std::optional<int> uv_set; ///< of the first texture

  void malformed(const std::string& what) {
    if (!error)
      error = Error{ErrorCode::file_malformed, what, where_, "export the model again"};
  }

  /// An extension of the material; null where it has none of that name.
  const tinygltf::Value* extension(const tinygltf::Material& m, const char* name) {
    const auto found = m.extensions.find(name);
    return error || found == m.extensions.end() ? nullptr : &found->second;
  }

  void number(const tinygltf::Value& of, const char* key, float& out) {
    if (!of.Has(key) || error)
      return;
    if (!of.Get(key).IsNumber())
      return malformed(fmt::format("{} is no number", key));
    out = static_cast<float>(of.Get(key).GetNumberAsDouble());
  }

  void colour(const tinygltf::Value& of, const char* key, Rgb& out) {
    if (!of.Has(key) || error)
      return;
    const tinygltf::Value& value = of.Get(key);
    for (int c = 0; c < 3; ++c) {
      if (!value.IsArray() || value.ArrayLen() != 3 || !value.Get(c).IsNumber())
        return malformed(fmt::format("{} is not three numbers", key));
      out[c] = static_cast<float>(value.Get(c).GetNumberAsDouble());
    }
  }

  /// textureInfo of the core or of an extension: index, set of coordinates, transform.
  template <class Info>
  void texture(const Info& info, TextureCoding coding, TextureUse& out) {
    const auto transform = info.extensions.find("KHR_texture_transform");
    read_texture(info.index, info.texCoord, transform == info.extensions.end() ? nullptr : &transform->second, coding,
                 out);
  }
  void texture(const tinygltf::Value& of, const char* key, TextureUse& out) {
    if (!of.Has(key) || error)
      return;
    const tinygltf::Value& info = of.Get(key);
    if (!info.IsObject() || !info.Get("index").IsInt())
      return malformed(fmt::format("{} names no texture", key));
    const int uv = info.Get("texCoord").IsInt() ? info.Get("texCoord").GetNumberAsInt() : 0;
    const bool extended = info.Get("extensions").IsObject() && info.Get("extensions").Has("KHR_texture_transform");
    read_texture(info.Get("index").GetNumberAsInt(), uv,
                 extended ? &info.Get("extensions").Get("KHR_texture_transform") : nullptr, TextureCoding::linear, out);
  }

private:
  /// KHR_texture_transform: offset x rotation x scale. Turning coordinates counter-clockwise, v down, takes (1, 0) to
  /// (cos, -sin): the first published matrix had the sign of the sine wrong (KhronosGroup/glTF, issue 1563).
  void read_transform(const tinygltf::Value& value, glm::mat3& out, int& uv) {
    if (!value.IsObject())
      return malformed("KHR_texture_transform is no object");
    glm::vec2 offset(0.0f), scale(1.0f);
    float rotation = 0.0f;
    pair(value, "offset", offset);
    pair(value, "scale", scale);
    number(value, "rotation", rotation);
    if (value.Get("texCoord").IsInt())
      uv = value.Get("texCoord").GetNumberAsInt();
    const float c = std::cos(rotation), s = std::sin(rotation);
    out = glm::mat3(glm::vec3(c * scale.x, -s * scale.x, 0.0f), glm::vec3(s * scale.y, c * scale.y, 0.0f),
                    glm::vec3(offset, 1.0f));
    for (int k = 0; k < 3; ++k)
      if (!(std::fabs(out[k].x) < 1e6f && std::fabs(out[k].y) < 1e6f))
        return malformed("KHR_texture_transform with a number that is not finite or above 1e6");
  }

  void pair(const tinygltf::Value& of, const char* key, glm::vec2& out) {
    if (!of.Has(key))
      return;
    const tinygltf::Value& value = of.Get(key);
    if (!value.IsArray() || value.ArrayLen() != 2 || !value.Get(0).IsNumber() || !value.Get(1).IsNumber())
      return malformed(fmt::format("{} is not two numbers", key));
    out = glm::vec2(glm::dvec2(value.Get(0).GetNumberAsDouble(), value.Get(1).GetNumberAsDouble()));
  }

  std::optional<TextureWrap> wrap(int code) {
    switch (code) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT:
      return TextureWrap::repeat;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
      return TextureWrap::mirror;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
      return TextureWrap::clamp;
    default:
      malformed(fmt::format("a sampler with the unknown wrap mode {}", code));
      return std::nullopt;
    }
  }

  void read_texture(int index, int uv, const tinygltf::Value* transform, TextureCoding coding, TextureUse& out) {
    if (index < 0 || error)
      return;
    if (static_cast<std::size_t>(index) >= model_.textures.size())
      return malformed("a texture that is not there");
    TextureUse use;
    if (transform)
      read_transform(*transform, use.uv_from_mesh, uv);
    if (error)
      return;
    if (uv != uv_set.value_or(uv))
      return list_.note(where_ + ": a texture with another set of texture coordinates than the first is left out");
    uv_set = uv;
    const tinygltf::Texture& texture = model_.textures[static_cast<std::size_t>(index)];
    if (texture.source < 0 && !texture.extensions.empty())
      return malformed(fmt::format("a texture of a kind that is not read ({})", texture.extensions.begin()->first));
    add(texture, coding, use);
    out = use;
  }

  void add(const tinygltf::Texture& texture, TextureCoding coding, TextureUse& use) {
    PictureUse picture{fmt::format("{}", texture.source), coding};
    if (texture.sampler >= 0) {
      if (static_cast<std::size_t>(texture.sampler) >= model_.samplers.size())
        return malformed("a sampler that is not there");
      const tinygltf::Sampler& sampler = model_.samplers[static_cast<std::size_t>(texture.sampler)];
      const auto u = wrap(sampler.wrapS), v = wrap(sampler.wrapT);
      if (!u || !v)
        return;
      picture.wrap_u = *u;
      picture.wrap_v = *v;
    }
    const auto added = list_.add_texture(
        picture, [&] { return read_image(model_, texture.source); }, where_);
    if (added)
      use.texture = *added;
    else
      error = added.error();
  }

  const tinygltf::Model& model_;
  SurfaceList& list_;
  std::string where_;
};

void read_core(const tinygltf::Material& given, Reader& reader, ObjectMaterial& m) {
  const tinygltf::PbrMetallicRoughness& pbr = given.pbrMetallicRoughness;
  m.base_colour = Rgb(1.0f);
  for (std::size_t c = 0; c < 3; ++c) {
    if (c < pbr.baseColorFactor.size())
      m.base_colour[static_cast<int>(c)] = static_cast<float>(pbr.baseColorFactor[c]);
    if (c < given.emissiveFactor.size())
      m.emission[static_cast<int>(c)] = static_cast<float>(given.emissiveFactor[c]);
  }
  m.metallic = static_cast<float>(pbr.metallicFactor);
  m.roughness = static_cast<float>(pbr.roughnessFactor);
  m.normal_scale = static_cast<float>(given.normalTexture.scale);
  m.occlusion_strength = static_cast<float>(given.occlusionTexture.strength);
  reader.texture(pbr.baseColorTexture, TextureCoding::srgb, m.base_colour_texture);
  reader.texture(pbr.metallicRoughnessTexture, TextureCoding::linear, m.metallic_roughness_texture);
  reader.texture(given.normalTexture, TextureCoding::linear, m.normal_texture);
  reader.texture(given.occlusionTexture, TextureCoding::linear, m.occlusion_texture);
  reader.texture(given.emissiveTexture, TextureCoding::srgb, m.emission_texture);
}

void read_glass(const tinygltf::Material& given, Reader& reader, ObjectMaterial& m) {
  float thickness = 0.0f, distance = std::numeric_limits<float>::infinity();
  if (const auto* e = reader.extension(given, "KHR_materials_ior"))
    reader.number(*e, "ior", m.ior);
  if (const auto* e = reader.extension(given, "KHR_materials_transmission")) {
    reader.number(*e, "transmissionFactor", m.transmission);
    reader.texture(*e, "transmissionTexture", m.transmission_texture);
  }
  if (const auto* e = reader.extension(given, "KHR_materials_volume")) {
    reader.number(*e, "thicknessFactor", thickness);
    reader.number(*e, "attenuationDistance", distance);
    reader.colour(*e, "attenuationColor", m.attenuation_colour);
  }
  if (const auto* e = reader.extension(given, "KHR_materials_dispersion"))
    reader.number(*e, "dispersion", m.dispersion);
  if (!(thickness >= 0.0f) || !(distance > 0.0f))
    reader.malformed("KHR_materials_volume with a thickness below 0, or an attenuation distance that is not above 0");
  m.thin = m.transmission > 0.0f && thickness == 0.0f;
  m.attenuation_distance_m = std::isinf(distance) ? 0.0f : distance;
}

void read_layers(const tinygltf::Material& given, Reader& reader, ObjectMaterial& m) {
  if (const auto* e = reader.extension(given, "KHR_materials_clearcoat")) {
    reader.number(*e, "clearcoatFactor", m.clearcoat);
    reader.number(*e, "clearcoatRoughnessFactor", m.clearcoat_roughness);
    reader.texture(*e, "clearcoatTexture", m.clearcoat_texture);
    reader.texture(*e, "clearcoatRoughnessTexture", m.clearcoat_roughness_texture);
  }
  if (const auto* e = reader.extension(given, "KHR_materials_anisotropy")) {
    reader.number(*e, "anisotropyStrength", m.anisotropy);
    reader.number(*e, "anisotropyRotation", m.anisotropy_rotation);
    reader.texture(*e, "anisotropyTexture", m.anisotropy_texture);
  }
  if (const auto* e = reader.extension(given, "KHR_materials_emissive_strength")) {
    float strength = 1.0f;
    reader.number(*e, "emissiveStrength", strength);
    m.emission *= strength;
  }
}

/// What a file says and this program leaves out.
void note_unread(const tinygltf::Material& given, const std::string& where, SurfaceList& list) {
  for (const auto& [name, value] : given.extensions)
    if (!is_known_extension(name))
      list.note(where + ": " + name + " is not read");
  if (const auto coat = given.extensions.find("KHR_materials_clearcoat");
      coat != given.extensions.end() && coat->second.IsObject() && coat->second.Has("clearcoatNormalTexture"))
    list.note(where + ": the clear coat has the normals of the base, not a map of its own");
  if (!given.alphaMode.empty() && given.alphaMode != "OPAQUE")
    list.note(where + ": alpha is not read, the surface is opaque; glass has KHR_materials_transmission");
}

} // namespace

Result<GltfMaterials::Found> GltfMaterials::at(int index) {
  if (const auto known = known_.find(index); known != known_.end())
    return known->second;
  const auto found = read(index);
  if (found)
    known_[index] = *found;
  return found;
}

Result<GltfMaterials::Found> GltfMaterials::read(int index) {
  std::string where = fmt::format("{}, material {}", name_, index);
  if (index < 0) {
    const auto added = list_.add({.base_colour = fallback_}, where);
    return added ? Result<Found>(Found{*added, 0}) : added.error();
  }
  if (static_cast<std::size_t>(index) >= model_.materials.size())
    return Error{ErrorCode::file_malformed, "a material that is not there", where, "export the model again"};
  const tinygltf::Material& given = model_.materials[static_cast<std::size_t>(index)];
  if (!given.name.empty())
    where += fmt::format(" \"{}\"", given.name);
  Reader reader(model_, list_, where);
  ObjectMaterial m{.name = given.name};
  read_core(given, reader, m);
  read_glass(given, reader, m);
  read_layers(given, reader, m);
  if (reader.error)
    return *reader.error;
  note_unread(given, where, list_);
  if (m.normal_texture)
    list_.check_normal_map(m.normal_texture.texture, where);
  const auto added = list_.add(std::move(m), where);
  return added ? Result<Found>(Found{*added, reader.uv_set.value_or(0)}) : added.error();
}

} // namespace daylit::detail
