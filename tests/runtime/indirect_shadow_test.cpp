// What an object does to the room around it: closed forms, and the kept values against many rays.

#include <gtest/gtest.h>

#include "runtime/sky/window_sampler.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::kPi;
using test::Surrounded;

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

TEST(IndirectShadow, around_an_object_beside_one_of_five_times_its_size_kept_values_agree_with_many_rays) {
  Surrounded s(0.15f);
  std::vector<PlacedPart> parts;
  for (const auto& [at, scale] : {std::pair{glm::dvec3(2.0, 2.5, 0.16), 1.0}, {glm::dvec3(2.3, 2.5, 0.035), 0.2}}) {
    glm::dmat4 world{glm::dmat3(scale)};
    world[3] = glm::dvec4(at, 1.0);
    parts.push_back({&s.mesh_rays, s.mesh.triangles, s.mesh.positions, s.mesh.positions.size() * parts.size(), world});
  }
  s.change.set_objects(parts);
  s.change.set_sky(s.pyramid, {});
  const std::vector<TwoSided> black(2 * s.mesh.positions.size());
  s.change.set_direct(black, {}, {});
  s.change.set_indirect(black);
  double square = 0.0, largest = 0.0;
  int count = 0;
  for (double x = 2.22; x < 2.38; x += 0.0071) // around the small one
    for (double y = 2.42; y < 2.58; y += 0.0083, ++count) {
      const glm::dvec3 p(x, y, 0.0);
      const double kept = static_cast<double>(s.at(p).irradiance.g),
                   exact = static_cast<double>(s.change.evaluate(s.floor_at(p), p, {0, 0, -1}, 1024).irradiance.g);
      square += (kept - exact) * (kept - exact);
      largest = std::max(largest, std::fabs(exact));
    }
  EXPECT_GT(largest, 0.3 * kPi * Surrounded::kRadiance);
  EXPECT_LT(std::sqrt(square / count), 0.008 * largest) << "0.004; 0.013 where wider cells begin three radii nearer";
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

TEST(IndirectShadow, a_side_loses_the_floor_only_where_it_sees_it) {
  // As above: past an open object as by nine coefficients; nothing where the object hides its lower half from it.
  Surrounded s(0.2f);
  s.place({2.0, 2.5, 0.2}, 0.0f);
  const SelfVisibility open;
  SelfVisibility shut(VertexRays(s.mesh, s.mesh_rays, 128), 1);
  SideView nothing;
  nothing.hidden.assign(128 / VertexRays::kFan, 0xFFFF);
  shut.set(0, false, nothing);
  const auto change = [&](const SelfVisibility& visibility) {
    const SenderSide side{&visibility, 0, false, VertexRays::frame({0, 0, -1})};
    return s.change.feedback(s.change.feedback_terms(0, s.lowest_vertex(), side)).g;
  };
  const double lost = kPi * Surrounded::kRadiance;
  EXPECT_NEAR(change(open), -lost, 0.06 * lost);
  EXPECT_EQ(change(shut), 0.0f);
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
    s.change.set_direct(std::vector<TwoSided>(both.positions.size(), {Rgb(radiance), Rgb(0.0f)}), both,
                        both.reflectance);
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

TEST(IndirectShadow, another_object_hides_the_points_of_windows_that_lie_behind_it) {
  const std::vector<Aperture> panes = test::box_window();
  Surrounded s(0.3f, panes, 1.0f);
  const glm::dvec3 here(2.0, 1.5, 1.2), there(2.2, 2.6, 1.3), x = here + glm::dvec3(0.0, 0.301, 0.0);
  std::vector<PlacedPart> parts;
  for (const glm::dvec3& at : {here, there}) {
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(at, 1.0);
    parts.push_back({&s.mesh_rays, s.mesh.triangles, s.mesh.positions, s.mesh.positions.size() * parts.size(), world});
  }
  s.change.set_objects(parts);
  const WindowVisibility windows(s.rays, panes);
  const auto past_room = windows.seen_points(x), left = s.change.not_hidden(0, x, past_room);
  ASSERT_EQ(past_room.size(), 1u);
  ASSERT_EQ(past_room[0].points, 0xFFFFu);
  EXPECT_EQ(s.change.not_hidden(1, x, past_room)[0].points, 0xFFFFu)
      << "the first lies behind x, the second is its own";
  int hidden = 0;
  const std::vector<glm::dvec3>& c = panes[0].corners;
  for (int k = 0; k < 16; ++k) {
    const double u = (k / 4 + 0.5) / 4.0, v = (k % 4 + 0.5) / 4.0;
    const glm::dvec3 w = glm::normalize(c[0] + u * (c[1] - c[0]) + v * (c[3] - c[0]) - x), to = there - x;
    const double past = glm::length(to - glm::dot(to, w) * w);
    hidden += past < 0.3;
    if (std::fabs(past - 0.3) > 0.005) { // facets
      EXPECT_EQ(left[0].points >> k & 1, past < 0.3 ? 0 : 1) << k << ", " << past << " m from the middle";
    }
  }
  EXPECT_GE(hidden, 2);
  EXPECT_LE(hidden, 14);
}

TEST(IndirectShadow, a_vertex_at_another_object_loses_what_this_hides_by_its_form_factor) {
  // 2 cm before a black sphere of radius r, facing its middle: F = (r / d)^2 of the light of white walls, pi L.
  Surrounded s(0.15f, test::box_window(), 1.0f);
  std::vector<PlacedPart> parts;
  for (const glm::dvec3& at : {glm::dvec3(2.0, 2.5, 1.2), {2.0, 2.82, 1.2}}) { // the second before the window
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(at, 1.0);
    parts.push_back({&s.mesh_rays, s.mesh.triangles, s.mesh.positions, s.mesh.positions.size() * parts.size(), world});
  }
  s.change.set_objects(parts);
  s.change.set_sky(s.pyramid, {});
  s.change.set_direct(std::vector<TwoSided>(2 * s.mesh.positions.size()), {}, {});
  s.change.set_indirect(std::vector<TwoSided>(2 * s.mesh.positions.size()));
  s.change.exchange();
  const SelfVisibility open;
  const auto view_of = [&](const glm::dvec3& x, const glm::vec3& n) {
    return s.change.contact_view(0, x, SenderSide{&open, 0, false, VertexRays::frame(n)});
  };
  const ContactView near = view_of({2.0, 2.65, 1.2}, {0, 1, 0}), away = view_of({2.0, 2.35, 1.2}, {0, -1, 0});
  const double form_factor = 0.15 * 0.15 / (0.17 * 0.17);
  EXPECT_EQ(near.share, 1.0f);
  double solid = 0.0;
  for (const OccludedDirection& d : near.covered)
    solid += static_cast<double>(d.weight) / kPi;
  EXPECT_NEAR(solid, form_factor, 0.05 * form_factor);
  EXPECT_LT(s.change.exchanged(near).g, 0.0f);
  EXPECT_GT(near.blocked, 0.5f) << "most of the window is behind it";
  EXPECT_EQ(away.share, 0.0f) << "the far side has nothing near";
}

TEST(IndirectShadow, a_wall_that_an_object_shades_sends_less_to_the_floor_beside_it) {
  // Of a black sphere above the horizon of x, F = (r / d)^2 cos theta (Howell B-4): Delta E = -pi L F on the floor and
  // on the wall, and the wall, white, sends the floor that much less from each direction past the sphere.
  Surrounded s(0.2f);
  const glm::dvec3 centre(0.3, 2.5, 0.3), x(0.1, 2.5, 0.0);
  s.place(centre, 0.0f);
  const auto form_factor = [&](const glm::dvec3& p, const glm::dvec3& n) {
    const glm::dvec3 d = centre - p;
    return 0.04 * std::max(glm::dot(n, d), 0.0) / std::pow(glm::length(d), 3.0);
  };
  const double alone = -kPi * Surrounded::kRadiance * form_factor(x, {0, 0, 1});
  double reflected = 0.0;
  constexpr int kCount = 20000;
  for (int k = 0; k < kCount; ++k) {
    const glm::dvec2 u = lattice_point(k, kCount);
    const double r = std::sqrt(u.x), a = 2.0 * kPi * u.y;
    const glm::dvec3 w(r * std::cos(a), r * std::sin(a), std::sqrt(1.0 - u.x)), to = centre - x;
    const double along = glm::dot(to, w), off2 = glm::dot(to, to) - along * along;
    const bool past = along < 0.0 || off2 > 0.04;
    if (const double t = -x.x / w.x; w.x < 0.0 && t * w.z < 1.0 && past)
      reflected -= kPi * Surrounded::kRadiance * form_factor(x + t * w, {1, 0, 0}) / kCount;
  }
  ASSERT_LT(reflected, 0.2 * alone);
  EXPECT_NEAR(s.at(x).irradiance.g, alone + reflected, 0.05 * std::fabs(alone + reflected));
}

TEST(IndirectShadow, corners_of_cells_on_a_wall_say_nothing_of_the_floor_before_it) {
  Surrounded s(0.2f);
  s.place({0.3, 2.5, 0.3}, 0.0f);
  for (double x = 0.002; x < 0.2; x += 0.006) {
    const glm::dvec3 p(x, 2.5, 0.0);
    const float many = s.change.evaluate(s.floor_at(p), p, {0, 0, -1}, 1024).irradiance.g;
    EXPECT_NEAR(s.at(p).irradiance.g, many, 0.4f * std::fabs(many)) << x << " m: the value one cell further";
  }
}

TEST(IndirectShadow, far_away_nothing_is_looked_at) {
  Surrounded s(0.02f);
  s.place({2.0, 2.5, 1.0}, 5.0f);
  EXPECT_FALSE(s.change.affects({0.2, 0.2, 0.0}));
  EXPECT_TRUE(s.change.affects({2.0, 2.5, 0.8}));
}

} // namespace
} // namespace daylit
