// What of the room a camera sees past its openings.

#include <gtest/gtest.h>

#include "runtime/gl/renderer.h"
#include "runtime/trace/traced_renderer.h"
#include "torus_scene.h"

namespace daylit {
namespace {

using test::kHeight;
using test::kWidth;

/// The torus' room with a ledge outside the window, in the plane of the sill.
struct RoomWithLedge : test::TorusScene {
  std::uint32_t ledge = static_cast<std::uint32_t>(room.triangles.size()); ///< first triangle
  RoomWithLedge() { test::add_quad(room, {1.2, 5, 0.9}, {2.8, 5, 0.9}, {2.8, 5.5, 0.9}, {1.2, 5.5, 0.9}, 0); }

  struct Seen {
    int ledge = 0, room = 0, nothing = 0; ///< pixels
  };
  Seen seen(PictureRenderer& renderer) {
    Seen count;
    const auto frame = render(renderer);
    EXPECT_TRUE(frame) << frame.error().message();
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        RoomSurface point;
        EXPECT_TRUE(renderer.room_point(x, y, point));
        ++(point.triangle == kUnknownTriangle ? count.nothing : point.triangle >= ledge ? count.ledge : count.room);
      }
    return count;
  }
};

std::vector<std::unique_ptr<PictureRenderer>> both_renderers(const RoomWithLedge& scene) {
  std::vector<std::unique_ptr<PictureRenderer>> renderers;
  auto rays = TracedRenderer::make(scene.room, scene.windows);
  auto context = create_gl_context();
  EXPECT_TRUE(rays && context);
  auto gl = Renderer::make(std::move(*context), scene.room, scene.windows);
  EXPECT_TRUE(gl) << gl.error().message();
  renderers.push_back(std::make_unique<TracedRenderer>(std::move(*rays)));
  renderers.push_back(std::make_unique<Renderer>(std::move(*gl)));
  return renderers;
}

TEST(SeenRoom, a_ledge_beyond_the_window_is_not_of_the_room) {
  RoomWithLedge scene;
  scene.camera = test::look_at({2.0, 3.0, 2.0}, {2.0, 5.1, 0.9}, kWidth, kHeight, 0.6);
  for (const auto& renderer : both_renderers(scene)) {
    const RoomWithLedge::Seen seen = scene.seen(*renderer);
    EXPECT_EQ(seen.ledge, 0) << renderer->description();
    EXPECT_GT(seen.nothing, 2000) << renderer->description();
    EXPECT_GT(seen.room, 2000) << renderer->description();
  }
}

TEST(SeenRoom, from_outside_the_room_is_seen_through_the_window_and_the_ledge_before_it) {
  RoomWithLedge scene;
  scene.camera = test::look_at({2.0, 7.0, 2.2}, {2.0, 4.5, 0.9}, kWidth, kHeight, 0.6);
  std::vector<RoomWithLedge::Seen> seen;
  for (const auto& renderer : both_renderers(scene)) {
    seen.push_back(scene.seen(*renderer));
    EXPECT_GT(seen.back().ledge, 500) << renderer->description();
    EXPECT_GT(seen.back().room, 2000) << renderer->description();
  }
  EXPECT_NEAR(seen[0].ledge, seen[1].ledge, 0.05 * seen[1].ledge);
}

} // namespace
} // namespace daylit
