#include "scene/sky/sky_image.h"

#include <cmath>

#include "scene/core/text_lines.h"
#include "scene/image/image_formats.h"
#include "scene/sky/sky_lens.h"

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

namespace {

/// A panorama is as wide as 360 degrees are to 180.
std::optional<Error> check_panorama(const RgbImage& image, const std::string& name) {
  const std::string size = std::to_string(image.width) + " x " + std::to_string(image.height);
  if (image.width == 2 * image.height)
    return std::nullopt;
  if (image.texels.size() == 1)
    return Error{ErrorCode::value_invalid, "the picture is a single pixel (1 x 1), not a panorama", name,
                 "write a uniform sky in words: a .toml file with [sky] model = \"uniform\""};
  return Error{
      ErrorCode::value_invalid, "a panorama (equirect) is 2:1, this image is " + size, name,
      image.width == image.height
          ? "a square one is an angular map (projection angular) or a fish-eye (projection fisheye with its "
            "lens file)"
          : "export the whole sphere, 360 x 180 degrees; a fish-eye needs projection fisheye and its lens file"};
}

/// What rpict writes about its picture (Radiance, man rpict, option -vt): type, width and height in degrees, forward
/// and up.
struct RadianceView {
  char type = 'v';
  double across_deg = 45.0, high_deg = 45.0;
  std::string forward = "0,1,0", up = "0,0,1";
  bool is_angular_map() const { return type == 'a' && across_deg == 360.0 && high_deg == 360.0; }
};

RadianceView parse_view(std::string_view text) {
  RadianceView view;
  const auto vector = [&] {
    std::string numbers(take_word(text));
    for (int k = 0; k < 2; ++k)
      numbers += "," + std::string(take_word(text));
    return numbers;
  };
  while (!text.empty()) {
    const std::string_view word = take_word(text);
    if (word.starts_with("-vt") && word.size() == 4)
      view.type = word[3];
    else if (word == "-vh")
      view.across_deg = parse_number(take_word(text)).value_or(view.across_deg);
    else if (word == "-vv")
      view.high_deg = parse_number(take_word(text)).value_or(view.high_deg);
    else if (word == "-vd")
      view.forward = vector();
    else if (word == "-vu")
      view.up = vector();
  }
  return view;
}

/// A picture rendered by Radiance is never equirectangular; a lens file may describe any of them.
std::optional<Error> check_view(const HdrFile& file, const SkyProjection& projection, const std::string& name) {
  const auto text = file.attributes.find("VIEW");
  if (text == file.attributes.end() || std::holds_alternative<FisheyeProjection>(projection))
    return std::nullopt;
  const RadianceView view = parse_view(text->second);
  if (view.is_angular_map() && std::holds_alternative<AngularProjection>(projection))
    return std::nullopt;
  const std::string hint =
      view.is_angular_map() ? "it is an angular map: projection angular (--projection angular --forward " +
                                  view.forward + " --sky-up " + view.up + ")"
      : view.type == 'a' ? "it is a fish-eye: projection fisheye with an equidistant lens file (--projection "
                           "fisheye:LENS.yaml)"
                         : "render it again as an angular map, rpict -vta -vh 360 -vv 360, and read it with projection "
                           "angular (--projection angular)";
  return Error{ErrorCode::value_invalid, "the header says VIEW=" + text->second + ", which is not the projection given",
               name, hint};
}

} // namespace

Result<SkyImage> read_sky(const std::filesystem::path& path, const SkyProjection& projection, GroundFill ground,
                          std::vector<std::string>* notes, const FallOff& fall_off) {
  auto file = read_hdr_image(path);
  if (!file)
    return file.error();
  const bool panorama = std::holds_alternative<EquirectProjection>(projection);
  if (auto error = check_view(*file, projection, path.string()))
    return *error;
  if (auto error = panorama ? check_panorama(file->radiance, path.string()) : std::nullopt)
    return *error;
  if (ground.kind != GroundFill::Kind::none && !std::holds_alternative<FisheyeProjection>(projection))
    return Error{ErrorCode::value_invalid, "a ground is given, but the picture shows the whole sphere", path.string(),
                 "leave out ground (--ground-albedo): it fills what a fish-eye does not see"};
  if (notes)
    notes->insert(notes->end(), file->notes.begin(), file->notes.end());
  const auto* fisheye = std::get_if<FisheyeProjection>(&projection);
  if (const auto note = fisheye ? sky_lens_note(fisheye->lens) : std::nullopt; note && notes)
    notes->push_back(*note);
  if (fisheye && !fall_off.coefficient.empty()) {
    const auto sensitivity = pixel_sensitivity(fisheye->lens, fall_off, file->radiance.width, file->radiance.height);
    if (!sensitivity)
      return sensitivity.error();
    divide(file->radiance, *sensitivity);
  }
  return SkyImage::make(std::move(file->radiance), projection, ground, path.string());
}

} // namespace daylit
