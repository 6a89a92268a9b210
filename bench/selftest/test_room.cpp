#include "bench/selftest/test_room.h"

#include <array>

namespace daylit::bench {

Room box_room(const glm::dvec3& size, unsigned faces) {
  Room room;
  for (const char* name : {"floor", "ceiling", "south", "north", "west", "east", "furniture"})
    room.materials.push_back({.name = name, .reflectance = Rgb(0.0f)});
  for (std::uint32_t f = 0; f < 6; ++f)
    add_box(room, glm::dvec3(0.0), size, faces & 1u << f, true, f);
  return room;
}

void add_furniture(Room& room, const glm::dvec3& low, const glm::dvec3& high) {
  add_box(room, low, high, 0b111111u, true, kFurniture);
}

void add_face_with_hole(Room& room, int axis, const glm::dvec3& lo, const glm::dvec3& hi, const glm::dvec3& hole_lo,
                        const glm::dvec3& hole_hi, std::uint32_t material) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const std::array<double, 4> a = {lo[u], hole_lo[u], hole_hi[u], hi[u]}, b = {lo[v], hole_lo[v], hole_hi[v], hi[v]};
  const auto at = [&](double x, double y) {
    glm::dvec3 p = lo;
    p[u] = x;
    p[v] = y;
    return p;
  };
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if ((i != 1 || j != 1) && a[i] < a[i + 1] && b[j] < b[j + 1])
        add_quad(room, at(a[i], b[j]), at(a[i + 1], b[j]), at(a[i + 1], b[j + 1]), at(a[i], b[j + 1]), material);
}

Result<SolvedRoom> SolvedRoom::make(const Room& room, const std::vector<Aperture>& seeds,
                                    const SelftestQuality& quality, const Progress& progress) {
  SolvedRoom s;
  auto mesh = radiosity::mesh_surfaces(room, {.target_facets = quality.facets});
  if (!mesh)
    return mesh.error();
  s.mesh = std::move(*mesh);
  auto rays = radiosity::facet_scene(s.mesh);
  const auto occluders = RayScene::build(room);
  if (!rays || !occluders)
    return rays ? occluders.error() : rays.error();
  s.rays = *rays;
  s.set = radiosity::find_patches(room, s.mesh, s.rays, seeds);
  auto exchange = radiosity::exchange_areas(s.set, s.mesh, room, *occluders,
                                            {.visibility_rays = quality.visibility_rays}, progress);
  if (!exchange)
    return exchange.error();
  s.exchange = std::move(*exchange);
  return s;
}

Result<SolvedRoom> SolvedRoom::closed(const Room& room, const glm::dvec3& inside, const SelftestQuality& quality,
                                      const Progress& progress) {
  const Aperture point{.corners = {inside, inside + glm::dvec3(1e-3, 0, 0), inside + glm::dvec3(0, 1e-3, 0)},
                       .inward = {0, 0, 1}};
  return make(room, {point}, quality, progress);
}

void SolvedRoom::set_reflectance(std::uint32_t of, float reflectance) {
  for (std::size_t i = 0; i < set.patches.size(); ++i)
    if (material(i) == of)
      set.patches[i].reflectance = Rgb(reflectance);
}

void SolvedRoom::set_reflectance(float reflectance) {
  for (radiosity::Patch& e : set.patches)
    e.reflectance = Rgb(reflectance);
}

std::vector<Rgb> SolvedRoom::per_material(std::uint32_t of, float value) const {
  std::vector<Rgb> list(set.patches.size(), Rgb(0.0f));
  for (std::size_t i = 0; i < list.size(); ++i)
    if (material(i) == of)
      list[i] = Rgb(value);
  return list;
}

double SolvedRoom::exchange_area_m2(std::uint32_t from, std::uint32_t to) const {
  std::vector<float> emitting(set.patches.size());
  for (std::size_t j = 0; j < emitting.size(); ++j)
    emitting[j] = material(j) == to ? 1.0f : 0.0f;
  const std::vector<float> received = exchange_product(exchange, emitting, 1);
  double sum = 0;
  for (std::size_t i = 0; i < received.size(); ++i)
    sum += material(i) == from ? static_cast<double>(received[i]) : 0.0;
  return sum;
}

double SolvedRoom::area_m2() const {
  double sum = 0;
  for (const radiosity::Patch& e : set.patches)
    sum += e.area_m2;
  return sum;
}

Result<radiosity::Radiosity> SolvedRoom::solve(const std::vector<Rgb>& exitance, const Progress& progress) const {
  const auto light = emitted_light(set, exchange, exitance);
  if (!light)
    return light.error();
  auto b = radiosity::solve_radiosity(set, exchange, *light, {}, progress);
  if (b)
    add_exitance(exitance, *b);
  return b;
}

Result<std::vector<double>> SolvedRoom::irradiance(std::vector<SurfacePoint> points, const radiosity::Radiosity& light,
                                                   const Progress& progress) const {
  for (SurfacePoint& p : points)
    p.position -= mesh.origin;
  const auto e = surface_irradiance(points, set, rays, light, {}, progress);
  if (!e)
    return e.error();
  std::vector<double> green(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    green[i] = static_cast<double>((*e)[i * light.columns + light.columns / 3]);
  return green;
}

} // namespace daylit::bench
