#include "scene/volume/first_reflection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/volume/interpolated_probes.h"
#include "sh/band4.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

using Triangle = FirstReflection::Triangle;
using Element = FirstReflection::Element;

constexpr double kFine = 0.5;  ///< longest edge of a piece, of its distance
constexpr int kMostCuts = 9;   ///< of an edge: a point may lie on the surface
constexpr double kReach = 2.0; ///< of the distance of the probes: light from further away is linear between them
constexpr double kSizes = 6.0; ///< of the radius of an element: from further away its mean light is enough

double longest_edge(const Triangle& t) {
  return std::max({glm::distance(t[0], t[1]), glm::distance(t[1], t[2]), glm::distance(t[2], t[0])});
}

void add(ShRadiance& sum, const Rgb& radiance_sr, const glm::dvec3& direction) {
  const glm::vec3 d(direction);
  const auto nine = sh::evaluate9(d), band4 = sh::evaluate_band4(d);
  for (std::size_t k = 0; k < 9; ++k) {
    sum.nine[k] += nine[k] * radiance_sr;
    sum.band4[k] += band4[k] * radiance_sr;
  }
}

void add(ShRadiance& sum, float weight, const ShRadiance& light) {
  for (std::size_t k = 0; k < 9; ++k) {
    sum.nine[k] += weight * light.nine[k];
    sum.band4[k] += weight * light.band4[k];
  }
}

/// L_lm = integral over the triangle of L(y) V(x, y) Y_lm(d) cos / |y - x|^2 dA, d from x to y: cut in four until the
/// pieces are small beside their distance, then by their middles.
template <class Sees>
void integrate(const Triangle& t, const glm::dvec3& normal, const glm::dvec3& x, int cuts,
               const std::function<Rgb(const Triangle&)>& radiance, const Sees& sees, ShRadiance& sum) {
  const glm::dvec3 middle = (t[0] + t[1] + t[2]) / 3.0, way = middle - x;
  const double distance = glm::length(way);
  if (cuts > 0 && longest_edge(t) > kFine * distance) {
    const glm::dvec3 a = 0.5 * (t[0] + t[1]), b = 0.5 * (t[1] + t[2]), c = 0.5 * (t[2] + t[0]);
    for (const Triangle& part : {Triangle{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}})
      integrate(part, normal, x, cuts - 1, radiance, sees, sum);
    return;
  }
  const double cosine = -glm::dot(way, normal) / distance;
  if (!(cosine > 0.0))
    return;
  const Rgb l = radiance(t);
  if (l == Rgb(0.0f) || !sees(way))
    return;
  const double area = 0.5 * glm::length(glm::cross(t[1] - t[0], t[2] - t[0]));
  add(sum, static_cast<float>(area * cosine / (distance * distance)) * l, way / distance);
}

Element element_of(const std::array<glm::vec3, 3>& corner, const glm::dvec3& origin, const Rgb& reflectance) {
  Element e;
  e.reflectance = reflectance;
  for (std::size_t k = 0; k < 3; ++k) {
    e.corner[k] = origin + glm::dvec3(corner[k]);
    e.middle += e.corner[k] / 3.0;
  }
  const glm::dvec3 across = glm::cross(e.corner[1] - e.corner[0], e.corner[2] - e.corner[0]);
  if (!(glm::length(across) > 0.0))
    return e;
  e.normal = glm::normalize(across);
  for (const glm::dvec3& c : e.corner)
    e.radius_m = std::max(e.radius_m, glm::distance(c, e.middle));
  return e;
}

} // namespace

Result<RayScene> rays_of_light(const BasisVolume& volume) {
  const ReflectingSurfaces& simplified = volume.simplified;
  return simplified.triangles.empty() ? RayScene::build(volume.room)
                                      : RayScene::build(simplified.vertices, simplified.triangles);
}

std::optional<FirstReflection> FirstReflection::make(const BasisVolume& volume, const RayScene& scene) {
  const auto interpolated = interpolated_probes(volume.probes);
  if (!volume.compact || volume.elements.corner.empty() || !interpolated)
    return std::nullopt;
  FirstReflection made(scene);
  made.basis_ = volume.compact;
  for (std::size_t s = 0; s < volume.elements.corner.size(); ++s)
    made.element_.push_back(
        element_of(volume.elements.corner[s], volume.probes.origin, volume.elements.reflectance[s]));
  for (std::uint32_t p = 0; p < volume.probes.size(); ++p) {
    made.probe_.push_back(volume.probes.origin + glm::dvec3(volume.probes.positions[p]));
    made.of_.push_back({p, p});
  }
  made.weight_b_.assign(made.probe_.size(), 0.0f);
  for (const InterpolatedProbe& i : *interpolated) {
    made.of_[i.probe] = {i.a, i.b};
    made.weight_b_[i.probe] = i.weight_b;
  }
  return made;
}

/// L = reflectance E / pi
std::vector<Rgb> FirstReflection::radiance(std::span<const Rgb> node_radiance) const {
  std::vector<Rgb> light = irradiance_of_sources(basis_->light, node_radiance);
  for (std::size_t s = 0; s < light.size(); ++s)
    light[s] *= basis_->light_unit[s] * element_[s].reflectance / std::numbers::pi_v<float>;
  return light;
}

std::vector<FirstReflection::Near> FirstReflection::near(const glm::dvec3& x, double reach_m,
                                                         std::span<const Rgb> stored) const {
  std::vector<Near> list;
  for (std::uint32_t s = 0; s < element_.size(); ++s) {
    const Element& e = element_[s];
    const double reach = std::max(reach_m, kSizes * e.radius_m) + e.radius_m;
    const double distance2 = glm::dot(e.middle - x, e.middle - x);
    if (e.radius_m > 0.0 && stored[s] != Rgb(0.0f) && distance2 < reach * reach)
      list.push_back({s, static_cast<float>(1.0 - glm::smoothstep(0.5, 1.0, std::sqrt(distance2) / reach))});
  }
  return list;
}

ShRadiance FirstReflection::gather(const glm::dvec3& x, std::span<const Near> list, const RadianceOf& radiance) const {
  ShRadiance sum;
  const glm::vec3 from = scene_->to_local(x);
  const auto sees = [&](const glm::dvec3& way) {
    const float off = 4.0f * scene_->surface_offset() / static_cast<float>(glm::length(way));
    return !scene_->occluded(from, glm::vec3(way), off, 1.0f - std::max(off, 1e-4f));
  };
  for (const Near& n : list) {
    const auto weighted = [&](const Triangle& piece) { return n.weight * radiance(n.element, piece); };
    if (const Element& e = element_[n.element]; glm::dot(x - e.middle, e.normal) > 0.0)
      integrate(e.corner, e.normal, x, kMostCuts, weighted, sees, sum);
  }
  return sum;
}

/// Interpolated probes have the light of those that they lie between.
void FirstReflection::add_probe(std::uint32_t probe, float weight, std::span<const Near> list,
                                const RadianceOf& radiance, ShRadiance& sum) const {
  if (of_[probe][0] == probe) {
    add(sum, weight, gather(probe_[probe], list, radiance));
    return;
  }
  add_probe(of_[probe][0], weight * (1.0f - weight_b_[probe]), list, radiance, sum);
  add_probe(of_[probe][1], weight * weight_b_[probe], list, radiance, sum);
}

ShRadiance FirstReflection::at_probe(std::uint32_t probe, std::span<const Near> list,
                                     std::span<const Rgb> stored) const {
  ShRadiance sum;
  add_probe(
      probe, 1.0f, list, [&](std::size_t s, const Triangle&) { return stored[s]; }, sum);
  return sum;
}

double FirstReflection::reach(const glm::dvec3& x, std::span<const std::uint32_t> probe) const {
  double farthest = 0.0;
  for (const std::uint32_t p : probe)
    farthest = std::max(farthest, glm::distance(probe_[p], x));
  return kReach * farthest;
}

/// N(x) - sum over probes of w_p N_stored(p), N: light of the near elements.
ShRadiance FirstReflection::correction(const glm::dvec3& x, std::span<const std::uint32_t> probe,
                                       std::span<const float> weight, std::span<const Rgb> stored,
                                       const RadianceOf& actual) const {
  const std::vector<Near> list = near(x, reach(x, probe), stored);
  if (list.empty())
    return {};
  ShRadiance sum = gather(x, list, actual);
  for (std::size_t k = 0; k < probe.size(); ++k)
    add_probe(
        probe[k], -weight[k], list, [&](std::size_t s, const Triangle&) { return stored[s]; }, sum);
  return sum;
}

FirstReflection::Exchange FirstReflection::exchange(const glm::dvec3& x, std::span<const std::uint32_t> probe,
                                                    std::span<const float> weight, std::span<const Rgb> lit) const {
  const auto one = [](std::size_t, const Triangle&) { return Rgb(1.0f); };
  const auto keep = [](std::uint32_t element, const ShRadiance& light, std::vector<Exchange::ToPoint>& list) {
    Exchange::ToPoint kept{element, {}, {}};
    for (std::size_t k = 0; k < 9; ++k) {
      kept.nine[k] = light.nine[k].r;
      kept.band4[k] = light.band4[k].r;
    }
    if (kept.nine[0] != 0.0f)
      list.push_back(kept);
  };
  Exchange made;
  for (const Near& n : near(x, reach(x, probe), lit)) {
    keep(n.element, gather(x, {&n, 1}, one), made.here);
    ShRadiance between;
    for (std::size_t k = 0; k < probe.size(); ++k)
      add_probe(probe[k], weight[k], {&n, 1}, one, between);
    keep(n.element, between, made.probes);
  }
  return made;
}

ShRadiance FirstReflection::correction(const Exchange& exchange, std::span<const Rgb> stored,
                                       std::span<const Rgb> actual) {
  ShRadiance sum;
  const auto add_all = [&](const std::vector<Exchange::ToPoint>& list, std::span<const Rgb> radiance, float sign) {
    for (const Exchange::ToPoint& e : list)
      for (std::size_t k = 0; k < 9; ++k) {
        sum.nine[k] += sign * e.nine[k] * radiance[e.element];
        sum.band4[k] += sign * e.band4[k] * radiance[e.element];
      }
  };
  add_all(exchange.here, actual, 1.0f);
  add_all(exchange.probes, stored, -1.0f);
  return sum;
}

std::optional<ShRadiance> FirstReflection::corrected(const LightFieldSampler& sampler, const LightField& field,
                                                     const glm::dvec3& x, std::span<const Rgb> stored,
                                                     const RadianceOf& actual) const {
  std::optional<ShRadiance> light = sampler.sample_all(field, x);
  if (!light)
    return light;
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  const auto used = static_cast<std::size_t>(sampler.weights(x, probe, weight));
  ShRadiance more = correction(x, std::span(probe).first(used), std::span(weight).first(used), stored, actual);
  if (field.band4.empty())
    more.band4 = {};
  *light += more;
  return light;
}

} // namespace daylit
