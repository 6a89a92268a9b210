#include "runtime/gl/triangle_raster.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace daylit {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

constexpr int kWidth = 70, kHeight = 50; // neither whole groups of columns nor bands of rows

/// Looks along z from the origin, 40 pixels per unit of slope.
RenderCamera camera_at_origin() {
  RenderCamera camera;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.fx = camera.fy = 40.0;
  camera.cx = 34.5;
  camera.cy = 24.5;
  return camera;
}

TriangleRaster started() {
  TriangleRaster raster;
  raster.start(camera_at_origin(), {0, 0, kWidth, kHeight});
  return raster;
}

float shown(const TriangleRaster& raster, int x, int y) {
  return raster.shown()[static_cast<std::size_t>(y * raster.box().width() + x)];
}

/// A wavy sheet across the whole view, beyond its edges too.
struct Sheet {
  std::vector<glm::vec3> positions;
  Triangles triangles;
  Sheet() {
    constexpr std::uint32_t kSide = 41;
    for (std::uint32_t j = 0; j < kSide; ++j)
      for (std::uint32_t i = 0; i < kSide; ++i) {
        const float u = static_cast<float>(i) / 20.0f - 1.0f, v = static_cast<float>(j) / 20.0f - 1.0f;
        positions.emplace_back(3.0f * u, 3.0f * v, 2.0f + 0.3f * std::sin(4.0f * u) * std::cos(5.0f * v));
      }
    for (std::uint32_t j = 0; j + 1 < kSide; ++j)
      for (std::uint32_t i = 0; i + 1 < kSide; ++i) {
        const std::uint32_t k = j * kSide + i;
        triangles.push_back({k, k + 1, k + kSide + 1});
        triangles.push_back({k, k + kSide + 1, k + kSide});
      }
  }
};

TEST(TriangleRaster, a_closed_sheet_leaves_no_sample_empty) {
  const Sheet sheet;
  TriangleRaster raster = started();
  raster.draw({sheet.positions, sheet.triangles});
  raster.find_shown(1e6f);
  EXPECT_TRUE(std::all_of(raster.samples().begin(), raster.samples().end(), [](float s) { return s > 0.0f; }));
  EXPECT_TRUE(std::all_of(raster.shown().begin(), raster.shown().end(), [](float s) { return s > 0.0f; }));
}

TEST(TriangleRaster, the_nearer_triangle_is_shown_whatever_the_order_and_the_room_hides_without_a_number) {
  const std::vector<glm::vec3> positions{{-9, -9, 2}, {9, -9, 2}, {0, 18, 2}, {-9, -9, 1}, {9, -9, 1}, {0, 18, 1}};
  for (const Triangles& order : {Triangles{{0, 1, 2}, {3, 4, 5}}, Triangles{{3, 4, 5}, {0, 1, 2}}}) {
    TriangleRaster raster = started();
    const TriangleRaster::Mesh mesh{positions, order};
    raster.draw(mesh);
    raster.find_shown(1.0f);
    const auto near = static_cast<std::size_t>(shown(raster, 34, 24)) - 1;
    EXPECT_EQ(order[near], (std::array<std::uint32_t, 3>{3, 4, 5}));
    EXPECT_EQ(raster.used_vertices(mesh), (std::vector<std::uint8_t>{0, 0, 0, 1, 1, 1}));
  }
  TriangleRaster raster = started();
  raster.draw({positions, Triangles{{3, 4, 5}}, glm::dvec3(0.0), false});
  raster.draw({positions, Triangles{{0, 1, 2}}});
  raster.find_shown(1.0f);
  EXPECT_EQ(shown(raster, 34, 24), 0.0f);
}

TEST(TriangleRaster, what_passes_the_near_plane_is_cut_there) {
  // A floor 1 below the eye, from behind the camera to z = 4: its far edge lies in row 24.5 + 40 / 4.
  const std::vector<glm::vec3> positions{{-50, 1, -4}, {50, 1, -4}, {50, 1, 4}, {-50, 1, 4}};
  TriangleRaster raster = started();
  raster.draw({positions, Triangles{{0, 1, 2}, {0, 2, 3}}});
  raster.find_shown(1e6f);
  for (int x = 0; x < kWidth; ++x) {
    EXPECT_EQ(shown(raster, x, 33), 0.0f) << x;
    EXPECT_NE(shown(raster, x, 35), 0.0f) << x;
    EXPECT_GT(shown(raster, x, kHeight - 1), 0.0f) << x;
  }
}

TEST(TriangleRaster, pixels_with_an_edge_or_parts_far_apart_are_marked) {
  // Left of x = 0 a surface at 2, right of it one at 2.5: column 34.5 is between pixels 34 and 35.
  const std::vector<glm::vec3> positions{{-9, -9, 2},   {0.01f, -9, 2}, {0.01f, 9, 2}, {-9, 9, 2},
                                         {0, -9, 2.5f}, {9, -9, 2.5f},  {9, 9, 2.5f},  {0, 9, 2.5f}};
  const Triangles left{{0, 1, 2}, {0, 2, 3}}, both{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  TriangleRaster edge = started();
  edge.draw({positions, left});
  edge.find_shown(10.0f);
  EXPECT_LT(shown(edge, 35, 20), 0.0f) << "one sample of it is left of 34.7, where the surface ends";
  EXPECT_GT(shown(edge, 34, 20), 0.0f);
  for (const auto& [apart, marked] : {std::pair{0.2f, true}, {1.0f, false}}) {
    TriangleRaster step = started();
    step.draw({positions, both});
    step.find_shown(apart); // metres, nearly: 1 / 2 - 1 / 2.5 = 0.1 = 0.5 / (2 x 2.5)
    bool any = false;
    for (int x = 33; x < 37; ++x)
      any = any || shown(step, x, 20) < 0.0f;
    EXPECT_EQ(any, marked) << apart;
  }
}

} // namespace
} // namespace daylit
