#include "calibration/material_views.h"

#include <algorithm>

#include <fmt/format.h>
#include <glm/matrix.hpp>

#include "calibration/code_picture.h"
#include "capture/hdr/response_curve.h"
#include "capture/markers/marker_pose.h"
#include "scene/config/config.h"

namespace daylit::calibration {

namespace {

constexpr float kTopCode = 0.98f;
constexpr std::size_t kPlateau = 16; ///< pixels of one and the same largest value: the end of a range, no chance

/// The largest value that can be told from more light: of an HDR picture where many pixels share its largest one.
float top_of_range(const CodePicture& picture) {
  if (picture.bits <= 16)
    return kTopCode;
  float top = 0.0f;
  for (const Rgb& v : picture.code.texels)
    top = std::max({top, v.r, v.g, v.b});
  const auto at_top = [&](const Rgb& v) { return std::max({v.r, v.g, v.b}) == top; };
  const auto count = static_cast<std::size_t>(std::ranges::count_if(picture.code.texels, at_top));
  return count >= kPlateau ? top : INFINITY;
}

/// Photograph = scale x colour matrix x radiance, through the response.
void to_radiance(const InteriorConfig& interior, const ResponseCurve& response, CodePicture& picture,
                 MaterialView& view) {
  const float top = top_of_range(picture);
  const glm::dmat3 back = glm::inverse(interior.colour_matrix) / interior.scale;
  view.left_out.assign(picture.code.texels.size(), 0);
  for (std::size_t i = 0; i < picture.code.texels.size(); ++i) {
    Rgb& v = picture.code.texels[i];
    if (std::max({v.r, v.g, v.b}) >= top)
      view.left_out[i] = MaterialView::kOverRange;
    if (picture.bits <= 16)
      for (int c = 0; c < 3; ++c)
        v[c] = response.exposure(v[c], c);
    v = Rgb(back * glm::dvec3(v));
  }
  view.radiance = std::move(picture.code);
}

Result<void> apply_mask(const std::filesystem::path& path, MaterialView& view) {
  const auto mask = read_code_picture(path);
  if (!mask)
    return mask.error();
  if (mask->code.width != view.radiance.width || mask->code.height != view.radiance.height)
    return Error{ErrorCode::value_invalid,
                 fmt::format("the mask is {} x {} pixels, the picture {} x {}", mask->code.width, mask->code.height,
                             view.radiance.width, view.radiance.height),
                 path.string(), "draw it on the picture itself"};
  for (std::size_t i = 0; i < view.left_out.size(); ++i)
    if (mask->code.texels[i].g > 0.5f)
      view.left_out[i] = MaterialView::kMasked;
  return {};
}

/// As [pose] says, or from the board of [marker] in the picture.
Result<glm::dmat4> pose_of(const std::filesystem::path& path, const RunConfig& config, const MaterialView& view) {
  if (config.world_from_camera)
    return *config.world_from_camera;
  if (!config.marker)
    return Error{ErrorCode::value_invalid, "the pose of the camera is not known", path.string(),
                 "give [pose], or [marker] and a board in the picture"};
  const auto board = board_of(*config.marker);
  if (!board)
    return board.error();
  std::vector<float> light;
  for (const Rgb& texel : view.radiance.texels)
    light.push_back(luminance(texel));
  const auto white = light.begin() + static_cast<std::ptrdiff_t>(light.size() * 199 / 200);
  std::nth_element(light.begin(), white, light.end());
  RgbImage shown = view.radiance;
  for (Rgb& texel : shown.texels)
    texel = glm::clamp(texel / std::max(*white, 1e-20f), 0.0f, 1.0f);
  const auto pose = marker_pose(view_of(shown, true), view.lens, *board, config.marker->world_from_board,
                                config.interior.image.string());
  return pose ? Result<glm::dmat4>(pose->world_from_camera) : pose.error();
}

Result<MaterialView> read_view(const std::filesystem::path& path, const RunConfig& config) {
  if (config.interior.scale_from_marker)
    return Error{ErrorCode::value_invalid, "scale = \"marker\" needs the colours that are to be found", path.string(),
                 "give [interior] scale as a number"};
  const auto response = ResponseCurve::named(config.interior.response);
  if (!response)
    return response.error();
  auto picture = read_code_picture(config.interior.image);
  if (!picture)
    return picture.error();
  MaterialView view;
  view.name = path.filename().string();
  auto lens = read_lens(config.interior.lens);
  if (!lens)
    return lens.error();
  const int width = picture->code.width, height = picture->code.height;
  if (lens->width_px > 0 && (lens->width_px != width || lens->height_px != height))
    return Error{ErrorCode::value_invalid,
                 fmt::format("the picture is {} x {} pixels, the lens file for {} x {}", width, height, lens->width_px,
                             lens->height_px),
                 config.interior.image.string(), "do not crop or scale the picture"};
  view.lens = *lens;
  to_radiance(config.interior, *response, *picture, view);
  const auto pose = pose_of(path, config, view);
  if (!pose)
    return pose.error();
  view.world_from_camera = *pose;
  return view;
}

bool same_sky(const SkyConfig& a, const SkyConfig& b) {
  return a.image == b.image && a.projection == b.projection && a.lens == b.lens && a.rotation == b.rotation &&
         a.ground.kind == b.ground.kind && a.ground.albedo == b.ground.albedo;
}

/// Each sky once: pictures taken at one time share it.
Result<std::size_t> sky_index(const SkyConfig& sky, std::vector<SkyConfig>& known, MaterialScene& scene) {
  const auto found = std::ranges::find_if(known, [&](const SkyConfig& k) { return same_sky(k, sky); });
  if (found != known.end())
    return static_cast<std::size_t>(found - known.begin());
  auto image = read_sky(sky);
  if (!image)
    return image.error();
  known.push_back(sky);
  scene.skies.push_back(std::move(*image));
  return known.size() - 1;
}

} // namespace

Result<MaterialScene> read_material_scene(const std::vector<std::filesystem::path>& configs,
                                          const std::vector<std::filesystem::path>& masks) {
  if (!masks.empty() && masks.size() != configs.size())
    return Error{ErrorCode::usage, fmt::format("{} masks for {} pictures", masks.size(), configs.size()), "--mask",
                 "give one for each picture, in their order; - where there is none"};
  MaterialScene scene;
  std::vector<SkyConfig> skies;
  for (std::size_t i = 0; i < configs.size(); ++i) {
    const auto config = read_view_config(configs[i]);
    if (!config)
      return config.error();
    auto room = read_room(config->room_model);
    if (!room)
      return room.error();
    if (i > 0 && room->content_hash != scene.room.content_hash)
      return Error{ErrorCode::value_invalid, "is of another room than " + configs.front().string(), configs[i].string(),
                   "give all pictures the same [room] model"};
    scene.room = std::move(*room);
    auto view = read_view(configs[i], *config);
    if (!view)
      return view.error();
    const auto sky = sky_index(config->sky, skies, scene);
    if (!sky)
      return sky.error();
    view->sky = *sky;
    if (!masks.empty() && masks[i] != "-")
      if (const Result<void> good = apply_mask(masks[i], *view); !good)
        return good.error();
    scene.views.push_back(std::move(*view));
  }
  return scene;
}

} // namespace daylit::calibration
