#include "bench/frame_scene.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "precompute/bake.h"
#include "scene/core/atomic_file.h"
#include "scene/image/image_formats.h"
#include "scene/model/object_mesh.h"
#include "scene/room/room_formats.h"
#include "scene/volume/volume_file.h"
#include "simulate/picture.h"
#include "simulate/sample_scene.h"
#include "simulate/teapot.h"
#include "simulate/trace_scene.h"

namespace daylit::bench {

namespace {

constexpr double kSensorNoise = 0.01;
constexpr double kTeapotWidth = 0.29; // metres: the object then covers 8 to 12 % of the picture
constexpr double kBlobWidth = 0.235;

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

Result<void> write_object(const std::filesystem::path& path, const ObjectMesh& mesh) {
  const std::filesystem::path mtl = path.stem().string() + ".mtl";
  if (const auto r = write_file_atomically(path, object_obj(mesh, mtl.string())); !r)
    return r;
  return write_file_atomically(path.parent_path() / mtl, object_mtl(mesh.reflectance[0]));
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

namespace {

/// A ball whose radius in direction (u, v) is half of 0.84 of the width times `bumps`.
template <class Bumps>
ObjectMesh bumpy_ball(int around, int across, double width_m, Rgb reflectance, const Bumps& bumps) {
  const float pi = std::numbers::pi_v<float>, half = static_cast<float>(0.42 * width_m);
  const auto point = [&](float u, float v) {
    return half * bumps(u, v) * glm::vec3(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v));
  };
  ObjectMesh mesh;
  for (int i = 0; i <= around; ++i)
    for (int j = 0; j <= across; ++j) {
      const float u = 2.0f * pi * static_cast<float>(i) / static_cast<float>(around),
                  v = pi * (static_cast<float>(j) / static_cast<float>(across) - 0.5f);
      constexpr float h = 1e-3f;
      const glm::vec3 n = glm::cross(point(u + h, v) - point(u - h, v), point(u, v + h) - point(u, v - h));
      const bool pole = j == 0 || j == across;
      mesh.positions.push_back(point(u, v) + glm::vec3(0.0f, 0.0f, half));
      mesh.normals.push_back(pole ? glm::vec3(0.0f, 0.0f, j == 0 ? -1.0f : 1.0f) : glm::normalize(n));
      mesh.reflectance.push_back(reflectance);
    }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (across + 1) + j); };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

/// Bumps: 120 x 64 quads, 15,360 triangles.
ObjectMesh blob_mesh(double width_m, Rgb reflectance) {
  return bumpy_ball(120, 64, width_m, reflectance, [](float u, float v) {
    return 1.0f + 0.12f * std::sin(5.0f * u) * std::cos(v) * std::cos(v) * std::cos(4.0f * v);
  });
}

/// 40 folds around: 320 x 160 quads, 102,400 triangles.
ObjectMesh folded_mesh(double width_m, Rgb reflectance) {
  return bumpy_ball(320, 160, width_m, reflectance, [](float u, float v) {
    return 1.0f + 0.1f * std::sin(40.0f * u + 3.0f * std::sin(4.0f * v)) * std::cos(v) * std::cos(v);
  });
}

Result<ObjectMesh> object_named(const std::string& name) {
  const Rgb white(0.7f, 0.68f, 0.62f);
  if (name == "teapot")
    return tessellate_teapot(8, kTeapotWidth, white);
  if (name == "blob")
    return blob_mesh(kBlobWidth, white);
  if (name == "folds")
    return folded_mesh(kBlobWidth, white);
  return Error{ErrorCode::usage, "there is no object \"" + name + "\"", "--objects", "teapot, blob or folds"};
}

} // namespace

Result<FrameScene> make_frame_scene(const std::filesystem::path& folder, const std::string& what,
                                    const std::string& sky, int skies, int photos, const Progress& progress) {
  const std::string object = what.substr(0, what.find(':'));
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
  scene.config.objects[0].model = folder / (object + ".obj");
  if (object != what)
    scene.config.objects[0].material = what.substr(object.size() + 1);
  if (const auto baked = bake_room(folder / "room.obj", scene.config.volume, progress); !baked)
    return baked.error();
  const auto mesh = object_named(object);
  if (!mesh)
    return mesh.error();
  if (const auto r = write_object(scene.config.objects[0].model, *mesh); !r)
    return r.error();
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
