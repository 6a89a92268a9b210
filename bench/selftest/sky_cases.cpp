#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "bench/selftest/reference.h"
#include "bench/selftest/test_room.h"
#include "radiosity/energy.h"
#include "scene/room/glass.h"
#include "scene/sky/direct_sky.h"
#include "scene/sky/sky_partition.h"

namespace daylit::bench {

namespace {

using List = std::vector<Comparison>;
constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;
constexpr double kGroundAlbedo = 0.2;

double uniform_radiance(const glm::dvec3& w) { return w.z < 0 ? 0.0 : 1.0; }

struct NamedSky {
  std::string name;
  RadianceOf radiance;
  double horizontal; ///< irradiance of the open ground
};

/// The skies of 5.9: of zenith radiance 1; the sun of type 12 stands 40 degrees from the zenith along x.
std::vector<NamedSky> standard_skies() {
  const auto general = [](const std::array<double, 5>& p, const glm::dvec3& sun) -> RadianceOf {
    return [sky = GeneralSky{p[0], p[1], p[2], p[3], p[4], sun}](const glm::dvec3& w) { return sky.radiance(w); };
  };
  std::vector<NamedSky> skies = {
      {"uniform", uniform_radiance, kPi},
      {"overcast", overcast_radiance, 7 * kPi / 9},
      {"CIE type 1", general(kCieType1, {0, 0, 1}), 0},
      {"CIE type 12", general(kCieType12, {std::sin(40 * kDegree), 0, std::cos(40 * kDegree)}), 0}};
  for (NamedSky& sky : skies)
    if (sky.horizontal == 0)
      sky.horizontal = horizontal_irradiance(sky.radiance);
  return skies;
}

Result<SkyImage> sky_image(int rows, const RadianceOf& radiance) {
  RgbImage image(2 * rows, rows);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < 2 * rows; ++x) {
      const double theta = kPi * (y + 0.5) / rows, phi = 2 * kPi * (0.5 - (x + 0.5) / (2 * rows));
      const glm::dvec3 w(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      image.at(x, y) = Rgb(static_cast<float>(radiance(w)));
    }
  return SkyImage::make(std::move(image), EquirectProjection{});
}

struct DaylitRoom {
  Room room;
  RayScene rays;
  std::vector<Aperture> apertures;

  static Result<DaylitRoom> make(Room model) {
    DaylitRoom r{std::move(model), {}, {}};
    const auto rays = RayScene::build(r.room);
    if (!rays)
      return rays.error();
    r.rays = *rays;
    auto found = find_apertures(r.room, r.rays);
    if (!found)
      return found.error();
    r.apertures = std::move(found->list);
    return r;
  }
};

struct Receiver {
  std::string what;
  glm::dvec3 position, normal;
};

/// The opening as corner and sides, and what a ray through it keeps.
struct Opening {
  glm::dvec3 corner, side_a, side_b;
  bool glazed = false;
  double keeps(const glm::dvec3& w) const {
    const double cosine = std::abs(glm::dot(w, glm::normalize(glm::cross(side_a, side_b))));
    return glazed ? slab_transmittance_series(std::acos(std::min(cosine, 1.0)), kClearGlassIndex) : 1.0;
  }
};

/// Direct irradiance at every receiver in per cent of the horizontal irradiance outside, against quadrature.
Result<List> compare_daylight(const DaylitRoom& room, const Opening& opening, const NamedSky& sky,
                              const std::vector<Receiver>& receivers, const SelftestQuality& q) {
  const auto image = sky_image(q.sky_rows_px, sky.radiance);
  if (!image)
    return image.error();
  const Sky outside(*image);
  const DirectSky direct(room.room, room.apertures, room.rays, outside);
  const RadianceOf through = [&](const glm::dvec3& w) { return sky.radiance(w) * opening.keeps(w); };
  List list;
  for (const Receiver& r : receivers) {
    const double reference =
        rectangle_irradiance(r.position, r.normal, opening.corner, opening.side_a, opening.side_b, through);
    list.push_back({sky.name + ", " + r.what, 100 * reference / sky.horizontal,
                    100 * static_cast<double>(direct.irradiance(r.position, r.normal).g) / sky.horizontal});
  }
  return list;
}

void glaze(Room& room, const Opening& o) {
  room.materials.push_back({.name = "window", .reflectance = Rgb(0.0f), .is_window = true, .refractive_index = 1.52f});
  const auto material = static_cast<std::uint32_t>(room.materials.size() - 1);
  add_quad(room, o.corner, o.corner + o.side_a, o.corner + o.side_a + o.side_b, o.corner + o.side_b, material);
}

/// 4 x 4 x 3 m with a square hole, `side` wide, in the middle of the roof.
Result<DaylitRoom> roof_room(double side, Opening& opening) {
  const double low = 2 - side / 2, high = 2 + side / 2;
  opening.corner = {low, low, 3};
  opening.side_a = {side, 0, 0};
  opening.side_b = {0, side, 0};
  Room model = box_room({4, 4, 3}, 0b111101u);
  add_face_with_hole(model, 2, {0, 0, 3}, {4, 4, 3}, {low, low, 3}, {high, high, 3}, kCeiling);
  if (opening.glazed)
    glaze(model, opening);
  return DaylitRoom::make(std::move(model));
}

Result<List> roof(const SelftestQuality& q, bool glazed) {
  List all;
  for (const double side : {1.0, 4.0}) {
    Opening opening{.corner = {}, .side_a = {}, .side_b = {}, .glazed = glazed};
    const auto room = roof_room(side, opening);
    if (!room)
      return room.error();
    const std::string size = fmt::format("{:g} m opening, floor ", side);
    for (const NamedSky& sky : standard_skies()) {
      const auto list = compare_daylight(
          *room, opening, sky,
          {{size + "centre, %", {2, 2, 0}, {0, 0, 1}}, {size + "(0.5, 2), %", {0.5, 2, 0}, {0, 0, 1}}}, q);
      if (!list)
        return list;
      all.insert(all.end(), list->begin(), list->end());
    }
  }
  return all;
}

/// 5.9: sky component under a roof opening.
Result<List> roof_opening(const SelftestQuality& q, const Progress&) { return roof(q, false); }
/// 5.10: the same with clear glass, tau(theta) in the integrand.
Result<List> roof_glass(const SelftestQuality& q, const Progress&) { return roof(q, true); }

/// 4 x 5 x 3 m, window 2 x 1 m with its sill at 1 m in the south wall.
Result<DaylitRoom> facade_room(Opening& opening) {
  opening.corner = {1, 0, 1};
  opening.side_a = {2, 0, 0};
  opening.side_b = {0, 0, 1};
  Room model = box_room({4, 5, 3}, 0b111011u);
  add_face_with_hole(model, 1, {0, 0, 0}, {4, 0, 3}, {1, 0, 1}, {3, 0, 2}, kSouth);
  if (opening.glazed)
    glaze(model, opening);
  return DaylitRoom::make(std::move(model));
}

/// Sky above, ground of albedo 0.2 below: L_g = 0.2 E_h / pi.
NamedSky above_ground(NamedSky sky) {
  const double ground = kGroundAlbedo * sky.horizontal / kPi;
  sky.radiance = [above = sky.radiance, ground](const glm::dvec3& w) { return w.z < 0 ? ground : above(w); };
  return sky;
}

Result<List> facade(const SelftestQuality& q, bool glazed) {
  Opening opening{.corner = {}, .side_a = {}, .side_b = {}, .glazed = glazed};
  const auto room = facade_room(opening);
  if (!room)
    return room.error();
  std::vector<Receiver> receivers;
  for (const double d : {1.0, 2.0, 3.0})
    receivers.push_back({fmt::format("floor, {:g} m from the window, %", d), {2, d, 0}, {0, 0, 1}});
  receivers.push_back({"ceiling, 1 m (ground only), %", {2, 1, 3}, {0, 0, -1}});
  receivers.push_back({"back wall, sky and ground, %", {1, 5, 1.5}, {0, -1, 0}});
  List all;
  for (const NamedSky& sky : standard_skies()) {
    const auto list = compare_daylight(*room, opening, above_ground(sky), receivers, q);
    if (!list)
      return list;
    all.insert(all.end(), list->begin(), list->end());
  }
  // Where a formula exists it takes the place of the quadrature.
  for (std::size_t k = 0; k < 3 && !glazed; ++k) {
    const double d = 1.0 + static_cast<double>(k);
    all[k].reference = 100 * perpendicular_factor({1, 2}, {-1, 1}, d);
    all[receivers.size() + k].reference = 200 * (overcast_sky_component(1, 2, d) - overcast_sky_component(1, 1, d));
  }
  if (!glazed)
    all[3].reference = 100 * kGroundAlbedo * perpendicular_factor({1, 2}, {-1, 1}, 1);
  return all;
}

/// 5.11: sky and externally reflected components through an unglazed facade opening.
Result<List> facade_opening(const SelftestQuality& q, const Progress&) { return facade(q, false); }
/// 5.12: with clear glass.
Result<List> facade_glass(const SelftestQuality& q, const Progress&) { return facade(q, true); }

/// 5.5: an upright pane, rays at angles of incidence.
Result<List> glass(const SelftestQuality&, const Progress&) {
  const Aperture pane{.corners = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}},
                      .inward = {0, 1, 0},
                      .refractive_index = static_cast<float>(kClearGlassIndex)};
  List list;
  for (const double degrees : {0.0, 30.0, 45.0, 60.0, 75.0, 85.0}) {
    const double angle = degrees * kDegree;
    const glm::dvec3 w(std::sin(angle), -std::cos(angle), 0);
    const Rgb tau = aperture_transmittance({pane}, glm::dvec3(0.5, 0, 0.5) - 2.0 * w, w, 10.0);
    list.push_back({fmt::format("transmittance at {:g} degrees", degrees),
                    slab_transmittance_series(angle, kClearGlassIndex), static_cast<double>(tau.g)});
  }
  return list;
}

/// Light that the surfaces receive from outside, per region, and what becomes of it.
struct Flux {
  double arriving = 0, absorbed_and_leaving = 0;
};

Result<Flux> entering_flux(const DaylitRoom& daylit, const RadianceOf& sky, float reflectance, const SelftestQuality& q,
                           const Progress& progress) {
  const auto room = SolvedRoom::make(daylit.room, daylit.apertures, q, progress);
  const auto partition = SkyPartition::uniform(q.sky_regions);
  const auto image = sky_image(q.sky_rows_px, sky);
  if (!room || !partition || !image)
    return !room ? room.error() : !partition ? partition.error() : image.error();
  auto light = radiosity::first_bounce(room->set, room->mesh, room->rays, daylit.apertures, *partition, progress);
  if (!light)
    return light.error();
  // One column for this sky.
  const std::vector<Rgb> region = region_radiance(*image, *partition);
  radiosity::FirstBounce one;
  one.patches = light->patches;
  one.region = {0};
  one.opening = light->opening;
  Flux flux;
  for (std::size_t i = 0; i < one.patches; ++i) {
    double e = 0;
    for (std::size_t k = 0; k < light->columns(); ++k)
      e += static_cast<double>(light->row(i, 1)[k] * region[light->region[k]].g);
    one.irradiance.insert(one.irradiance.end(), 3, static_cast<float>(e));
    flux.arriving += e * room->set.patches[i].area_m2;
  }
  radiosity::PatchSet set = room->set;
  for (radiosity::Patch& e : set.patches)
    e.reflectance = Rgb(reflectance);
  const auto b = radiosity::solve_radiosity(set, room->exchange, one, {}, progress);
  if (!b)
    return b.error();
  const radiosity::EnergyBalance balance = radiosity::audit_energy(set, room->exchange, one, *b);
  flux.absorbed_and_leaving = (balance.absorbed + balance.leaving) / 3; // of three channels
  return flux;
}

/// Share of a uniform sky's light that an upright or level pane lets through: 2 integral tau sin cos.
double diffuse_transmittance() {
  const GaussRule& rule = gauss_rule();
  double sum = 0;
  for (std::size_t i = 0; i < rule.node.size(); ++i) {
    const double angle = 0.5 * kPi * rule.node[i];
    sum += rule.weight[i] * 0.5 * kPi * std::sin(2 * angle) * slab_transmittance_series(angle, kClearGlassIndex);
  }
  return sum;
}

/// 5.4: what enters is what the surfaces take up or send out again. E_h = 7 pi / 9 under the overcast sky, on the
/// vertical pi/3 (1/2 + 4/(3 pi)).
Result<List> flux_conservation(const SelftestQuality& q, const Progress& progress) {
  const RadianceOf everywhere = [](const glm::dvec3&) { return 1.0; };
  Opening hole{.corner = {}, .side_a = {}, .side_b = {}},
      pane{.corner = {}, .side_a = {}, .side_b = {}, .glazed = true};
  const auto top = roof_room(1.0, hole), window = facade_room(hole), glazed = facade_room(pane);
  if (!top || !window || !glazed)
    return !top ? top.error() : !window ? window.error() : glazed.error();
  const double top_flux = 7 * kPi / 9, window_flux = 2 * kPi / 3 * (0.5 + 4 / (3 * kPi));
  List list = {{"roof opening, overcast: flux on the surfaces", top_flux},
               {"roof opening, overcast: absorbed and sent out, reflectance 0.7", top_flux},
               {"facade opening, overcast: flux on the surfaces", window_flux},
               {"facade opening, overcast: absorbed and sent out, reflectance 0.7", window_flux},
               {"clear pane, uniform sphere: flux on the surfaces", 2 * kPi * diffuse_transmittance()}};
  const std::array<const DaylitRoom*, 3> rooms = {&*top, &*window, &*glazed};
  for (std::size_t k = 0; k < rooms.size(); ++k) {
    const auto flux = entering_flux(*rooms[k], k < 2 ? RadianceOf(overcast_radiance) : everywhere, 0.7f, q, progress);
    if (!flux)
      return flux.error();
    list[2 * k].result = flux->arriving;
    if (k < 2)
      list[2 * k + 1].result = flux->absorbed_and_leaving;
  }
  return list;
}

constexpr std::array<ClosedFormCase, 6> kCases = {{
    {"CIE 171 5.4", "flux through an opening is conserved", flux_conservation},
    {"CIE 171 5.5", "transmittance of clear glass", glass},
    {"CIE 171 5.9", "roof opening", roof_opening},
    {"CIE 171 5.10", "roof opening with clear glass", roof_glass},
    {"CIE 171 5.11", "facade opening, sky and ground", facade_opening},
    {"CIE 171 5.12", "facade opening with clear glass", facade_glass},
}};

} // namespace

std::span<const ClosedFormCase> sky_cases() { return kCases; }

} // namespace daylit::bench
