#include "radiosity/detail/whole_faces.h"

#include <cmath>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/gather.h"
#include "scene/room/ray_scene.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using namespace daylit::testing;

/// Furniture that touches, hangs free, is thin and is turned.
Room furnished_room() {
  Room room = room_with_window_hole(0.5f);
  add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  add_box(room, {-1.4, -0.6, 0.9}, {-0.4, 0.7, 0.91}, 0b111111u, false);
  const glm::dvec3 a(-0.8, 0.9, 0), b(-0.3, 1.3, 0), up(0, 0, 1.1);
  add_quad(room, a, b, b + up, a + up);
  return room;
}

struct Traced {
  Room room;
  SurfaceMesh mesh;
  RayScene scene;
  PatchSet set;
};

Traced traced(const Room& room, int facets) {
  Traced t{room, *mesh_surfaces(room, {.target_facets = facets}), {}, {}};
  t.scene = *facet_scene(t.mesh);
  t.set = find_patches(room, t.mesh, t.scene, find_apertures(room, *RayScene::build(room))->list);
  return t;
}

struct Differences {
  int rays = 0, unknown = 0, other = 0;
  int missed = 0; ///< unknown, and yet there is a facet
};

/// Against the hierarchy of facets, one ray at a time.
Differences compare(const Traced& t, const WholeFaces& faces, const glm::dvec3& point, double angle, int rays) {
  const RayFan fan = RayFan::of(rays);
  const RayGroups groups = RayGroups::of(fan.direction);
  std::vector<std::int32_t> met(groups.rays());
  const double c = std::cos(angle), s = std::sin(angle);
  faces.trace(point, groups, {c, s}, met);
  Differences d;
  for (std::size_t k = 0; k < met.size(); ++k) {
    ++d.rays;
    const glm::dvec3 f(fan.direction[k]);
    const glm::vec3 ray(f.x * c - f.y * s, f.x * s + f.y * c, f.z);
    RayHit hit;
    const bool facet = t.scene.closest(t.scene.to_local(point), ray, 0, 1e9f, hit);
    if (met[k] == WholeFaces::kUnknown) {
      ++d.unknown;
      d.missed += facet;
    } else if (!facet || met[k] != t.set.hit(t.mesh, hit.triangle, ray)) {
      ++d.other;
    }
  }
  return d;
}

TEST(WholeFaces, rays_meet_what_they_meet_among_the_facets) {
  const Traced t = traced(furnished_room(), 900);
  const WholeFaces faces = WholeFaces::make(t.room, t.mesh, t.set);
  ASSERT_FALSE(faces.empty());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(-0.95, 0.95);
  const glm::dvec3 half = 0.5 * t.room.bounds().size();
  Differences sum;
  for (int k = 0; k < 60; ++k) {
    const glm::dvec3 point = half * glm::dvec3(share(random), share(random), share(random));
    const Differences d = compare(t, faces, point, 3.0 * share(random), 1000);
    sum.rays += d.rays;
    sum.unknown += d.unknown;
    sum.other += d.other;
    sum.missed += d.missed;
  }
  EXPECT_LE(sum.other, sum.rays / 20000);  // along an edge a ray may fall to either side
  EXPECT_LE(sum.missed, sum.rays / 20000); // all others go out through the hole
}

TEST(WholeFaces, a_point_in_the_plane_of_a_face_sees_past_it_and_one_on_a_face_does_not_know) {
  const Traced t = traced(furnished_room(), 900);
  const WholeFaces faces = WholeFaces::make(t.room, t.mesh, t.set);
  const double top_m = 0.8 - t.mesh.origin.z; // of the box
  const Differences beside = compare(t, faces, {-1.0, -1.0, top_m}, 0.4, 2000),
                    on = compare(t, faces, glm::dvec3(1.5, 1.5, 0.8) - t.mesh.origin, 0.4, 2000);
  EXPECT_LE(beside.other, 1);
  EXPECT_LE(beside.missed, 1);
  EXPECT_EQ(on.unknown, on.rays);
}

TEST(WholeFaces, gathering_takes_the_hierarchy_where_they_do_not_know) {
  const Traced t = traced(furnished_room(), 600);
  const WholeFaces faces = WholeFaces::make(t.room, t.mesh, t.set);
  const std::array<glm::dvec3, 3> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(0.9, -0.7, 0.4),
                                            glm::dvec3(0.1, -1.2, -0.2)};
  const Progress silent = [](const std::string&, double) { return true; };
  const GatherHits with = *gather_hits(points, t.set, t.mesh, t.scene, {.faces = &faces}, silent),
                   without = *gather_hits(points, t.set, t.mesh, t.scene, {}, silent);
  const std::size_t n = t.set.patches.size();
  std::vector<float> a(9 * n), b(9 * n);
  for (std::size_t p = 0; p < points.size(); ++p) {
    with.weights(p, a.data());
    without.weights(p, b.data());
    int other = 0;
    for (std::size_t e = 0; e < n; ++e)
      other += std::abs(a[e] - b[e]) > 1e-6f;
    EXPECT_LE(other, 2) << p;
  }
}

TEST(WholeFaces, many_faces_are_left_to_the_hierarchy) {
  Room room = room_with_window_hole(0.5f);
  add_sphere(room, {0.5, 0.5, 1.0}, 0.3, 6); // 720 facets
  const Traced t = traced(room, 900);
  EXPECT_TRUE(WholeFaces::make(t.room, t.mesh, t.set).empty());
}

} // namespace
} // namespace daylit::radiosity
