// A photograph's pixel at an edge of the room is a mixture of two surfaces, and so is the shadow in it.

#include <gtest/gtest.h>

#include <algorithm>

#include "direct_reference.h"
#include "runtime/composite/compose.h"
#include "torus_scene.h"

namespace daylit {
namespace {

using test::kHeight;
using test::kWidth;

constexpr float kIndirect = 0.5f;              // irradiance, everywhere in the room
constexpr float kSun = 50.0f;                  // normal irradiance
constexpr double kTop_m = 0.3, kFront_m = 3.0; // of the bench
constexpr int kSide = 12;                      // samples on a side of a pixel
constexpr float kStepOfPart = 1.0f / 16;       // the renderer looks at sixteen places of a pixel

/// A ball above the front edge of a bench: the sun comes from behind, on its top and not on its front. The camera
/// looks at both, askew.
struct BallOverBench : test::TorusScene {
  RayScene rays;

  BallOverBench() {
    test::add_block(room, {0.8, kFront_m, 0.0}, {3.2, 3.8, kTop_m}, 0);
    rays = *RayScene::build(room);
    object = test::place(test::torus(0.0f, 0.15f), {2.0, 3.37, 0.6});
    sun = test::sun_through_the_window();
    sun->normal_irradiance = Rgb(kSun);
    camera = test::look_at({1.2, 1.6, 1.2}, {2.0, 3.0, 0.3}, kWidth, kHeight, 0.6);
  }

  struct Seen {
    std::uint32_t triangle = kUnknownTriangle;
    glm::dvec3 x{0.0}, n{0.0};
  };
  Seen see(const glm::dvec3& direction) const {
    RayHit hit;
    const glm::dvec3 eye = camera.eye();
    if (!rays.closest(rays.to_local(eye), glm::vec3(direction), 0, 100, hit))
      return {};
    const glm::dvec3 n = glm::normalize(area_normal(room, room.triangles[hit.triangle]));
    return {hit.triangle, eye + direction * static_cast<double>(hit.distance), glm::dot(n, direction) > 0 ? -n : n};
  }
  /// For the composite, as RoomLight has it.
  std::optional<RoomPoint> light(const glm::dvec3& direction) const {
    const Seen seen = see(direction);
    return RoomPoint{Rgb(kIndirect), open_sky_irradiance(pyramid, cells, seen.x, seen.n), Rgb(kSun), Rgb(0.5f)};
  }

  bool is_top(const Seen& seen) const { return std::abs(seen.x.z - kTop_m) < 1e-4; }
  bool is_front(const Seen& seen) const { return std::abs(seen.x.y - kFront_m) < 1e-4; }

  /// Mean irradiance of what a pixel shows.
  struct Pixel {
    Rgb without{0.0f}, with{0.0f};
    bool top = false, front = false; ///< of the bench
  };
  Pixel pixel(const test::DirectReference& reference, int x, int y) const {
    Pixel mean;
    for (int k = 0; k < kSide * kSide; ++k) {
      const glm::dvec2 place = (glm::dvec2(k % kSide, k / kSide) + 0.5) / static_cast<double>(kSide) - 0.5;
      const Seen seen = see(camera.direction(glm::dvec2(x, y) + place));
      if (seen.triangle == kUnknownTriangle)
        return {};
      const test::DirectIrradiance e = reference.estimate(lights, pyramid, cells, seen.x, seen.n);
      mean.without += (e.without + kIndirect) / static_cast<float>(kSide * kSide);
      mean.with += (e.with + kIndirect) / static_cast<float>(kSide * kSide);
      mean.top = mean.top || is_top(seen);
      mean.front = mean.front || is_front(seen);
    }
    return mean;
  }
};

/// Pixels at the front edge of the bench that show no object, what a camera sees there and what it would see with the
/// ball.
struct Edge {
  std::vector<glm::ivec2> pixels;
  RgbImage photo{kWidth, kHeight, Rgb(1.0f)}, truth = photo;
};

Edge front_edge(const BallOverBench& scene, const RenderedFrame& frame) {
  const test::DirectReference reference(scene.room, scene.windows, scene.object);
  Edge edge;
  for (int y = 1; y + 1 < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto above = scene.see(scene.camera.direction({x, y - 1})),
                 below = scene.see(scene.camera.direction({x, y + 1}));
      if (!scene.is_top(above) || !scene.is_front(below) || test::at(frame, x, y).object.w > 0.0f)
        continue;
      const auto pixel = scene.pixel(reference, x, y);
      if (!pixel.top || !pixel.front)
        continue;
      edge.pixels.emplace_back(x, y);
      edge.photo.at(x, y) = pixel.without;
      edge.truth.at(x, y) = pixel.with;
    }
  return edge;
}

TEST(RoomEdge, a_pixel_of_two_surfaces_loses_the_light_that_their_parts_in_it_lose) {
  BallOverBench scene;
  const auto frame = scene.trace();
  ASSERT_TRUE(frame) << frame.error().message();
  const Edge edge = front_edge(scene, *frame);
  const Composite result =
      compose(edge.photo, *frame, scene.camera, [&](const glm::dvec3& w, std::uint32_t) { return scene.light(w); }, {});
  int shadowed = 0;
  float brightest = 0.0f, worst = 0.0f; // of the photograph; error
  for (const glm::ivec2& p : edge.pixels) {
    const float before = edge.photo.at(p.x, p.y).g, after = edge.truth.at(p.x, p.y).g;
    brightest = std::max(brightest, before);
    if (after > 2.0f * kIndirect)
      continue; // sun arrives in some of it
    ++shadowed;
    worst = std::max(worst, std::fabs(result.picture.at(p.x, p.y).g - after));
  }
  EXPECT_GT(shadowed, 20);
  EXPECT_LT(worst, 0.5f * kStepOfPart * brightest);
}

} // namespace
} // namespace daylit
