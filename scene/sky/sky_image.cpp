#include "scene/sky/sky_image.h"

#include <cmath>

#include "scene/image/image_formats.h"

namespace daylit {

namespace {

struct BadTexels {
  std::size_t not_finite = 0, negative = 0, first = 0;
};

/// Counts unusable radiances inside the field and clears what lies outside it.
BadTexels check_texels(RgbImage& image, const std::vector<float>& solid_angle) {
  BadTexels bad;
  for (std::size_t i = 0; i < image.texels.size(); ++i) {
    Rgb& texel = image.texels[i];
    if (solid_angle[i] == 0) {
      texel = Rgb(0.0f);
      continue;
    }
    const bool finite = std::isfinite(texel.r) && std::isfinite(texel.g) && std::isfinite(texel.b);
    const bool negative = finite && (texel.r < 0 || texel.g < 0 || texel.b < 0);
    if ((!finite || negative) && bad.not_finite + bad.negative == 0)
      bad.first = i;
    bad.not_finite += finite ? 0 : 1;
    bad.negative += negative ? 1 : 0;
  }
  return bad;
}

Error radiance_error(const BadTexels& bad, int width, const std::string& name) {
  const std::size_t w = static_cast<std::size_t>(width);
  std::string what =
      bad.not_finite ? "radiance is NaN or infinite in " + std::to_string(bad.not_finite) + " pixels" : "";
  if (bad.negative)
    what += (what.empty() ? "radiance is negative in " : ", negative in ") + std::to_string(bad.negative) + " pixels";
  return {ErrorCode::value_invalid, what,
          name + ", first at pixel (" + std::to_string(bad.first % w) + ", " + std::to_string(bad.first / w) + ")",
          bad.not_finite ? "re-export the image as 32-bit float (half floats overflow at 65504), or mask these pixels"
                         : "re-export the image without sharpening or denoising, and in Rec. 709 primaries"};
}

/// Cosine-weighted mean radiance of the measured part above the horizon.
/// L = sum(L_i cos Z_i dOmega_i) / sum(cos Z_i dOmega_i), over pixels above the horizon.
std::optional<Rgb> measured_mean(const RgbImage& image, const std::vector<float>& projected) {
  glm::dvec3 sum{0.0};
  double weight = 0;
  for (std::size_t i = 0; i < projected.size(); ++i) {
    sum += double(projected[i]) * glm::dvec3(image.texels[i]);
    weight += double(projected[i]);
  }
  return weight > 0 ? std::optional(Rgb(sum / weight)) : std::nullopt;
}

} // namespace

Result<SkyImage> SkyImage::make(RgbImage radiance, SkyProjection projection, GroundFill ground,
                                const std::string& name) {
  const auto geometry = SkyGeometry::make(radiance.width, radiance.height, projection, name);
  if (!geometry)
    return geometry.error();
  return make(std::move(radiance), *geometry, ground, name);
}

/// Directions that the image does not cover: above the horizon its own cosine-weighted mean, below it the ground, a
/// diffuse surface under that mean.
Result<SkyImage> SkyImage::make(RgbImage radiance, std::shared_ptr<const SkyGeometry> geometry, GroundFill ground,
                                const std::string& name) {
  if (radiance.width != geometry->width() || radiance.height != geometry->height())
    return Error{ErrorCode::value_invalid, "the image has another size than the sky camera's frames", name, ""};
  const BadTexels bad = check_texels(radiance, geometry->solid_angle_sr());
  if (bad.not_finite + bad.negative > 0)
    return radiance_error(bad, radiance.width, name);
  SkyImage sky;
  sky.image_ = std::move(radiance);
  sky.geometry_ = std::move(geometry);
  if (sky.covers_sphere())
    return sky;
  if (ground.kind == GroundFill::Kind::none)
    return Error{ErrorCode::value_invalid, "the image does not cover the whole sphere of directions", name,
                 "say what fills the rest, for example ground = { albedo = 0.2 }"};
  if (!(ground.albedo >= 0 && ground.albedo <= 1))
    return Error{ErrorCode::value_invalid, "the ground albedo is outside 0..1", name, "0.2 is common"};
  const auto mean = measured_mean(sky.image_, sky.geometry_->projected_solid_angle_sr());
  if (!mean)
    return Error{ErrorCode::value_invalid, "the camera sees nothing above the horizon, so the ground cannot be filled",
                 name, "check world_from_camera in the lens file"};
  sky.sky_fill_ = *mean;
  // A diffuse ground under a sky of this mean: L = albedo E / pi with E = pi times the cosine-weighted mean.
  sky.ground_radiance_ = ground.albedo * *mean;
  return sky;
}

/// Of the texel that holds the direction, without interpolation: what the regions integrate.
Rgb SkyImage::radiance(const glm::dvec3& world_direction) const {
  const std::optional<std::size_t> texel = geometry_->texel(world_direction);
  if (!texel || geometry_->solid_angle_sr()[*texel] == 0)
    return fill_radiance(world_direction);
  return image_.texels[*texel];
}

Result<SkyProjection> parse_projection(const std::string& text, double rotation, const glm::dvec3& forward,
                                       const glm::dvec3& up) {
  if (text == "equirect")
    return SkyProjection(EquirectProjection{rotation});
  if (text == "angular")
    return SkyProjection(AngularProjection{forward, up, rotation});
  if (text.rfind("fisheye:", 0) == 0 && text.size() > 8) {
    auto lens = read_lens(text.substr(8));
    if (!lens)
      return lens.error();
    return SkyProjection(FisheyeProjection{*lens, rotation});
  }
  return Error{ErrorCode::usage, "unknown sky projection \"" + text.substr(0, 60) + "\"", "",
               "use equirect, angular or fisheye:LENS.yaml"};
}

Result<SkyImage> read_sky(const std::filesystem::path& path, const SkyProjection& projection, GroundFill ground) {
  auto file = read_hdr_image(path);
  if (!file)
    return file.error();
  return SkyImage::make(std::move(file->radiance), projection, ground, path.string());
}

} // namespace daylit
