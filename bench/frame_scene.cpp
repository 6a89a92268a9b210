#include "bench/frame_scene.h"

#include <cmath>

#include <glm/geometric.hpp>

#include "bench/frame_objects.h"
#include "precompute/bake.h"
#include "scene/image/image_formats.h"
#include "scene/room/room_formats.h"
#include "scene/volume/volume_file.h"
#include "simulate/picture.h"
#include "simulate/sample_scene.h"
#include "simulate/trace_scene.h"

namespace daylit::bench {

namespace {

constexpr double kSensorNoise = 0.01;

/// Grey room, printed board: enough of a photograph for finding the marker and for multiplying shadows onto it.
RgbImage plain_photo(const RunConfig& config, const LensModel& lens) {
  const MarkerBoard board = MarkerBoard::printed(*config.marker);
  const glm::dmat4& pose = *config.world_from_camera;
  const glm::dvec3 eye(pose[3]), normal(board.world_from_board[2]), centre(board.world_from_board[3]);
  RgbImage photo(kFrameWidth, kFrameHeight, Rgb(0.2f));
  for (int y = 0; y < kFrameHeight; ++y)
    for (int x = 0; x < kFrameWidth; ++x)
      for (int s = 0; s < 16; ++s) { // box filter: detection needs soft edges
        const auto d = lens.unproject({x + (s % 4 - 1.5) / 4, y + (s / 4 - 1.5) / 4});
        Rgb value(0.2f);
        if (d) {
          const glm::dvec3 w = glm::dmat3(pose) * *d;
          const double t = glm::dot(centre - eye, normal) / glm::dot(w, normal);
          const glm::dvec3 p = eye + t * w, q = glm::transpose(glm::dmat3(board.world_from_board)) * (p - centre);
          if (t > 0.0 && std::max(std::fabs(q.x), std::fabs(q.y)) < board.half_side_m())
            value = 0.4f * board.reflectance(p);
        }
        photo.at(x, y) += value / 16.0f - (s == 0 ? Rgb(0.2f) : Rgb(0.0f));
      }
  return photo;
}

Result<void> bake_room(const std::filesystem::path& room, const std::filesystem::path& volume,
                       const Progress& progress) {
  if (std::filesystem::exists(volume))
    return {};
  const auto file = read_room(room);
  if (!file)
    return file.error();
  precompute::BakeOptions options;
  precompute::BakeReport report;
  const auto baked = precompute::bake(*file, *SkyPartition::uniform(256), options, progress, report);
  if (!baked)
    return baked.error();
  return write_volume(volume, *baked);
}

} // namespace

Result<FrameScene> make_frame_scene(const std::filesystem::path& folder, const std::string& what,
                                    const std::string& sky, int skies, int photos, const Progress& progress) {
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  if (const auto written = write_sample_scene(sky, folder, kFrameWidth, kFrameHeight, true); !written)
    return written.error();
  const auto sample = sample_scene(sky, kFrameWidth, kFrameHeight);
  if (!sample)
    return sample.error();
  FrameScene scene;
  scene.config = sample->run;
  scene.sky_model = sample->sky_model;
  scene.config.volume = folder / "room.volume";
  scene.config.room_model = folder / "room.obj";
  if (const auto baked = bake_room(folder / "room.obj", scene.config.volume, progress); !baked)
    return baked.error();
  auto objects = write_frame_objects(folder, what, scene.config);
  if (!objects)
    return objects.error();
  scene.config.objects = std::move(*objects);
  scene.interior_lens = ideal_pinhole(kFrameWidth, kFrameHeight, sample->interior_fov);
  scene.config.interior.lens = folder / "interior.yaml";
  if (const auto r = write_lens(scene.config.interior.lens, scene.interior_lens); !r)
    return r.error();
  const LensModel fisheye = ideal_fisheye(sample->fisheye_width_px, sample->fisheye_height_px, sample->fisheye_fov);
  const auto clean_sky = render_sky_frame(AnalyticSky(sample->sky_model), fisheye);
  if (!clean_sky)
    return clean_sky.error();
  const auto geometry = SkyGeometry::make(clean_sky->width, clean_sky->height, FisheyeProjection{fisheye, 0.0});
  if (!geometry)
    return geometry.error();
  const RgbImage clean_photo = plain_photo(scene.config, scene.interior_lens);
  for (int k = 0; k < skies; ++k) {
    RgbImage image = *clean_sky;
    add_sensor_noise(image, kSensorNoise, static_cast<std::uint32_t>(2 * k + 1));
    auto made = SkyImage::make(std::move(image), *geometry, {GroundFill::Kind::albedo, 0.2f});
    if (!made)
      return made.error();
    scene.skies.push_back(std::move(*made));
  }
  for (int k = 0; k < photos; ++k) {
    RgbImage photo = clean_photo;
    add_sensor_noise(photo, kSensorNoise, static_cast<std::uint32_t>(2 * k + 2));
    scene.photo_bytes.push_back(to_srgb8(photo, 2.5f));
    scene.photos.push_back(std::move(photo));
  }
  return scene;
}

} // namespace daylit::bench
