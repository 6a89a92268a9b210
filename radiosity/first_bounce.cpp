#include "radiosity/first_bounce.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <tbb/parallel_for.h>

#include "radiosity/detail/sampling.h"
#include "radiosity/polygon_kernel.h"

namespace daylit::radiosity {

namespace {

constexpr int kScoutRays = 64, kOpenSkyRays = 1024;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Direction uniform in the solid angle of a spherical triangle (Arvo 1995); corners are unit vectors.
glm::dvec3 on_spherical_triangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec2& u) {
  const glm::dvec3 nab = glm::normalize(glm::cross(a, b)), nac = glm::normalize(glm::cross(a, c));
  const double cos_alpha = std::clamp(glm::dot(nab, nac), -1.0, 1.0), alpha = std::acos(cos_alpha);
  const double area = u.x * spherical_triangle_sr(a, b, c), cos_c = glm::dot(a, b);
  const double s = std::sin(area - alpha), t = std::cos(area - alpha), sin_alpha = std::sin(alpha);
  const double p = t - cos_alpha, q = s + sin_alpha * cos_c;
  const double denominator = (q * s + p * t) * sin_alpha;
  const double numerator = (t * q - s * p) * cos_alpha - q;
  const double cos_b = std::abs(denominator) > 1e-300 ? std::clamp(numerator / denominator, -1.0, 1.0) : 1.0;
  const glm::dvec3 towards_c = c - glm::dot(c, a) * a;
  const double length = glm::length(towards_c);
  const glm::dvec3 c_hat =
      length > 0 ? cos_b * a + std::sqrt(std::max(0.0, 1.0 - cos_b * cos_b)) * (towards_c / length) : a;
  const double z = 1.0 - u.y * (1.0 - glm::dot(c_hat, b));
  const glm::dvec3 off = c_hat - glm::dot(c_hat, b) * b;
  const double off_length = glm::length(off);
  return off_length > 0 ? z * b + std::sqrt(std::max(0.0, 1.0 - z * z)) * (off / off_length) : b;
}

struct Task {
  const ElementSet& set;
  const PatchMesh& mesh;
  const RayScene& scene;
  const std::vector<Aperture>& apertures;
  const SkyPartition& partition;
  int directions; ///< per element and aperture
  std::atomic<std::uint64_t> rays{0};
  std::atomic<int> open_sky{0};

  bool leaves(const glm::dvec3& from, const glm::dvec3& direction) const {
    return !scene.occluded(scene.to_local(from), glm::vec3(direction), 2.0f * scene.surface_offset(),
                           std::numeric_limits<float>::infinity());
  }
};

/// What one element receives, dense over regions; added to by each aperture.
struct Received {
  std::vector<glm::dvec3> region;
  double opening = 0;
};

struct Accumulator {
  std::vector<std::pair<int, glm::dvec3>> seen;
  double total = 0, visible = 0;
};

/// A ray that crosses several apertures one behind the other (double glazing) counts at the first.
bool meets_first(const Task& task, const Aperture& aperture, const glm::dvec3& world, const glm::dvec3& d) {
  const double distance = glm::dot(aperture.corners[0] - world, aperture.inward) / glm::dot(d, aperture.inward);
  int nearer = 0;
  (void)aperture_transmittance(task.apertures, world, d, distance * (1.0 - 1e-6), &nearer);
  return nearer == 0;
}

/// Samples the fan of triangles that makes up the aperture, as seen from one point of the element.
void sample_aperture(Task& task, const Element& e, const Aperture& aperture, const SmallPolygon& polygon,
                     const glm::dvec3& from, int count, std::uint64_t seed, Accumulator& acc) {
  std::array<glm::dvec3, 12> corner;
  std::array<double, 12> solid_angle{};
  double total_sr = 0;
  for (int k = 0; k < polygon.size; ++k)
    corner[k] = glm::normalize(polygon.corner[k] - from);
  for (int k = 1; k + 1 < polygon.size; ++k)
    total_sr += solid_angle[k] = spherical_triangle_sr(corner[0], corner[k], corner[k + 1]);
  if (!(total_sr > 0.0))
    return;
  const glm::dvec2 shift = random_shift(seed);
  for (int s = 0; s < count; ++s) {
    glm::dvec2 u = r2_point(static_cast<std::uint32_t>(s), shift);
    double pick = u.x * total_sr;
    int k = 1;
    while (k + 2 < polygon.size && pick > solid_angle[k])
      pick -= solid_angle[k++];
    u.x = solid_angle[k] > 0 ? std::min(pick / solid_angle[k], 1.0) : 0.0;
    const glm::dvec3 d = on_spherical_triangle(corner[0], corner[k], corner[k + 1], u);
    const double weight = total_sr * std::max(0.0, glm::dot(d, e.normal));
    acc.total += weight;
    const glm::dvec3 world = from + task.mesh.origin;
    if (weight <= 0.0 || !task.leaves(from, d) || (task.apertures.size() > 1 && !meets_first(task, aperture, world, d)))
      continue;
    const glm::dvec3 tau(aperture_transmittance(task.apertures, world, d, kInfinity));
    acc.visible += weight;
    acc.seen.emplace_back(task.partition.region_of(d), weight * tau);
  }
}

void receive_through(Task& task, std::size_t index, const Aperture& aperture, std::uint64_t seed, Received& out) {
  const Element& e = task.set.elements[index];
  SmallPolygon whole;
  for (const glm::dvec3& c : aperture.corners)
    if (whole.size < 10)
      whole.corner[whole.size++] = c - task.mesh.origin;
  const SmallPolygon polygon = clip_to_front(whole, e.corner[0], e.normal);
  const glm::dvec3 middle = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
  if (polygon.size < 3 || glm::dot(middle - whole.corner[0], aperture.inward) <= 0.0)
    return;
  // From inside, the aperture shows the face that looks along `inward`.
  const double exact =
      exchange_area_unoccluded(e.corner, e.normal,
                               std::span<const glm::dvec3>(whole.corner.data(), static_cast<std::size_t>(whole.size)),
                               aperture.inward) /
      e.area_m2 * std::numbers::pi;
  constexpr int kDirectionsPerPoint = 16;
  const int points = std::max(1, task.directions / kDirectionsPerPoint);
  Accumulator acc;
  const glm::dvec2 shift = random_shift(seed ^ 0xA5A5A5A5ull);
  for (int p = 0; p < points; ++p)
    sample_aperture(task, e, aperture, polygon, on_triangle(e.corner, r2_point(static_cast<std::uint32_t>(p), shift)),
                    kDirectionsPerPoint, mix_bits(seed) + static_cast<std::uint64_t>(p), acc);
  task.rays.fetch_add(static_cast<std::uint64_t>(points) * kDirectionsPerPoint, std::memory_order_relaxed);
  if (acc.total <= 0.0)
    return;
  for (const auto& [region, weight] : acc.seen)
    out.region[region] += weight * (exact / acc.total);
  out.opening += exact / std::numbers::pi * acc.visible / acc.total;
}

/// Escapes through no listed aperture: outside surfaces, and gaps whose outline nobody knows.
void receive_open_sky(Task& task, std::size_t index, std::uint64_t seed, Received& out) {
  const Element& e = task.set.elements[index];
  const auto escapes = [&](int count, int first, bool add) {
    int found = 0;
    for (int k = first; k < first + count; ++k) {
      const auto i = static_cast<std::uint32_t>(k);
      const glm::dvec3 from = on_triangle(e.corner, r2_point(i, random_shift(seed)));
      const glm::dvec3 d = cosine_direction(e.normal, r2_point(i, random_shift(seed + 77)));
      int crossed = 0;
      if (!task.leaves(from, d))
        continue;
      (void)aperture_transmittance(task.apertures, from + task.mesh.origin, d, kInfinity, &crossed);
      if (crossed > 0)
        continue;
      ++found;
      if (add) {
        out.region[task.partition.region_of(d)] += glm::dvec3(std::numbers::pi / kOpenSkyRays);
        out.opening += 1.0 / kOpenSkyRays;
      }
    }
    task.rays.fetch_add(static_cast<std::uint64_t>(count), std::memory_order_relaxed);
    return found;
  };
  if (escapes(kScoutRays, 0, false) == 0)
    return;
  task.open_sky.fetch_add(1, std::memory_order_relaxed);
  escapes(kOpenSkyRays, kScoutRays, true);
}

/// Keeps the columns in which any element receives light.
FirstBounce compact(const std::vector<Received>& received, int regions) {
  std::vector<bool> used(regions, false);
  for (const Received& r : received)
    for (int i = 0; i < regions; ++i)
      if (!r.region.empty() && r.region[i] != glm::dvec3(0.0))
        used[i] = true;
  FirstBounce result;
  result.elements = received.size();
  for (int i = 0; i < regions; ++i)
    if (used[i])
      result.region.push_back(i);
  result.irradiance.resize(received.size() * 3 * result.columns());
  result.opening.resize(received.size());
  for (std::size_t e = 0; e < received.size(); ++e) {
    result.opening[e] = static_cast<float>(received[e].opening);
    for (int c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < result.columns(); ++k)
        result.irradiance[(e * 3 + c) * result.columns() + k] =
            static_cast<float>(received[e].region[result.region[k]][c]);
  }
  return result;
}

} // namespace

Result<FirstBounce> first_bounce(const ElementSet& set, const PatchMesh& mesh, const RayScene& scene,
                                 const std::vector<Aperture>& apertures, const SkyPartition& partition,
                                 const Progress& progress, FirstBounceReport* report) {
  const auto start = std::chrono::steady_clock::now();
  // A window sees about a third of the regions; four directions for each keep narrow regions populated.
  Task task{set, mesh, scene, apertures, partition, std::clamp(partition.size() * 4 / 3, 256, 4096), {}, {}};
  std::vector<Received> received(set.elements.size());
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, set.elements.size(), [&](std::size_t i) {
    if (stop)
      return;
    received[i].region.assign(partition.size(), glm::dvec3(0.0));
    for (std::size_t a = 0; a < apertures.size(); ++a)
      receive_through(task, i, apertures[a], mix_bits(i * 4099 + a), received[i]);
    receive_open_sky(task, i, mix_bits(i + 0x5555555555ull), received[i]);
    if (++done % 64 == 0 && !progress("first bounce", static_cast<double>(done) / static_cast<double>(received.size())))
      stop = true;
  });
  if (stop)
    return interrupted_error("first bounce");
  FirstBounce result = compact(received, partition.size());
  if (report)
    *report = {task.rays, partition.size() - static_cast<int>(result.columns()), task.open_sky,
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
  return result;
}

} // namespace daylit::radiosity
