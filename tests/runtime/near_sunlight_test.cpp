// Light of a sun patch on the floor at an object above it: against the solid angle of a rectangle, and against
// FirstReflection::correction(), which looks at the patch from every point alone.

#include "runtime/indirect/near_sunlight.h"

#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/object/transfer.h"
#include "sh/sh9.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::Surrounded;

const glm::dvec3 kTowardsSun = glm::normalize(glm::dvec3(0.0, 1.0, 0.6));
// Through the window of the box room the sun lights this part of the floor, 1.6 x 2 m.
constexpr double kX0 = 1.2, kX1 = 2.8, kY0 = 1.5, kY1 = 3.5;
const std::vector<glm::dvec3> kPlaces{{2.0, 2.5, 0.12}, {2.05, 3.45, 0.13}, {1.2, 2.0, 0.3}};

struct Rectangle {
  float x0, x1, y0, y1;
};
constexpr Rectangle kWider{1.0f, 3.0f, 1.25f, 3.75f}, kLit{1.3f, 2.7f, 1.6f, 3.4f};

/// Names this part of the floor as two elements, whatever sky node the light comes from.
BasisVolume with_floor_elements(BasisVolume volume, const Rectangle& r) {
  auto compact = std::make_shared<CompactBasis>();
  compact->light = {1, {1.0f, 1.0f}, {0, 8, 16}, {}, std::vector<std::uint16_t>(128, 0x3c00)};
  for (std::uint16_t k = 0; k < 16; ++k)
    compact->light.block.push_back(k % 8);
  compact->light_unit = {0.08f, 0.05f};
  volume.compact = compact;
  const glm::vec3 a(r.x0, r.y0, 0.0f), b(r.x1, r.y0, 0.0f), c(r.x1, r.y1, 0.0f), d(r.x0, r.y1, 0.0f);
  volume.elements = {{{{a, b, c}}, {{a, c, d}}}, {Rgb(0.5f, 0.4f, 0.3f), Rgb(0.5f, 0.4f, 0.3f)}};
  return volume;
}

/// Spheres of 0.1 m in the box room; every seventh vertex sends light.
struct SunnyFloor {
  static constexpr float kRadius = 0.1f, kPane = 0.8f, kSun = 3.0f;
  std::vector<Aperture> panes = test::box_window(Rgb(kPane));
  Surrounded room{kRadius, panes};
  BasisVolume volume;
  ApertureCrossings windows{panes};
  VirtualObjects objects;
  std::vector<VertexProbes> probes;
  std::optional<DetectedSun> sun = DetectedSun{.direction = kTowardsSun, .normal_irradiance = Rgb(kSun)};
  NearSunlight near{volume, room.rays, windows};

  explicit SunnyFloor(const std::vector<glm::dvec3>& places = {kPlaces[0]}, const Rectangle& named = kWider)
      : volume(with_floor_elements(room.volume, named)) {
    stand_at(places);
  }
  static std::shared_ptr<const VirtualObjects::Model> model_of(const ObjectMesh& mesh) {
    VirtualObjects::Model model{mesh, *compute_transfer(mesh), Surrounded::rays_of(mesh)};
    model.senders = find_senders(mesh, {0, 0, 1});
    model.self = *SelfExchange::make(mesh, model.rays, model.senders, false);
    return std::make_shared<const VirtualObjects::Model>(std::move(model));
  }
  void stand_at(const std::vector<glm::dvec3>& places) { stand_at(places, model_of(room.mesh), 7, false); }
  /// Every `step`th vertex sends light.
  void stand_at(const std::vector<glm::dvec3>& places, const std::shared_ptr<const VirtualObjects::Model>& model,
                std::uint32_t step, bool has_back) {
    const ObjectMesh& mesh = model->mesh;
    objects = {};
    std::vector<PlacedPart> placed;
    for (const glm::dvec3& place : places) {
      VirtualObjects::Part part;
      part.model = model;
      part.first_vertex = objects.surface.positions.size();
      part.world_from_object[3] = glm::dvec4(place, 1.0);
      placed.push_back({&model->rays, mesh.triangles, mesh.positions, part.first_vertex, part.world_from_object});
      for (const glm::vec3& p : mesh.positions)
        objects.surface.positions.push_back(place + glm::dvec3(p));
      objects.parts.push_back(std::move(part));
    }
    objects.has_back.assign(objects.surface.positions.size(), has_back);
    for (std::uint32_t v = 0; v < objects.surface.positions.size(); v += step) {
      objects.senders.vertex.push_back(v);
      objects.senders.surface.positions.push_back(objects.surface.positions[v]);
      objects.senders.surface.normals.push_back(mesh.normals[v % mesh.normals.size()]);
      objects.senders.transfer.push_back(model->transfer[v % mesh.normals.size()]);
    }
    room.change.set_objects(std::move(placed));
    probes = find_vertex_probes(room.sampler, objects.senders.surface.positions);
  }
  const std::vector<glm::dvec3>& at() const { return objects.senders.surface.positions; }
  std::vector<Sh9Rgb> correction(std::uint64_t placement = 1, bool shadow = false) {
    return near.correction(objects, probes, placement, sun, shadow ? &room.change : nullptr);
  }

  /// Radiance of the floor's elements as the volume has it.
  std::vector<Rgb> stored() const {
    std::vector<Rgb> node(64, Rgb(0.0f));
    for (const RegionWeight& w : volume.partition.interpolation(sun->direction))
      node[static_cast<std::size_t>(w.region)] +=
          static_cast<float>(w.weight / volume.partition.solid_angle_sr(w.region)) * sun->normal_irradiance;
    return FirstReflection::make(volume, room.rays)->radiance(node);
  }
  /// Nothing but the floor's first reflection, as the volume has it at its probes.
  std::vector<Sh9Rgb> base() const {
    const auto surfaces = FirstReflection::make(volume, room.rays);
    const std::vector<Rgb> light = stored();
    const auto all = surfaces->near(kPlaces[0], 100.0, light);
    LightField field;
    field.probe.assign(volume.probes.size(), {});
    for (const VertexProbes& p : probes)
      for (int k = 0; k < p.count; ++k)
        field.probe[p.probe[k]] = surfaces->at_probe(p.probe[k], all, light).nine;
    return light_between(field, probes);
  }
  /// L = rho / pi cos T E
  static Rgb patch_radiance() {
    return static_cast<float>(kTowardsSun.z / test::kPi) * kPane * kSun * Rgb(0.5f, 0.4f, 0.3f);
  }
  /// The slow twin, where the sun lights all that the volume names.
  Sh9Rgb correction_at(std::size_t v) const {
    const auto count = static_cast<std::size_t>(probes[v].count);
    return FirstReflection::make(volume, room.rays)
        ->correction(at()[v], std::span(probes[v].probe).first(count), std::span(probes[v].weight).first(count),
                     stored(), [](std::size_t, const FirstReflection::Triangle&) { return patch_radiance(); })
        .nine;
  }
};

std::vector<Sh9Rgb> sum(std::vector<Sh9Rgb> a, const std::vector<Sh9Rgb>& b) {
  for (std::size_t v = 0; v < a.size(); ++v)
    for (std::size_t i = 0; i < 9; ++i)
      a[v][i] += b[v][i];
  return a;
}
bool same_bits(const std::vector<Sh9Rgb>& a, const std::vector<Sh9Rgb>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Sh9Rgb)) == 0;
}
float brightest(const std::vector<Sh9Rgb>& light) {
  float most = 0.0f;
  for (const Sh9Rgb& l : light)
    most = std::max(most, l[0].g);
  return most;
}

/// Solid angle of the patch; of each a x b rectangle from a point d above one of its corners
/// atan(ab / (d sqrt(a^2 + b^2 + d^2))), less where the corner lies beyond.
double patch_solid_angle(const glm::dvec3& x) {
  double omega = 0.0;
  for (const double a : {x.x - kX0, kX1 - x.x})
    for (const double b : {x.y - kY0, kY1 - x.y})
      omega += std::atan(a * b / (x.z * std::sqrt(a * a + b * b + x.z * x.z)));
  return omega;
}

TEST(NearSunlight, with_the_volumes_light_is_the_solid_angle_of_the_patch) {
  for (const glm::dvec3& place : kPlaces) {
    SunnyFloor floor({place});
    const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
    const double tolerance = 0.02 * static_cast<double>(brightest(light));
    for (std::size_t v = 0; v < light.size(); ++v)
      for (int c = 0; c < 3; ++c) // L_00 = L omega Y_00
        EXPECT_NEAR(static_cast<double>(light[v][0][c]),
                    static_cast<double>(SunnyFloor::patch_radiance()[c]) * patch_solid_angle(floor.at()[v]) *
                        0.28209479,
                    tolerance)
            << place.y << ", vertex " << v;
  }
}

/// Irradiance by the nine coefficients, and what they miss of it.
double irradiance_at(const SunnyFloor& floor, std::size_t v, const Sh9Rgb& light, bool back = false) {
  const VertexTransfer& transfer = floor.objects.senders.transfer[v];
  float e = floor.near.missed(v, back).g;
  for (std::size_t i = 0; i < 9; ++i)
    e += light[i].g * (back ? transfer.back : transfer.front)[i];
  return static_cast<double>(e);
}

/// E = integral of L (n d)+ z / |y - x|^4 over a part of the patch, by squares of 5 mm.
double patch_irradiance(const Rectangle& lit, const glm::dvec3& x, const glm::dvec3& n) {
  constexpr double kStep = 0.005;
  double sum = 0;
  for (double a = double(lit.x0) + 0.5 * kStep; a < double(lit.x1); a += kStep)
    for (double b = double(lit.y0) + 0.5 * kStep; b < double(lit.y1); b += kStep) {
      const glm::dvec3 d = glm::dvec3(a, b, 0.0) - x;
      const double distance = glm::length(d);
      sum += std::max(0.0, glm::dot(n, d)) * kStep * kStep * x.z / std::pow(distance, 4.0);
    }
  return sum * static_cast<double>(SunnyFloor::patch_radiance().g);
}

/// A folded card, 1 m along x, 0.1 m high and wide: two sheets that touch at the top; fronts outside.
ObjectMesh tent() {
  ObjectMesh mesh;
  for (const float side : {-1.0f, 1.0f}) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const glm::vec3 normal = glm::normalize(glm::vec3(0.0f, side, 0.5f));
    for (std::uint32_t j = 0; j < 6; ++j)
      for (std::uint32_t i = 0; i < 21; ++i) {
        const float up = 0.2f * static_cast<float>(j);
        mesh.positions.emplace_back(-0.5f + 0.05f * static_cast<float>(i), 0.05f * side * (1.0f - up), 0.1f * up);
        mesh.normals.push_back(normal);
        mesh.reflectance.emplace_back(0.5f);
        if (i == 0 || j == 0)
          continue;
        const std::uint32_t v = first + 21 * j + i, w = v - 21;
        mesh.triangles.push_back(side > 0 ? std::array{v, w, v - 1} : std::array{v, v - 1, w});
        mesh.triangles.push_back(side > 0 ? std::array{w, w - 1, v - 1} : std::array{w, v - 1, w - 1});
      }
  }
  return mesh;
}

TEST(NearSunlight, the_inside_of_a_card_beside_the_patch_stays_dark) {
  const Rectangle lit_part{1.75f, 2.25f, 3.25f, 3.5f}; // all of it near the card
  SunnyFloor floor({kPlaces[0]}, {1.75f, 2.25f, 3.25f, 3.75f});
  floor.stand_at({{2.0, kY1 + 0.05, 0.0}}, SunnyFloor::model_of(tent()), 1, true);
  const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
  const double lit = test::kPi * static_cast<double>(SunnyFloor::patch_radiance().g);
  double brightest_foot = 0;
  for (std::size_t v = 0; v < light.size(); ++v) {
    const glm::dvec3& x = floor.at()[v];
    if (std::abs(x.x - 2.0) < 0.3) { // light comes in at the ends
      EXPECT_NEAR(irradiance_at(floor, v, light[v], true), 0.0, 0.035 * lit) << x.y - kY1 << ", height " << x.z;
    }
    if (x.z > 0.01)
      EXPECT_NEAR(irradiance_at(floor, v, light[v]),
                  patch_irradiance(lit_part, x, glm::dvec3(floor.objects.senders.surface.normals[v])), 0.02 * lit)
          << "outside, height " << x.z;
    else
      brightest_foot = std::max(brightest_foot, irradiance_at(floor, v, light[v]));
  }
  const double floor_share = 0.5 * (1.0 - 1.0 / std::sqrt(5.0)); // of what the outside sees, which leans by atan 1/2
  EXPECT_NEAR(brightest_foot, floor_share * lit, 0.03 * lit);
}

/// L_lm = integral of L V Y_lm(d) z / |y - x|^3 over the patch, by squares of 5 mm; V: not in the sphere's shadow.
Sh9Rgb patch_light(const glm::dvec3& x, const std::optional<glm::dvec3>& sphere) {
  constexpr double kStep = 0.005;
  Sh9Rgb sum{};
  for (double a = kX0 + 0.5 * kStep; a < kX1; a += kStep)
    for (double b = kY0 + 0.5 * kStep; b < kY1; b += kStep) {
      const glm::dvec3 y(a, b, 0.0);
      if (sphere && glm::length(glm::cross(*sphere - y, kTowardsSun)) < static_cast<double>(SunnyFloor::kRadius))
        continue;
      const double distance = glm::distance(x, y);
      const auto omega = static_cast<float>(kStep * kStep * x.z / (distance * distance * distance));
      const auto basis = sh::evaluate9(glm::vec3((y - x) / distance));
      for (std::size_t i = 0; i < 9; ++i)
        sum[i] += omega * basis[i] * SunnyFloor::patch_radiance();
    }
  return sum;
}

void expect_the_integral_over_the_patch(bool shadow) {
  for (const glm::dvec3& place : kPlaces) {
    SunnyFloor floor({place});
    const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction(1, shadow));
    const float most = brightest(light);
    for (std::size_t v = 0; v < light.size(); v += 23) {
      const Sh9Rgb exact = patch_light(floor.at()[v], shadow ? std::optional(place) : std::nullopt);
      for (std::size_t i = 0; i < 9; ++i)
        EXPECT_NEAR(light[v][i].g, exact[i].g, 0.035f * most) << place.y << ", vertex " << v << ", " << i;
    }
  }
}
TEST(NearSunlight, with_the_volumes_light_is_the_integral_over_the_patch) { expect_the_integral_over_the_patch(false); }
TEST(NearSunlight, with_the_volumes_light_is_the_integral_over_the_patch_without_the_objects_shadow) {
  expect_the_integral_over_the_patch(true);
}

TEST(NearSunlight, of_a_floor_that_is_lit_all_over_is_the_correction_of_each_point_alone) {
  for (const glm::dvec3& place : kPlaces) {
    SunnyFloor floor({place}, kLit);
    const std::vector<Sh9Rgb> fast = floor.correction();
    const float most = brightest(sum(floor.base(), fast));
    for (std::size_t v = 0; v < fast.size(); v += 23) {
      const Sh9Rgb slow = floor.correction_at(v);
      for (std::size_t i = 0; i < 9; ++i)
        EXPECT_NEAR(fast[v][i].g, slow[i].g, 0.02f * most) << place.y << ", vertex " << v << ", " << i;
    }
  }
}

TEST(NearSunlight, where_an_object_touches_the_patch_comes_from_all_of_the_half_space_below) {
  SunnyFloor floor({{2.0, 2.5, 0.1}});
  const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
  int touching = 0;
  for (std::size_t v = 0; v < light.size(); ++v) {
    if (floor.at()[v].z > 0.001)
      continue;
    ++touching;
    const auto radiance = static_cast<double>(SunnyFloor::patch_radiance().g);
    const double along_z = -std::sqrt(3.0 / (4.0 * test::kPi)) * test::kPi * radiance; // L_10
    EXPECT_NEAR(static_cast<double>(light[v][2].g), along_z, -0.08 * along_z);
    for (const std::size_t level : {1u, 3u})
      EXPECT_NEAR(static_cast<double>(light[v][level].g), 0.0, -0.08 * along_z);
  }
  EXPECT_GT(touching, 0);
}

TEST(NearSunlight, of_a_strip_6_cm_wide_half_a_metre_away_is_its_solid_angle) {
  SunnyFloor floor({{2.0, 4.5, 0.3}}, {1.0f, 3.0f, 4.5f, 5.0f});
  floor.sun->direction = glm::normalize(glm::dvec3(0.0, 0.05, 1.0)); // lights 4.895 < y < 4.955
  const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
  double error2 = 0, power2 = 0;
  for (std::size_t v = 0; v < light.size(); ++v) {
    const glm::dvec3& x = floor.at()[v];
    double omega = 0.0;
    for (const double a : {x.x - kX0, kX1 - x.x})
      for (const double b : {4.955 - x.y, x.y - 4.895})
        omega += std::atan(a * b / (x.z * std::sqrt(a * a + b * b + x.z * x.z)));
    const double cosine = floor.sun->direction.z / kTowardsSun.z, // patch_radiance() is that of kTowardsSun
        exact = static_cast<double>(SunnyFloor::patch_radiance().g) * cosine * omega * 0.28209479;
    error2 += std::pow(static_cast<double>(light[v][0].g) - exact, 2);
    power2 += exact * exact;
  }
  EXPECT_LT(std::sqrt(error2 / power2), 0.02); // 0.4 %
}

TEST(NearSunlight, is_proportional_to_the_sun_and_zero_without_one) {
  SunnyFloor floor;
  const std::vector<Sh9Rgb> light = floor.correction();
  floor.sun->normal_irradiance *= 4.0f;
  const std::vector<Sh9Rgb> more = floor.correction();
  floor.sun.reset();
  const std::vector<Sh9Rgb> none = floor.correction();
  ASSERT_EQ(none.size(), light.size());
  EXPECT_GT(std::abs(light[0][0].g), 0.01f);
  for (std::size_t v = 0; v < light.size(); ++v)
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_EQ(more[v][i], 4.0f * light[v][i]);
      EXPECT_EQ(none[v][i], Rgb(0.0f));
    }
}

TEST(NearSunlight, of_a_volume_that_does_not_name_its_elements_is_zero) {
  SunnyFloor floor;
  EXPECT_TRUE(floor.near.is_known());
  floor.volume.elements = {};
  NearSunlight unknown(floor.volume, floor.room.rays, floor.windows);
  EXPECT_FALSE(unknown.is_known());
  const std::vector<Sh9Rgb> light = unknown.correction(floor.objects, floor.probes, 1, floor.sun, nullptr);
  ASSERT_EQ(light.size(), floor.probes.size());
  EXPECT_TRUE(same_bits(light, std::vector<Sh9Rgb>(light.size())));
}

TEST(NearSunlight, is_zero_at_vertices_without_a_light_field) {
  SunnyFloor floor;
  const std::vector<Sh9Rgb> light = floor.correction();
  floor.probes[5].count = 0;
  const std::vector<Sh9Rgb> without = floor.correction(2);
  EXPECT_NE(light[5][0], Rgb(0.0f));
  EXPECT_EQ(without[5], Sh9Rgb{});
  EXPECT_NE(without[6][0], Rgb(0.0f));
}

TEST(NearSunlight, objects_in_their_shadow_receive_less_and_nowhere_less_than_nothing) {
  for (const glm::dvec3& place : {glm::dvec3(2.0, 2.5, 0.1), kPlaces[0], kPlaces[1]}) {
    SunnyFloor floor({place});
    const std::vector<Sh9Rgb> base = floor.base(), open = sum(base, floor.correction(1, false)),
                              shadowed = sum(base, floor.correction(2, true));
    const float all = brightest(open);
    float least = 1.0f;
    for (std::size_t v = 0; v < open.size(); ++v) {
      for (int c = 0; c < 3; ++c)
        EXPECT_GT(shadowed[v][0][c], -1e-4f * all) << place.z << ", vertex " << v;
      EXPECT_LT(shadowed[v][0].g, open[v][0].g + 0.01f * all) << place.z << ", vertex " << v;
      // The middle of the shadow lies 1 / 0.6 of the height behind.
      if (floor.at()[v].z < place.z && floor.at()[v].y < place.y)
        least = std::min(least, shadowed[v][0].g / open[v][0].g);
    }
    EXPECT_LT(least, 0.6f) << place.z;
  }
}

TEST(NearSunlight, each_of_two_objects_is_corrected_as_if_it_stood_alone) {
  SunnyFloor both({kPlaces[0], kPlaces[1]});
  const std::vector<Sh9Rgb> light = both.correction();
  const float most = brightest(sum(both.base(), light));
  std::size_t compared = 0;
  for (const glm::dvec3& place : {kPlaces[0], kPlaces[1]}) {
    SunnyFloor one({place});
    const std::vector<Sh9Rgb> alone = one.correction();
    for (std::size_t v = 0; v < alone.size(); ++v)
      for (std::size_t w = 0; w < light.size(); ++w)
        if (one.at()[v] == both.at()[w]) {
          EXPECT_NEAR(alone[v][0].g, light[w][0].g, 0.02f * most);
          ++compared;
          break;
        }
  }
  EXPECT_GT(compared, both.at().size() / 3);
}

TEST(NearSunlight, is_found_anew_for_another_placement_or_sun_and_else_has_the_same_bits) {
  SunnyFloor floor;
  const std::vector<Sh9Rgb> first = floor.correction(1, true);
  EXPECT_TRUE(same_bits(floor.correction(1, true), first));
  floor.stand_at({kPlaces[1]});
  const std::vector<Sh9Rgb> moved = floor.correction(2, true);
  EXPECT_FALSE(same_bits(moved, first));
  SunnyFloor fresh({kPlaces[1]});
  EXPECT_TRUE(same_bits(moved, fresh.correction(1, true)));
  floor.sun->direction = fresh.sun->direction = glm::normalize(glm::dvec3(0.2, 1.0, 0.6));
  const std::vector<Sh9Rgb> turned = floor.correction(2, true);
  EXPECT_FALSE(same_bits(turned, moved));
  EXPECT_TRUE(same_bits(turned, fresh.correction(2, true)));
}

} // namespace
} // namespace daylit
