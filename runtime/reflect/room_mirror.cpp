#include "runtime/reflect/room_mirror.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"
#include "scene/room/declared_gloss.h"

namespace daylit {

namespace {
constexpr double kSamePlane_m = 1e-4, kSameNormal = 1e-6;
}

Result<RoomMirror> RoomMirror::make(const Room& room, const std::map<std::string, double>& glossy) {
  auto declared = declared_gloss(room, glossy);
  if (!declared)
    return declared.error();
  RoomMirror mirror;
  mirror.reflectance_ = std::move(*declared);
  for (std::size_t t = 0; t < room.triangles.size(); ++t) {
    const glm::dvec3 n = area_normal(room, room.triangles[t]);
    if (mirror.reflectance_[t] == 0.0f || glm::length(n) == 0.0)
      continue;
    const Plane plane{glm::normalize(n), glm::dot(glm::normalize(n), room.vertices[room.triangles[t].vertex[0]])};
    if (std::ranges::none_of(mirror.planes_, [&](const Plane& p) {
          const double side = glm::dot(p.normal, plane.normal);
          return std::fabs(side) > 1.0 - kSameNormal &&
                 std::fabs(p.height - std::copysign(plane.height, side * plane.height)) < kSamePlane_m;
        }))
      mirror.planes_.push_back(plane);
  }
  return mirror;
}

/// Of the mirrored sphere: centre c - 2 (n.c - h) n.
PixelBox RoomMirror::box_of(const Plane& plane, const BoundingSphere& object, const DrawnPicture& drawn) const {
  const PixelBox all{0, 0, drawn.camera.photo_width_px, drawn.camera.photo_height_px};
  const glm::dvec3 centre = object.centre - 2.0 * (glm::dot(plane.normal, object.centre) - plane.height) * plane.normal;
  const glm::dvec3 to = glm::transpose(glm::dmat3(drawn.camera.world_from_camera)) * (centre - drawn.camera.eye());
  if (to.z <= 1.5 * object.radius || !drawn.camera.drawn_position.empty())
    return all; // behind the camera or around it; in a distorted picture every pixel is asked
  const double reach = object.radius / (to.z - object.radius) * std::max(drawn.camera.fx, drawn.camera.fy);
  const double tangent = std::hypot(to.x, to.y) / to.z, wide = reach * (1.0 + tangent);
  const double x = drawn.camera.fx * to.x / to.z + drawn.camera.cx, y = drawn.camera.fy * to.y / to.z + drawn.camera.cy;
  const auto pixel = [](double v) { return static_cast<int>(std::clamp(std::floor(v), -1e6, 1e6)); };
  return PixelBox{pixel(x - wide), pixel(y - wide), pixel(x + wide) + 2, pixel(y + wide) + 2}.clipped(all.x1, all.y1);
}

/// A ray of the camera that the room mirrors.
struct RoomMirror::Mirrored {
  std::size_t pixel = 0;
  RoomRay behind;      ///< on from the mirror, past the objects
  float share = 0.0f;  ///< that is mirrored
  bool object = false; ///< it meets one
};

std::size_t RoomMirror::mirrored(std::span<const WorldRay> camera, const RoomSeen& room,
                                 std::span<Mirrored> found) const {
  std::array<RoomRay, kRayBatch> seen, behind;
  std::array<WorldRay, kRayBatch> rays;
  std::array<double, kRayBatch> most;
  std::array<std::optional<ObjectPoint>, kRayBatch> points;
  for (std::size_t k = 0; k < camera.size(); ++k)
    seen[k].ray = camera[k];
  room.find_ends({seen.data(), camera.size()});
  std::size_t count = 0;
  for (std::size_t k = 0; k < camera.size(); ++k) {
    const auto on = seen[k].end ? room.mirrored(camera[k], *seen[k].end) : std::nullopt;
    if (!on)
      continue;
    rays[count] = behind[count].ray = on->ray;
    found[count++] = {k, {}, on->share, false};
  }
  room.find_ends({behind.data(), count});
  for (std::size_t k = 0; k < count; ++k)
    most[k] = behind[k].end ? behind[k].end->distance : 1e9;
  room.objects.closest({rays.data(), count}, most, points);
  for (std::size_t k = 0; k < count; ++k)
    found[k] = {found[k].pixel, behind[k], found[k].share, points[k].has_value()};
  return count;
}

/// F L, L of the object that the ray meets, or of the room.
void RoomMirror::images(std::span<const WorldRay> camera, const GlossyRays& rays, const RoomSeen& room,
                        std::span<Image> images) const {
  std::ranges::fill(images, Image{});
  std::array<Mirrored, kRayBatch> found;
  const std::size_t count = mirrored(camera, room, found);
  std::array<WorldRay, kRayBatch> mirrored;
  std::array<RoomRay, kRayBatch> behind;
  std::array<Rgb, kRayBatch> objects;
  std::size_t meet = 0;
  for (std::size_t k = 0; k < count; ++k) {
    behind[k] = found[k].behind;
    if (found[k].object)
      mirrored[meet++] = behind[k].ray;
  }
  rays.radiance({mirrored.data(), meet}, objects);
  room.find_radiance({behind.data(), count});
  meet = 0;
  for (std::size_t k = 0; k < count; ++k)
    images[found[k].pixel] = {found[k].share * (found[k].object ? objects[meet++] : behind[k].radiance),
                              found[k].share * behind[k].radiance};
}

std::size_t RoomMirror::draw(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room,
                             const PhotoPixels& photo, const PhotoScale& scale, Composite& composite) const {
  PixelBox box;
  const VirtualObjects& objects = room.objects.objects();
  for (const Plane& plane : planes_)
    for (std::size_t k = 0; k < objects.parts.size(); ++k)
      box.include(box_of(plane, objects.bounds(k), drawn));
  if (planes_.empty())
    return 0;
  // The rays see the composite as it is until all are traced.
  std::vector<Rgb> more(photo.size(), Rgb(0.0f));
  constexpr int kWidth = static_cast<int>(kRayBatch);
  parallel_for(0, composite.picture.height, [&](int y) {
    for (int x = 0; x < composite.picture.width; x += kWidth) {
      const PixelBox row{x, y, std::min(x + kWidth, composite.picture.width), y + 1};
      const auto* touched = composite.touched.data() + photo.index(x, y);
      if (!row.common(box).empty() || std::any_of(touched, touched + row.width(), [](auto t) { return t != 0; }))
        find_row(row, drawn, rays, room, photo, scale, composite, more.data() + photo.index(x, y));
    }
  });
  std::size_t changed = 0;
  for (std::size_t i = 0; i < more.size(); ++i)
    if (more[i] != Rgb(0.0f)) {
      composite.picture.texels[i] = glm::max(composite.picture.texels[i] + more[i], Rgb(0.0f));
      changed += composite.touched[i] == 0;
      composite.touched[i] = std::max<std::uint8_t>(composite.touched[i], 1);
    }
  return changed;
}

/// P' = P + F L_now - V F L_before, P = V photo the shadowed pixel; at most kRayBatch pixels of a row. V of pixels that
/// an object covers in part is that of the last one without, or of the first.
void RoomMirror::find_row(const PixelBox& row, const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room,
                          const PhotoPixels& photo, const PhotoScale& scale, const Composite& composite,
                          Rgb* more) const {
  std::array<WorldRay, kRayBatch> camera;
  std::array<Image, kRayBatch> found;
  const auto count = static_cast<std::size_t>(row.width());
  for (std::size_t k = 0; k < count; ++k)
    camera[k] = {drawn.camera.eye(),
                 glm::vec3(drawn.camera.direction(glm::dvec2(drawn.position(row.x0 + static_cast<int>(k), row.y0))))};
  images({camera.data(), count}, rays, room, {found.data(), count});
  Rgb left(1.0f);
  for (std::size_t i = photo.index(row.x0, row.y0), end = i + count; i < end; ++i)
    if (composite.coverage[i] == 0.0f) {
      left = left_of(composite.picture.texels[i], photo[i]);
      break;
    }
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = photo.index(row.x0, row.y0) + k;
    if (composite.coverage[i] == 0.0f)
      left = left_of(composite.picture.texels[i], photo[i]);
    more[k] = std::max(1.0f - composite.coverage[i], 0.0f) *
              (scale.apply(found[k].now) - left * scale.apply(found[k].before));
  }
}

} // namespace daylit
