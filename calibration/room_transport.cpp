#include "calibration/room_transport.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

#include "radiosity/form_factors.h"
#include "scene/core/parallel.h"

namespace daylit::calibration {

namespace {

constexpr int kFacets = 2000;
constexpr double kVisibilityRays = 32768; ///< as CalibrationBake: more changes the light by less than a thousandth
constexpr int kPointsOnPatch = 8;
constexpr double kOffSurface_m = 1e-4;
constexpr double kGolden = 0.6180339887498949;

/// Van der Corput's radical inverse, base 2.
double radical_inverse(std::uint32_t i) {
  double value = 0.0, digit = 0.5;
  for (; i != 0; i >>= 1, digit *= 0.5)
    value += digit * (i & 1u);
  return value;
}

double fraction(double x) { return x - std::floor(x); }

/// Point k of `count` on a triangle, evenly: Hammersley's points folded into barycentric weights.
glm::dvec3 point_on(const std::array<glm::dvec3, 3>& corner, int k, int count) {
  double u = (k + 0.5) / count, v = radical_inverse(static_cast<std::uint32_t>(k));
  if (u + v > 1.0)
    u = 1.0 - u, v = 1.0 - v;
  return corner[0] + u * (corner[1] - corner[0]) + v * (corner[2] - corner[0]);
}

/// Two unit vectors that make a right-handed frame with a unit normal.
void frame_of(const glm::dvec3& n, glm::dvec3& t, glm::dvec3& b) {
  t = glm::normalize(glm::cross(std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0), n));
  b = glm::cross(n, t);
}

} // namespace

Result<std::unique_ptr<RoomTransport>> RoomTransport::make(const Room& room, std::vector<Sky> skies,
                                                           const Progress& progress) {
  std::unique_ptr<RoomTransport> transport(new RoomTransport(room, std::move(skies)));
  if (const Result<void> done = transport->set_up(progress); !done)
    return done.error();
  if (const Result<void> lit = transport->light_patches(progress); !lit)
    return lit.error();
  return transport;
}

Result<void> RoomTransport::set_up(const Progress& progress) {
  auto rays = RayScene::build(room_);
  if (!rays)
    return rays.error();
  room_rays_ = std::move(*rays);
  auto apertures = find_apertures(room_, *room_rays_);
  if (!apertures)
    return apertures.error();
  apertures_ = std::move(*apertures);
  auto mesh = radiosity::mesh_surfaces(room_, {.target_facets = kFacets});
  if (!mesh)
    return mesh.error();
  mesh_ = std::move(*mesh);
  auto facets = radiosity::facet_scene(mesh_);
  if (!facets)
    return facets.error();
  facet_rays_ = std::move(*facets);
  patches_ = radiosity::find_patches(room_, mesh_, *facet_rays_, apertures_.list);
  auto exchange =
      radiosity::exchange_areas(patches_, mesh_, room_, *room_rays_, {.visibility_rays = kVisibilityRays}, progress);
  if (!exchange)
    return exchange.error();
  exchange_ = std::move(*exchange);
  return {};
}

/// H of a patch: the mean over points on it.
Result<void> RoomTransport::light_patches(const Progress& progress) {
  for (const Sky& sky : skies_)
    direct_.emplace_back(room_, apertures_.list, *room_rays_, sky);
  light_.patches = patches_.patches.size();
  light_.region.resize(skies_.size());
  light_.irradiance.assign(light_.patches * 3 * skies_.size(), 0.0f);
  light_.opening.assign(light_.patches, 0.0f);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stopped{false};
  parallel_for(std::size_t{0}, light_.patches, [&](std::size_t i) {
    if (stopped)
      return;
    const radiosity::Patch& patch = patches_.patches[i];
    for (std::size_t s = 0; s < skies_.size(); ++s) {
      Rgb sum(0.0f);
      for (int k = 0; k < kPointsOnPatch; ++k) {
        const glm::dvec3 at = mesh_.origin + point_on(patch.corner, k, kPointsOnPatch) + kOffSurface_m * patch.normal;
        sum += direct_[s].irradiance(at, patch.normal);
      }
      for (int c = 0; c < 3; ++c)
        light_.row(i, c)[s] = sum[c] / kPointsOnPatch;
    }
    if (!progress("direct light", static_cast<double>(++done) / static_cast<double>(light_.patches)))
      stopped = true;
  });
  return stopped ? Result<void>(interrupted_error("light of the room")) : Result<void>();
}

std::optional<SurfacePoint> RoomTransport::first_surface(const glm::dvec3& origin, const glm::dvec3& d) const {
  RayHit hit;
  const glm::vec3 direction(d);
  if (!facet_rays_->closest(facet_rays_->to_local(origin - mesh_.origin), direction, 0.0f,
                            std::numeric_limits<float>::infinity(), hit))
    return std::nullopt;
  const radiosity::Facet& facet = mesh_.facets[hit.triangle];
  SurfacePoint at;
  at.position = origin + static_cast<double>(hit.distance) * d;
  at.normal = glm::dot(facet.normal, d) < 0.0 ? facet.normal : -facet.normal;
  at.material = facet.material;
  at.plane = facet.plane;
  at.patch = patches_.hit(mesh_, hit.triangle, direction);
  int crossed = 0;
  aperture_transmittance(apertures_.list, origin, d, static_cast<double>(hit.distance), &crossed);
  if (crossed > 0)
    at.patch = -1; // outside, or seen through a pane
  return at;
}

std::optional<Rgb> RoomTransport::seen_sky(const glm::dvec3& origin, const glm::dvec3& d, std::size_t sky) const {
  const glm::vec3 local = room_rays_->to_local(origin);
  if (room_rays_->occluded(local, glm::vec3(d), 0.0f, std::numeric_limits<float>::infinity()))
    return std::nullopt;
  int crossed = 0;
  const Rgb through =
      aperture_transmittance(apertures_.list, origin, d, std::numeric_limits<double>::infinity(), &crossed);
  return crossed > 0 ? std::optional(through * skies_[sky].radiance(d)) : std::nullopt;
}

Rgb RoomTransport::direct(const SurfacePoint& at, std::size_t sky) const {
  return direct_[sky].irradiance(at.position + kOffSurface_m * at.normal, at.normal);
}

void RoomTransport::gather(const SurfacePoint& at, std::uint32_t seed, std::span<std::int32_t> patches) const {
  glm::dvec3 t, b;
  frame_of(at.normal, t, b);
  const glm::vec3 local = facet_rays_->to_local(at.position + kOffSurface_m * at.normal - mesh_.origin);
  const double turn_u = fraction(seed * kGolden), turn_v = fraction(seed * 0.7548776662466927);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const double u = fraction((static_cast<double>(k) + 0.5) / static_cast<double>(patches.size()) + turn_u);
    const double phi = 2.0 * std::numbers::pi * fraction(radical_inverse(static_cast<std::uint32_t>(k)) + turn_v);
    const double r = std::sqrt(u); // Malley: cosine-distributed
    const glm::vec3 d(r * std::cos(phi) * t + r * std::sin(phi) * b + std::sqrt(1.0 - u) * at.normal);
    RayHit hit;
    patches[k] = facet_rays_->closest(local, d, 0.0f, std::numeric_limits<float>::infinity(), hit)
                     ? patches_.hit(mesh_, hit.triangle, d)
                     : -1;
  }
}

Result<radiosity::Radiosity> RoomTransport::solve(std::span<const Rgb> reflectance) {
  for (radiosity::Patch& patch : patches_.patches)
    patch.reflectance = reflectance[mesh_.facets[patch.facet].material];
  radiosity::SolveOptions options;
  options.method = radiosity::SolveMethod::conjugate_gradients; // a few columns
  return radiosity::solve_radiosity(patches_, exchange_, light_, options,
                                    [](const std::string&, double) { return !interrupted(); });
}

} // namespace daylit::calibration
