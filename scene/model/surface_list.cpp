#include "scene/model/surface_list.h"

#include <algorithm>
#include <cmath>

#include "scene/core/error_place.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMostMaterials = 65535;
constexpr float kMostLean = 0.3f; // of a normal map's mean: stored as sRGB, a flat one would have 0.47

} // namespace

Result<std::uint32_t> SurfaceList::add(ObjectMaterial material, const std::string& where) {
  if (materials.size() >= kMostMaterials)
    return Error{ErrorCode::limit_exceeded, "more than 65,535 materials", where, "simplify the object"};
  if (const auto checked = check_material(material, where); !checked)
    return checked.error();
  materials.push_back(std::move(material));
  return static_cast<std::uint32_t>(materials.size() - 1);
}

Result<std::int32_t> SurfaceList::add_texture(const PictureUse& use, const std::function<Result<Rgb8Image>()>& read,
                                              const std::string& where) {
  if (const auto known = known_.find(use); known != known_.end())
    return known->second;
  auto picture = read();
  if (!picture)
    return placed_in(where, picture.error());
  texels_ += picture->bytes.size() / 3;
  if (texels_ > kMostTexels)
    return Error{ErrorCode::limit_exceeded, "textures of more than 2^26 (67,108,864) texels in all", where,
                 "scale them down: four pictures of 4096 x 4096 are allowed"};
  auto texture = Texture::make(std::move(*picture), use.coding, use.wrap_u, use.wrap_v);
  if (!texture)
    return Error{ErrorCode::file_malformed, texture.error().what, where, texture.error().hint};
  textures.push_back(std::move(*texture));
  return known_[use] = static_cast<std::int32_t>(textures.size() - 1);
}

Result<std::uint32_t> SurfaceList::without_textures(std::uint32_t material, const std::string& where) {
  ObjectMaterial plain = materials[material];
  bool textured = false;
  for (TextureUse* use : plain.texture_uses()) {
    textured = textured || *use;
    *use = {};
  }
  if (!textured)
    return material;
  note(where + ": the material \"" + plain.name +
       "\" has textures, but faces without texture coordinates: they have its plain colour");
  if (const auto known = plain_.find(material); known != plain_.end())
    return known->second;
  const auto added = add(std::move(plain), where);
  if (added)
    plain_[material] = *added;
  return added;
}

void SurfaceList::note(std::string text) {
  if (std::ranges::find(notes, text) == notes.end())
    notes.push_back(std::move(text));
}

void SurfaceList::check_normal_map(std::int32_t texture, const std::string& where) {
  const Rgb mean = 2.0f * textures[static_cast<std::size_t>(texture)].at(glm::vec2(0.5f), 1.0f) - 1.0f;
  if (std::fabs(mean.r) > kMostLean || std::fabs(mean.g) > kMostLean || mean.b < kMostLean)
    note(where +
         ": the normal map leans to one side on the whole; was it saved as a colour picture (sRGB)? Its numbers "
         "are read as they are");
}

} // namespace daylit::detail
