#include "runtime/input/interior_input.h"
#include "runtime/input/camera_pose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "scene/sky/direct_sky.h"
#include "scene/sky/sky_partition.h"
#include "scene/volume/volume_file.h"

namespace daylit {

namespace {

/// The paper lies on a surface of the model, give or take the tape measure: light is looked up a little above it.
constexpr double kOffPaper_m = 0.02;

} // namespace

Result<LensModel> interior_lens(const InteriorConfig& interior, int width, int height) {
  auto lens = read_lens(interior.lens);
  if (!lens)
    return lens.error();
  const double sx = lens->width_px > 0 ? static_cast<double>(width) / lens->width_px : 1.0;
  const double sy = lens->height_px > 0 ? static_cast<double>(height) / lens->height_px : 1.0;
  if (std::abs(sx / sy - 1) > 0.01)
    return Error{ErrorCode::value_invalid,
                 "the picture is " + std::to_string(width) + " x " + std::to_string(height) +
                     " but the lens file is for " + std::to_string(lens->width_px) + " x " +
                     std::to_string(lens->height_px),
                 interior.lens.string(), "use the lens file of this camera mode; do not crop the picture"};
  lens->fx *= sx;
  lens->fy *= sy;
  lens->cx = (lens->cx + 0.5) * sx - 0.5;
  lens->cy = (lens->cy + 0.5) * sy - 0.5;
  lens->width_px = width;
  lens->height_px = height;
  return lens;
}

namespace {

std::string pose_note(const MarkerPose& pose) {
  char text[200];
  std::snprintf(text, sizeof(text), "marker %d found, corners off by %.2f px rms", pose.ids_used.front(),
                pose.reprojection_rms_px);
  std::string note = text;
  if (!pose.tilt_uncertain())
    return note;
  std::snprintf(text, sizeof(text),
                ": the tilt of the board is uncertain, another one fits with %.2f px; look at it more from the side",
                pose.second_rms_px);
  return note + text;
}

Result<Rgb> white_of(const Photograph& photo, const std::vector<SeenMarker>& seen, int id) {
  for (const SeenMarker& marker : seen)
    if (marker.id == id)
      return marker_white(photo, marker.corner_px);
  return Error{ErrorCode::not_found, "marker " + std::to_string(id) + " is not in the picture", "",
               "check [marker] ids"};
}

Result<void> use_marker(const RunConfig& config, const MarkerConfig& marker, InteriorInput& input) {
  const auto board = board_of(marker);
  if (!board)
    return board.error();
  const auto picture = picture_of_markers(input.photo, marker.dictionary);
  if (!picture)
    return picture.error();
  auto pose = marker_pose(*picture, input.lens, *board, marker.world_from_board, config.interior.image.string(),
                          marker_search_exponent(input.photo, config.interior.response));
  if (!pose)
    return pose.error();
  if (config.interior.scale_from_marker) {
    auto white = white_of(input.photo, pose->seen, marker.ids.front());
    if (!white)
      return white.error();
    input.marker_white = *white;
  }
  if (!config.world_from_camera) {
    input.world_from_camera = pose->world_from_camera;
    input.notes.push_back(pose_note(*pose));
  }
  input.pose = std::move(*pose);
  return {};
}

/// Of [interior] depth, where it is given.
Result<void> read_depth(const InteriorConfig& interior, InteriorInput& input) {
  if (interior.depth.empty())
    return {};
  auto depth = read_depth_picture(interior.depth, interior.depth_unit_m);
  if (!depth)
    return depth.error();
  const PhotoPixels photo = input.photo.pixels();
  if (const auto fits = check_depth_size(*depth, photo.width(), photo.height(), interior.depth.string()); !fits)
    return fits;
  if (std::ranges::all_of(depth->z_m, [](float z) { return z == 0.0f; }))
    input.notes.push_back(interior.depth.string() +
                          ": no depth above 0 in it, the room's model decides everywhere; was it written in another "
                          "unit or with another sign?");
  input.depth = std::move(*depth);
  return {};
}

} // namespace

Result<InteriorInput> read_interior(const RunConfig& config) {
  auto photo = read_photograph(config.interior.image, config.interior.response);
  if (!photo)
    return photo.error();
  auto lens = interior_lens(config.interior, photo->pixels().width(), photo->pixels().height());
  if (!lens)
    return lens.error();
  InteriorInput input{std::move(*photo), *lens, glm::dmat4(1.0), {}, {}, {}, {}};
  if (const auto read = read_depth(config.interior, input); !read)
    return read.error();
  const std::size_t saturated = input.photo.saturated_pixels(), pixels = input.photo.pixels().size();
  if (saturated * 100 > pixels)
    input.notes.push_back(std::to_string(saturated * 100 / pixels) +
                          " % of the picture is saturated: shadows there start from an unknown brightness");
  if (config.world_from_camera)
    input.world_from_camera = *config.world_from_camera;
  if (!config.world_from_camera && !config.marker)
    return Error{ErrorCode::not_found, "the camera's pose is unknown", "[pose]", "give [pose] or [marker]"};
  if (!config.world_from_camera || config.interior.scale_from_marker)
    if (const auto used = use_marker(config, *config.marker, input); !used)
      return used.error();
  return input;
}

Result<PhotoScale> scale_from_marker(const Rgb& marker_white, const Rgb& irradiance, double white_reflectance,
                                     const glm::dmat3& colour_matrix) {
  const glm::dvec3 photo(marker_white);
  const glm::dvec3 simulated = colour_matrix * (white_reflectance / std::numbers::pi * glm::dvec3(irradiance));
  for (int c = 0; c < 3; ++c)
    if (!(simulated[c] > 0 && std::isfinite(simulated[c]) && photo[c] > 0 && std::isfinite(photo[c])))
      return Error{ErrorCode::value_invalid,
                   "the marker's white cannot be compared: photograph (" + std::to_string(photo.r) + ", " +
                       std::to_string(photo.g) + ", " + std::to_string(photo.b) + "), simulated (" +
                       std::to_string(simulated.r) + ", " + std::to_string(simulated.g) + ", " +
                       std::to_string(simulated.b) + ")",
                   "[interior] scale = \"marker\"",
                   "check that world_from_board puts the marker inside the room, or give scale as a number"};
  PhotoScale out{double(luminance(Rgb(photo))) / double(luminance(Rgb(simulated))), colour_matrix};
  if (colour_matrix == glm::dmat3(1.0))
    for (int c = 0; c < 3; ++c)
      out.colour_matrix[c][c] = photo[c] / simulated[c] / out.scale;
  return out;
}

Result<PhotoScale> scale_from_marker(const RunConfig& config, const InteriorInput& input, const SkyImage& sky) {
  const auto volume = read_volume(config.volume);
  if (!volume)
    return volume.error();
  const auto sampler = LightFieldSampler::make(*volume);
  if (!sampler)
    return sampler.error();
  const auto rays = RayScene::build(volume->room);
  if (!rays)
    return rays.error();
  const glm::dvec3 normal(config.marker->world_from_board[2]);
  const glm::dvec3 point = glm::dvec3(config.marker->world_from_board[3]) + kOffPaper_m * normal;
  const LightField field = combine(*volume, region_radiance(sky, volume->partition));
  const std::optional<Sh9Rgb> around = sampler->sample(field, point);
  if (!around)
    return Error{ErrorCode::geometry_invalid, "the marker lies outside the room or inside furniture",
                 "[marker] world_from_board",
                 "measure the position of the marker's centre in the room's frame, in metres"};
  const Sky outside(sky);
  const DirectSky direct(volume->room, volume->apertures, *rays, outside);
  const Rgb irradiance_here = irradiance(*around, glm::vec3(normal)) + direct.irradiance(point, normal);
  return scale_from_marker(*input.marker_white, irradiance_here, config.marker->white_reflectance,
                           config.interior.colour_matrix);
}

} // namespace daylit
