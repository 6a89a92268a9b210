#include "runtime/indirect/vertex_light.h"

#include "scene/core/parallel.h"

namespace daylit {

namespace {

/// `change`: nine coefficients at a vertex of a part, which is at a point.
template <class Change>
void add_change(const VirtualObjects& objects, const Change& change, std::span<TwoSided> radiance) {
  const ObjectSurface& surface = objects.surface;
  for (std::size_t k = 0; k < objects.parts.size(); ++k) {
    const std::size_t first = objects.parts[k].first_vertex, count = objects.parts[k].mesh.positions.size();
    parallel_for(tbb::blocked_range<std::size_t>(first, first + count, 256), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const Sh9Rgb arriving = change(k, i - first, surface.positions[i]);
        const Rgb& rho = surface.reflectance[i];
        radiance[i].front = add_reflected(radiance[i].front, arriving, objects.transfer[i].front, rho);
        if (objects.has_back[i])
          radiance[i].back = add_reflected(radiance[i].back, arriving, objects.transfer[i].back, rho);
      }
    });
  }
}

} // namespace

/// L += rho / pi sum_lm dL_lm C_lm at each vertex.
void add_feedback(const IndirectShadow& field, const VirtualObjects& objects, std::span<TwoSided> radiance) {
  add_change(
      objects, [&](std::size_t part, std::size_t vertex, const glm::dvec3&) { return field.feedback(part, vertex); },
      radiance);
}

void add_exchange(const IndirectShadow& field, const VirtualObjects& objects, std::span<TwoSided> radiance) {
  add_change(
      objects, [&](std::size_t part, std::size_t, const glm::dvec3& x) { return field.exchanged(part, x); }, radiance);
}

/// All points that need the window integral are gathered first, and integrated together.
std::vector<VertexLight> light_vertices(const ObjectSurface& surface, std::span<const std::uint8_t> has_back,
                                        std::span<const std::uint8_t> in_view, std::span<const TwoSided> indirect,
                                        std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                                        std::size_t& lit) {
  const std::size_t count = surface.positions.size();
  std::vector<glm::dvec3> points;
  std::vector<glm::vec3> normals;
  std::vector<Rgb VertexLight::*> sides;
  std::vector<std::size_t> vertices;
  const auto add = [&](std::size_t i, const glm::vec3& n, Rgb VertexLight::*side) {
    points.push_back(surface.positions[i]);
    normals.push_back(n);
    sides.push_back(side);
    vertices.push_back(i);
  };
  std::vector<VertexLight> light(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Rgb per_reflectance = surface.drawn_reflectance[i] / glm::max(surface.reflectance[i], Rgb(1e-30f));
    light[i].indirect_front = per_reflectance * indirect[i].front;
    light[i].indirect_back = per_reflectance * indirect[i].back;
    if (!in_view[i])
      continue;
    ++lit;
    add(i, surface.normals[i], &VertexLight::open_sky_front);
    if (has_back[i])
      add(i, -surface.normals[i], &VertexLight::open_sky_back);
  }
  const std::vector<Rgb> open = open_sky_irradiance(pyramid, cells, points, normals);
  for (std::size_t k = 0; k < open.size(); ++k)
    light[vertices[k]].*sides[k] = open[k];
  return light;
}

} // namespace daylit
