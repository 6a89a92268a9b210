// What an object does to the room around it: closed forms, and the kept values against many rays.

#include <gtest/gtest.h>

#include "runtime/composite/change_picture.h"
#include "runtime/composite/compose.h"
#include "runtime/indirect/indirect_shadow.h"
#include "runtime/sky/window_sampler.h"
#include "runtime/trace/traced_renderer.h"
#include "scene/lens/lens.h"
#include "test_session.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

/// The box room under an indirect light that is the same everywhere and in all directions, and that its white walls
/// send back; a sphere in its air.
struct Surrounded {
  BasisVolume volume;
  LightField field;
  LightFieldSampler sampler = *LightFieldSampler::make(volume);
  RayScene rays = *RayScene::build(volume.room);
  RoomLight room_light{volume.room, rays, sampler};
  std::vector<SkyMap> pyramid;
  std::vector<ApertureCell> cells;
  ObjectMesh mesh;
  RayScene mesh_rays;
  IndirectShadow change;

  static constexpr double kRadiance = 2.0;
  static RayScene rays_of(const ObjectMesh& mesh) {
    return *RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  }
  /// Without windows their place is wall.
  static BasisVolume white_box(bool closed) {
    BasisVolume box = test::box_volume({});
    for (Material& m : box.room.materials)
      m.reflectance = Rgb(1.0f);
    for (const Aperture& pane : closed ? test::box_window() : std::vector<Aperture>{}) {
      const auto first = static_cast<std::uint32_t>(box.room.vertices.size());
      box.room.vertices.insert(box.room.vertices.end(), pane.corners.begin(), pane.corners.end());
      for (std::uint32_t k = 2; k < pane.corners.size(); ++k)
        box.room.triangles.push_back({{first, first + k - 1, first + k}, box.room.triangles[0].material});
    }
    return box;
  }
  explicit Surrounded(float radius, const std::vector<Aperture>& windows = {}, float sky_factor = 0.0f)
      : volume(white_box(windows.empty())), mesh(test::torus(0.0f, radius, 96, 64)), mesh_rays(rays_of(mesh)),
        change(volume.room, rays, windows, room_light) {
    Sh9Rgb light{};
    light[0] = Rgb(static_cast<float>(kRadiance * 2.0 * std::sqrt(kPi)));
    field.probe.assign(volume.probes.size(), light);
    SkyMap sky = test::overcast_sky(64);
    for (Rgb& c : sky.radiance)
      c *= sky_factor;
    pyramid = sky_map_pyramid(sky);
    cells = aperture_cells(windows, {{2, 3, 1}, 0.2}, pyramid);
    room_light.set_frame(field, pyramid, cells, {});
  }
  void set_walls(float reflectance) {
    for (Material& m : volume.room.materials)
      m.reflectance = Rgb(reflectance);
  }
  /// At a place, sending `radiance` from everywhere, under a sun.
  void place(const glm::dvec3& at, float radiance, const std::optional<DetectedSun>& sun = {}) {
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(at, 1.0);
    change.set_objects({{&mesh_rays, mesh.triangles, mesh.positions, 0, world}});
    change.set_sky(pyramid, sun);
    change.set_direct(std::vector<TwoSided>(mesh.positions.size(), {Rgb(radiance), Rgb(radiance)}),
                      test::place(mesh, at));
    change.set_indirect(std::vector<TwoSided>(mesh.positions.size()));
    change.exchange_with_room();
  }
  std::size_t lowest_vertex() const {
    return std::ranges::min_element(mesh.positions, {}, &glm::vec3::z) - mesh.positions.begin();
  }
  std::uint32_t floor_at(const glm::dvec3& x) const {
    RayHit hit;
    EXPECT_TRUE(rays.closest(rays.to_local(x + glm::dvec3(0, 0, 0.5)), glm::vec3(0, 0, -1), 0.0f, 1.0f, hit));
    return hit.triangle;
  }
  IndirectChange at(const glm::dvec3& x) const { return change.at(floor_at(x), x, {0, 0, -1}); }
};

TEST(IndirectShadow, a_sphere_takes_and_gives_by_its_form_factor) {
  // From a point below a sphere of radius r at height h: F = (r / h)^2 (Howell B-4). Behind it are white walls
  // under the irradiance pi L, so that Delta E = pi F (L_object - L).
  Surrounded s(0.2f);
  for (const float radiance : {0.0f, 3.0f}) {
    s.place({2.0, 2.5, 1.0}, radiance);
    const double f = 0.2 * 0.2, expected = kPi * f * (static_cast<double>(radiance) - Surrounded::kRadiance);
    const IndirectChange exact = s.change.evaluate(s.floor_at({2.0, 2.5, 0.0}), {2.0, 2.5, 0.0}, {0, 0, -1}, 4096);
    EXPECT_NEAR(exact.irradiance.g, expected, 0.01 * std::fabs(expected)) << "4096 rays; the sphere has facets";
    EXPECT_NEAR(s.at({2.0, 2.5, 0.0}).irradiance.g, expected, 0.03 * std::fabs(expected));
    EXPECT_NEAR(exact.before.g, kPi * Surrounded::kRadiance, 1e-3);
  }
}

TEST(IndirectShadow, kept_values_agree_with_many_rays_at_each_point) {
  Surrounded s(0.15f);
  s.place({2.0, 2.5, 0.16}, 0.0f);
  double square = 0, largest = 0;
  int count = 0;
  for (double x = 1.45; x < 2.6; x += 0.037)
    for (double y = 1.95; y < 3.1; y += 0.041) {
      const glm::dvec3 p(x, y, 0.0);
      const double kept = static_cast<double>(s.at(p).irradiance.g),
                   exact = static_cast<double>(s.change.evaluate(s.floor_at(p), p, {0, 0, -1}, 1024).irradiance.g);
      square += (kept - exact) * (kept - exact);
      largest = std::max(largest, std::fabs(exact));
      ++count;
    }
  EXPECT_GT(largest, 0.3 * kPi * Surrounded::kRadiance) << "under the sphere most of the light is gone";
  EXPECT_LT(std::sqrt(square / count), 0.02 * largest);
}

/// A cube of that edge around the origin, its faces cut into squares.
ObjectMesh cube(float edge) {
  constexpr int kCut = 24;
  ObjectMesh mesh;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const float side = face % 2 ? 1.0f : -1.0f;
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int j = 0; j <= kCut; ++j)
      for (int i = 0; i <= kCut; ++i) {
        glm::vec3 p(0.0f), n(0.0f);
        n[axis] = side;
        p[axis] = 0.5f * edge * side;
        p[u] = edge * (static_cast<float>(i) / kCut - 0.5f) * side;
        p[v] = edge * (static_cast<float>(j) / kCut - 0.5f);
        mesh.positions.push_back(p);
        mesh.normals.push_back(n);
        mesh.reflectance.emplace_back(0.5f);
      }
    for (std::uint32_t j = 0; j < kCut; ++j)
      for (std::uint32_t i = 0; i < kCut; ++i) {
        const std::uint32_t a = first + j * (kCut + 1) + i;
        mesh.triangles.push_back({a, a + 1, a + kCut + 2});
        mesh.triangles.push_back({a, a + kCut + 2, a + kCut + 1});
      }
  }
  return mesh;
}

TEST(IndirectShadow, beside_a_cube_on_the_floor_the_change_follows_the_closed_form_up_to_the_contact_line) {
  // From a point c before the middle of an upright rectangle of width 2 w and height h that stands on the floor:
  // F = 1/pi (atan(w / c) - c / sqrt(c^2 + h^2) atan(w / sqrt(c^2 + h^2))) (Howell B-5, twice).
  constexpr double kEdge = 0.2;
  Surrounded s(0.1f);
  s.mesh = cube(static_cast<float>(kEdge));
  s.mesh_rays = Surrounded::rays_of(s.mesh);
  s.place({2.0, 2.5, 0.5 * kEdge}, 3.0f);
  const double contrast = kPi * (3.0 - Surrounded::kRadiance);
  for (const double c : {0.001, 0.002, 0.004, 0.008, 0.015, 0.03, 0.06, 0.12}) {
    const double slant = std::hypot(c, kEdge), w = 0.5 * kEdge;
    const double expected = contrast / kPi * (std::atan(w / c) - c / slant * std::atan(w / slant));
    EXPECT_NEAR(s.at({2.0, 2.5 + 0.5 * kEdge + c, 0.0}).irradiance.g, expected, 0.03 * contrast) << c;
    EXPECT_NEAR(s.at({2.0 + 0.5 * kEdge + c, 2.5, 0.0}).irradiance.g, expected, 0.03 * contrast)
        << c << ": 48 rays, each 2 % of the hemisphere";
  }
}

TEST(IndirectShadow, at_a_contact_line_the_part_of_the_light_is_right_where_volume_and_walls_disagree) {
  // As above, with a black cube, and walls that send 0.85 or 1.2 of what the volume says: what is left is 1 - F of it.
  constexpr double kEdge = 0.2;
  for (const float walls : {0.85f, 1.0f, 1.2f}) {
    Surrounded s(0.1f);
    s.set_walls(walls);
    s.mesh = cube(static_cast<float>(kEdge));
    s.mesh_rays = Surrounded::rays_of(s.mesh);
    s.place({2.0, 2.5, 0.5 * kEdge}, 0.0f);
    for (const double c : {0.002, 0.008, 0.03}) {
      const double slant = std::hypot(c, kEdge), w = 0.5 * kEdge;
      const double f = (std::atan(w / c) - c / slant * std::atan(w / slant)) / kPi;
      const IndirectChange change = s.at({2.0, 2.5 + 0.5 * kEdge + c, 0.0});
      EXPECT_NEAR(-change.irradiance.g / change.before.g, f, 0.03) << walls << ", " << c;
    }
  }
}

TEST(IndirectShadow, hides_the_sunlit_wall_behind_an_object_as_many_rays_say) {
  // The low sun lights the wall y = 0 up to 1.1 m; a black ball stands between it and the floor.
  Surrounded s(0.2f, test::box_window());
  s.mesh.reflectance.assign(s.mesh.reflectance.size(), Rgb(0.0f));
  DetectedSun sun;
  sun.direction = glm::normalize(glm::dvec3(0.0, 1.0, 0.2));
  sun.normal_irradiance = Rgb(1000.0f);
  const glm::dvec3 ball(2.0, 0.6, 0.21);
  for (const glm::dvec3& x : {glm::dvec3(2.0, 1.0, 0.0), glm::dvec3(2.1, 0.85, 0.0), glm::dvec3(2.0, 1.6, 0.0)}) {
    s.place(ball, 0.0f, sun);
    const double with_sun = static_cast<double>(s.at(x).irradiance.g);
    double lost = 0.0; // (Malley 1988) cosine-weighted directions
    constexpr int kRays = 1 << 14;
    for (int k = 0; k < kRays; ++k) {
      const glm::dvec2 u = lattice_point(k, kRays);
      const double r = std::sqrt(u.x), turn = 2.0 * kPi * u.y;
      const glm::dvec3 w(r * std::cos(turn), r * std::sin(turn), std::sqrt(1.0 - u.x)), to = ball - x;
      const double along = glm::dot(to, w);
      RayHit hit;
      if (along <= 0.0 || glm::dot(to, to) - along * along > 0.04 ||
          !s.rays.closest(s.rays.to_local(x + 1e-3 * w), glm::vec3(w), 0.0f, 100.0f, hit))
        continue;
      const glm::dvec3 there = x + (1e-3 + static_cast<double>(hit.distance)) * w;
      lost += 1.0 / kRays * static_cast<double>(s.change.sun_irradiance(hit.triangle, there, w).g);
    }
    ASSERT_GT(lost, 1.0);
    s.place(ball, 0.0f);
    EXPECT_NEAR(static_cast<double>(s.at(x).irradiance.g) - with_sun, lost, 0.08 * lost) << "36 points of the window";
  }
}

TEST(IndirectShadow, falls_off_without_a_step_where_cells_grow) {
  Surrounded s(0.15f);
  s.place({2.0, 2.5, 0.16}, 0.0f);
  // Distances where one width of cells hands over to the next lie between 1.1 and 4.5 radii. Over 2 mm the change of a
  // smooth curve is 2 mm / (distance to the middle) x 4 of its value at the steepest, F ~ h r^2 / d^4.
  double last = 0.0, steepest = 0.0;
  int count = 0;
  for (double x = 0.1; x < 0.75; x += 0.002, ++count) {
    const double here = static_cast<double>(s.at({2.0 + x, 2.5, 0.0}).irradiance.g), d = std::hypot(x, 0.16);
    if (count > 0)
      steepest = std::max(steepest, std::fabs(here - last) / std::fabs(last) / (4.0 * 0.002 / d));
    last = here;
  }
  EXPECT_LT(steepest, 1.6);
}

TEST(IndirectShadow, a_sunlit_sphere_brightens_the_floor_beside_it) {
  Surrounded s(0.2f, test::box_window());
  DetectedSun sun;
  sun.direction = glm::normalize(glm::dvec3(0.0, 1.0, 0.55));
  sun.normal_irradiance = Rgb(1000.0f);
  s.place({2.0, 3.3, 0.45}, 0.0f, sun);
  // On the sun's side the floor sees the lit half, on the other the dark one.
  const float lit = s.at({2.0, 3.75, 0.0}).irradiance.g, dark = s.at({2.0, 2.85, 0.0}).irradiance.g;
  EXPECT_GT(lit, 10.0f);
  EXPECT_LT(dark, 0.4f * lit);
}

TEST(IndirectShadow, an_object_loses_the_light_of_the_floor_that_it_shades) {
  Surrounded s(0.2f, test::box_window(), 1.0f);
  s.place({2.0, 3.3, 0.21}, 0.0f);
  const std::size_t lowest = s.lowest_vertex();
  EXPECT_LT(irradiance(s.change.feedback(0, lowest), {0, 0, -1}).g, 0.0f);
  s.place({2.0, 3.3, 1.6}, 0.0f); // high up its shadow is far away
  EXPECT_NEAR(irradiance(s.change.feedback(0, lowest), {0, 0, -1}).g, 0.0f, 1e-6f);
}

TEST(IndirectShadow, where_a_sphere_touches_the_floor_it_sees_no_light_from_below) {
  // Black, it hides white walls under pi L from the floor at its foot, and loses all of that.
  Surrounded s(0.2f);
  s.place({2.0, 2.5, 0.2}, 0.0f);
  const double lost = kPi * Surrounded::kRadiance;
  EXPECT_NEAR(irradiance(s.change.feedback(0, s.lowest_vertex()), {0, 0, -1}).g, -lost, 0.06 * lost);
}

TEST(IndirectShadow, objects_beside_each_other_exchange_light_by_their_form_factor) {
  // At a point of one sphere, d from the middle of another of radius r, whose normal is theta off that direction: the
  // other covers F = (r / d)^2 cos theta where all of it is above the horizon (Howell B-4), and hides white
  // walls under the irradiance pi L.
  Surrounded s(0.15f);
  const glm::dvec3 here(2.0, 2.5, 1.2), there(2.0, 2.05, 1.2);
  std::vector<PlacedPart> parts;
  ObjectSurface both;
  for (const glm::dvec3& at : {here, there}) {
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(at, 1.0);
    parts.push_back({&s.mesh_rays, s.mesh.triangles, s.mesh.positions, both.positions.size(), world});
    const ObjectSurface one = test::place(s.mesh, at);
    both.positions.insert(both.positions.end(), one.positions.begin(), one.positions.end());
    both.normals.insert(both.normals.end(), one.normals.begin(), one.normals.end());
    both.reflectance.insert(both.reflectance.end(), one.reflectance.begin(), one.reflectance.end());
  }
  s.change.set_objects(parts);
  EXPECT_TRUE(s.change.objects_see_each_other());
  for (const float radiance : {0.0f, 4.0f}) {
    s.change.set_sky(s.pyramid, {});
    s.change.set_direct(std::vector<TwoSided>(both.positions.size(), {Rgb(radiance), Rgb(0.0f)}), both);
    s.change.set_indirect(std::vector<TwoSided>(both.positions.size()));
    s.change.exchange();
    const double contrast = kPi * (static_cast<double>(radiance) - Surrounded::kRadiance);
    for (const double turn : {0.0, 0.3, 0.6}) {
      const glm::dvec3 n(std::sin(turn), -std::cos(turn), 0.0), x = here + 0.15 * n, to = there - x;
      const double d = glm::length(to), theta_cosine = glm::dot(n, to) / d;
      ASSERT_GT(std::asin(theta_cosine), std::asin(0.15 / d)) << "above the horizon";
      const double expected = contrast * 0.15 * 0.15 / (d * d) * theta_cosine;
      const double found = static_cast<double>(irradiance(s.change.exchanged(0, x), n).g);
      EXPECT_NEAR(found, expected, 0.12 * std::fabs(expected)) << turn << ": nine coefficients, eight points a side";
    }
    const double behind =
        static_cast<double>(irradiance(s.change.exchanged(0, here + glm::dvec3(0, 0.15, 0)), glm::vec3(0, 1, 0)).g);
    EXPECT_NEAR(behind, 0.0, 0.03 * std::fabs(contrast) * 0.25) << "on the far side nothing changes";
  }
  parts[1].world_from_object[3] = glm::dvec4(2.0, 2.5, 1.2 + 0.3 / 0.0447 + 0.2, 1.0); // a five-hundredth of the view
  s.change.set_objects(parts);
  EXPECT_FALSE(s.change.objects_see_each_other());
}

TEST(IndirectShadow, far_away_nothing_is_looked_at) {
  Surrounded s(0.02f);
  s.place({2.0, 2.5, 1.0}, 5.0f);
  EXPECT_FALSE(s.change.affects({0.2, 0.2, 0.0}));
  EXPECT_TRUE(s.change.affects({2.0, 2.5, 0.8}));
}

TEST(ChangePicture, what_is_left_out_is_bounded_and_the_rest_grows_smoothly) {
  float left_out = 0.0f, last = 0.0f;
  for (int k = 0; k <= 2000; ++k) {
    const float change = 1e-5f * static_cast<float>(k);
    const float drawn = change * ChangePicture::drawn_fraction(Rgb(0.5f * change, change, 0.0f), Rgb(1.0f));
    EXPECT_GE(drawn, last) << "a larger change is drawn larger";
    EXPECT_LT(drawn - last, 2.5e-5f) << "no step";
    EXPECT_FLOAT_EQ(drawn, change * ChangePicture::drawn_fraction(Rgb(-change, 0.0f, 0.0f), Rgb(1.0f)));
    left_out = std::max(left_out, change - drawn);
    last = drawn;
    if (change <= 0.5f * ChangePicture::kThreshold) {
      EXPECT_EQ(drawn, 0.0f);
    }
    if (change >= 1.5f * ChangePicture::kThreshold) {
      EXPECT_EQ(drawn, change);
    }
  }
  EXPECT_LT(left_out, ChangePicture::kThreshold * 2.0f / 3.0f);
  EXPECT_EQ(ChangePicture::drawn_fraction(Rgb(1e-9f), Rgb(0.0f)), 1.0f) << "where there was no light, any is a change";
  EXPECT_EQ(ChangePicture::drawn_fraction(Rgb(0.0f), Rgb(0.0f)), 0.0f);
}

TEST(ChangePicture, draws_the_whole_change_near_an_object_and_nothing_far_from_it) {
  Surrounded s(0.08f);
  s.set_walls(0.6f);
  s.place({2.0, 2.5, 0.09}, 8.0f);
  const auto camera =
      make_render_camera(ideal_pinhole(320, 320, 0.9), look_at({2.0, 2.4, 2.2}, {2.0, 2.5, 0.0}), 320, 320);
  ASSERT_TRUE(camera);
  ChangePicture picture;
  const ViewCorners picture_view(*camera, s.rays, nullptr);
  picture.update(picture_view, s.change, nullptr);
  EXPECT_GT(picture.left_out(), 0.5f * ChangePicture::kThreshold) << "the window of the share was met";
  EXPECT_LT(picture.left_out(), ChangePicture::kThreshold * 2.0f / 3.0f);
  int whole = 0, nothing = 0;
  for (int y = 0; y < 320; ++y)
    for (int x = 0; x < 320; ++x) {
      const glm::dvec3 w = camera->direction({x, y});
      const glm::dvec3 p = camera->eye() - camera->eye().z / w.z * w;
      const IndirectChange here = s.at(p);
      const float relative = here.irradiance.g / here.before.g;
      const auto drawn = picture.at(x, y);
      if (relative > 0.02f && relative < 0.1f) { // beyond, it turns within a block of pixels
        ASSERT_TRUE(drawn);
        EXPECT_NEAR(drawn->irradiance.g / drawn->before.g, relative, 0.006f)
            << "of the light before; blocks are half as wide as the object";
        ++whole;
      }
      if (relative < 0.4f * ChangePicture::kThreshold) {
        EXPECT_FALSE(drawn);
        ++nothing;
      }
    }
  EXPECT_GT(whole, 2000);
  EXPECT_GT(nothing, 30000);
}

TEST(Compose, blocks_show_what_their_pixels_show_one_by_one) {
  constexpr int kSide = 320;
  const std::vector<Aperture> windows = test::box_window();
  Surrounded s(0.12f, windows, 40.0f);
  const glm::dvec3 place(2.0, 3.6, 0.13);
  s.place(place, 1.0f);
  auto renderer = TracedRenderer::make(s.volume.room, windows);
  ASSERT_TRUE(renderer);
  const RenderCamera camera = test::look_at({2.6, 4.7, 1.0}, {2.0, 3.5, 0.1}, kSide, kSide, 0.9);
  const ObjectSurface object = test::place(s.mesh, place);
  const LightSet lights = sample_lights(s.pyramid[0], {}, windows, object.bounds(), 64);
  RenderedFrame frame;
  for (const auto& step : {renderer->set_camera(camera), renderer->set_objects(object), renderer->set_lights(lights),
                           renderer->draw(frame)})
    ASSERT_TRUE(step) << step.error().message();
  ChangePicture change;
  const ViewCorners change_view(camera, s.rays, nullptr);
  change.update(change_view, s.change, nullptr);
  const RgbImage photo(kSide, kSide, Rgb(0.4f, 0.5f, 0.6f));
  const auto look_up = [&](const glm::dvec3& direction, std::uint32_t triangle) {
    return triangle == kUnknownTriangle ? s.room_light.at(camera.eye(), direction)
                                        : s.room_light.at_plane(triangle, camera.eye(), direction);
  };
  Composite blocks, pixels;
  compose(photo, frame, camera, look_up, {}, blocks, &change);
  ChangePicture beside;
  beside.update(change_view, s.change, &frame);
  Composite same;
  compose(photo, frame, camera, look_up, {}, same, &beside);
  int behind = 0; // pixels that look_up() at the corners was spared
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * kSide + x;
      ASSERT_EQ(same.picture.texels[i], blocks.picture.texels[i]) << x << " " << y;
      behind += change.at(x, y) && !beside.at(x, y);
      ASSERT_TRUE(!change.at(x, y) || beside.at(x, y) || blocks.coverage[i] == 1.0f);
    }
  EXPECT_GT(behind, 100) << "nothing is looked up behind the object";
  // A frame that does not know its triangles, and shows every block, is composed pixel by pixel.
  RenderedFrame every = frame;
  for (int row = 0; row < frame.rows(); ++row)
    for (int column = 0; column < frame.columns(); ++column) {
      if (!frame.shows(column, row))
        every.show(column, row);
      for (int k = 0; k < RenderedFrame::kBlock * RenderedFrame::kBlock; ++k)
        every.at(4 * column + k % 4, 4 * row + k / 4).triangle = kUnknownTriangle;
    }
  compose(photo, every, camera, look_up, {}, pixels, &change);
  double square = 0.0, largest = 0.0, darkest = 1.0;
  int touched = 0, otherwise = 0;
  for (std::size_t i = 0; i < photo.texels.size(); ++i) {
    ASSERT_EQ(blocks.touched[i] == 2, pixels.touched[i] == 2);
    if (pixels.touched[i] == 2)
      continue;
    otherwise += blocks.touched[i] != pixels.touched[i];
    const double a = static_cast<double>(blocks.picture.texels[i].g),
                 b = static_cast<double>(pixels.picture.texels[i].g);
    square += (a - b) * (a - b) / (b * b);
    largest = std::max(largest, std::fabs(a - b) / b);
    darkest = std::min(darkest, b / 0.5);
    touched += pixels.touched[i] == 1;
  }
  EXPECT_GT(touched, 5000);
  EXPECT_LT(darkest, 0.5) << "a shadow";
  EXPECT_LT(std::sqrt(square / touched), 2e-4) << "light between the corners of eight pixels, taken as straight";
  EXPECT_LT(largest, 0.01);
  EXPECT_LT(otherwise, touched / 50) << "of half a code value";
}

} // namespace
} // namespace daylit
