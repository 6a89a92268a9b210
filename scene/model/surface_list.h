#pragma once

// Materials and textures as the OBJ and glTF readers collect them.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/material/material.h"

namespace daylit::detail {

/// All pictures of an object together: four of 4096 x 4096, 268 MB of memory with their halved copies.
constexpr std::size_t kMostTexels = std::size_t{1} << 26;

/// How a file uses a picture.
struct PictureUse {
  std::string key; ///< names the picture in the file
  TextureCoding coding = TextureCoding::srgb;
  TextureWrap wrap_u = TextureWrap::repeat, wrap_v = TextureWrap::repeat;
  auto operator<=>(const PictureUse&) const = default;
};

class SurfaceList {
public:
  std::vector<ObjectMaterial> materials;
  std::vector<Texture> textures;
  std::vector<std::string> notes; ///< for people, one line each, none twice

  /// Index of the material. Errors: a number out of its range; more than 65,535 materials.
  Result<std::uint32_t> add(ObjectMaterial material, const std::string& where);
  /// Index of the texture; a picture is read once for each use. `where`: file and material that ask for it. Errors:
  /// those of `read`, an empty picture, more texels than an object may have.
  Result<std::int32_t> add_texture(const PictureUse& use, const std::function<Result<Rgb8Image>()>& read,
                                   const std::string& where);
  /// The material as it is where a face has no texture coordinates: its factors alone count.
  Result<std::uint32_t> without_textures(std::uint32_t material, const std::string& where);
  void note(std::string text);
  /// Notes a normal map whose mean leans: its numbers were stored as a colour, or it is another map.
  void check_normal_map(std::int32_t texture, const std::string& where);

private:
  std::map<PictureUse, std::int32_t> known_;
  std::map<std::uint32_t, std::uint32_t> plain_; ///< materials without their textures
  std::size_t texels_ = 0;
};

} // namespace daylit::detail
