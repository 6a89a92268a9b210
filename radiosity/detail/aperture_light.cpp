#include "radiosity/detail/aperture_light.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "radiosity/detail/aperture_beam.h"
#include "radiosity/detail/sampling.h"
#include "radiosity/polygon_kernel.h"
#include "scene/room/glass.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kMostSheets = 2000; // with more, rays are cheaper than looking at every plane
constexpr double kTolerance = 1e-7;       // of the room's size

constexpr double kWide_sr = 0.6;   // projected solid angle of a wide view: 400 of 8,192 directions
constexpr int kScoutingRays = 2;   // per direction: is a patch partly in the shade?
constexpr int kPartialRays = 16;   // per direction, at most, for one that is
constexpr int kRegionRays = 32;    // per region, where one has many directions
constexpr double kShade = 1e-9;    // relative: rounding of sums
constexpr int kFewestSamples = 64; // of an opening in its solid angle
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Light through one part of an opening before it is scaled to the exact form factor; sr.
struct Accumulator {
  std::vector<std::pair<int, glm::dvec3>> seen; ///< runs of one region follow each other
  double total = 0, visible = 0;
  int directions = 0;
};

/// An opening that a patch sees under fewer directions is sampled in its solid angle, 48 of 16,384.
int fewest_directions(const DirectLight& task) { return 3 * task.directions / 1024; }
/// Samples of an opening that is seen under the fewest directions, 1,024 of 16,384; in proportion under fewer.
int most_samples(const DirectLight& task) { return task.directions / 16; }

/// Transmittance of all panes for the light that comes to `from` along d; nothing where another opening is met first
/// (double glazing counts at the first), which then has the light.
std::optional<glm::dvec3> pane_transmittance_along(const DirectLight& task, const Aperture& aperture, Way way,
                                                   const glm::dvec3& from, const glm::dvec3& d) {
  if (way != Way::any)
    return glm::dvec3(pane_transmittance(aperture, glm::dot(d, aperture.inward)));
  const glm::dvec3 world = from + task.mesh.origin;
  const double distance = glm::dot(aperture.corners[0] - world, aperture.inward) / glm::dot(d, aperture.inward);
  const ApertureCrossings::Met met = task.crossings.met(world, d, kInfinity);
  if (met.nearest_m < distance * (1.0 - 1e-6))
    return std::nullopt;
  return glm::dvec3(met.transmittance);
}

/// Up to 16 rays from a patch, tested together.
class RayBatch {
public:
  RayBatch(DirectLight& task, const Aperture& aperture, Way way, Accumulator& acc)
      : task_(task), aperture_(aperture), way_(way), acc_(acc) {}
  void add(const glm::dvec3& from, const glm::dvec3& d, int region, double weight) {
    rays_.set(static_cast<std::size_t>(size_), task_.scene.to_local(from), glm::vec3(d),
              2.0f * task_.scene.surface_offset(), std::numeric_limits<float>::infinity());
    ray_[size_] = {from, d, region, weight};
    if (++size_ == 16)
      flush();
  }
  void flush() {
    const std::uint32_t blocked = size_ > 0 ? task_.scene.occluded16(rays_, size_) : 0;
    for (int k = 0; k < size_; ++k) {
      if (blocked >> k & 1u)
        continue;
      if (const auto tau = pane_transmittance_along(task_, aperture_, way_, ray_[k].from, ray_[k].d)) {
        acc_.visible += ray_[k].weight;
        acc_.seen.emplace_back(ray_[k].region, ray_[k].weight * *tau);
      }
    }
    task_.rays.fetch_add(static_cast<std::uint64_t>(size_), std::memory_order_relaxed);
    size_ = 0;
  }

private:
  struct Ray {
    glm::dvec3 from, d;
    int region;
    double weight;
  };
  DirectLight& task_;
  const Aperture& aperture_;
  Way way_;
  Accumulator& acc_;
  RayPacket16 rays_;
  std::array<Ray, 16> ray_;
  int size_ = 0;
};

/// Directions uniform in the solid angle of the fan of triangles that makes up the aperture, from one point of the
/// patch (Arvo 1995); each weighs solid angle times cosine, sr.
void sample_aperture(DirectLight& task, const Patch& e, const Aperture& aperture, Way way, const SmallPolygon& polygon,
                     const glm::dvec3& from, int count, std::uint64_t seed, Accumulator& acc) {
  RayBatch batch(task, aperture, way, acc);
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
    if (weight > 0.0)
      batch.add(from, d, task.partition.region_of(d), weight);
  }
  batch.flush();
}

/// One direction after another, the lit part of the patch by an exact clip: sum of dw (n . w) lit area / area, sr.
/// Unless the way is clear, `rays` rays from the lit part decide.
Accumulator sweep_beam(DirectLight& task, const Patch& e, const ApertureBeam& beam, const SkySweep& sweep,
                       std::size_t index, Way way, int rays, std::uint64_t seed) {
  const Aperture& aperture = task.apertures[task.parts[index].aperture];
  const glm::dvec2 shift = random_shift(seed);
  const bool clear = way == Way::clear;
  Accumulator acc;
  RayBatch batch(task, aperture, way, acc);
  std::uint32_t sample = 0;
  const EnteringDirections& entering = sweep.entering[index];
  const std::vector<float> cosine = entering.cosines(beam.axis());
  for (std::size_t n = 0; n < cosine.size(); ++n) {
    if (cosine[n] < beam.cos_spread())
      continue;
    const std::uint32_t k = entering.index[n];
    const glm::dvec3& w = sweep.sky.w[k];
    const ApertureBeam::LitPart part = beam.lit(w);
    const double weight = sweep.sky.solid_angle_sr[k] * glm::dot(w, e.normal) * part.area_m2 / e.area_m2;
    if (!(weight > 0.0))
      continue;
    ++acc.directions;
    acc.total += weight;
    if (clear) {
      acc.visible += weight;
      acc.seen.emplace_back(sweep.sky.region[k],
                            weight * glm::dvec3(pane_transmittance(aperture, glm::dot(w, aperture.inward))));
    }
    for (int r = 0; r < (clear ? 0 : rays); ++r)
      batch.add(beam.point(part, r2_point(sample++, shift)), w, sweep.sky.region[k], weight / rays);
  }
  batch.flush();
  return acc;
}

/// A small opening, or a large patch's small view of one: directions uniform in its solid angle, in proportion to it,
/// so that every opening adds about the same error.
Accumulator sample_small(DirectLight& task, const Patch& e, const ApertureBeam& beam, std::size_t index, Way way,
                         int directions, std::uint64_t seed) {
  SmallPolygon polygon;
  for (const glm::dvec3& c : beam.front())
    polygon.corner[polygon.size++] = c;
  constexpr int kDirectionsPerPoint = 16;
  const glm::dvec2 shift = random_shift(seed ^ 0xA5A5A5A5ull);
  const int most = most_samples(task),
            samples = std::clamp(most * directions / fewest_directions(task), std::min(kFewestSamples, most), most);
  Accumulator acc;
  for (int p = 0; p < samples / kDirectionsPerPoint; ++p)
    sample_aperture(task, e, task.apertures[task.parts[index].aperture], way, polygon,
                    on_triangle(e.corner, r2_point(static_cast<std::uint32_t>(p), shift)), kDirectionsPerPoint,
                    mix_bits(seed) + static_cast<std::uint64_t>(p), acc);
  task.sampled.fetch_add(1, std::memory_order_relaxed);
  return acc;
}

/// Rays per direction for a patch that is partly in the shade: the directions of one region share its rays, and
/// patches whose light hardly matters have fewer.
int partial_rays(const DirectLight& task, const SkySweep& sweep, const Patch& e) {
  const int directions = std::max(1, static_cast<int>(sweep.sky.w.size()) / task.partition.size()),
            most = std::min(kPartialRays, kRegionRays / directions);
  return static_cast<int>(e.worth() * static_cast<float>(most));
}

} // namespace

void OpenPaths::Box::include(const glm::dvec3& p) {
  lo = glm::min(lo, p);
  hi = glm::max(hi, p);
}

OpenPaths::OpenPaths(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures,
                     const std::vector<AperturePart>& parts)
    : parts_(parts) {
  add_sheets(mesh, apertures);
  glm::dvec3 size(0.0);
  for (const Sheet& s : sheets_)
    size = glm::max(size, glm::max(glm::abs(s.box.lo), glm::abs(s.box.hi)));
  tolerance_m_ = kTolerance * glm::length(size);
  for (const AperturePart& part : parts) {
    const auto outside = [&](const glm::dvec3& p) { return glm::dot(p - part.corner[0], part.inward) < -tolerance_m_; };
    facet_outside_.push_back(
        std::ranges::any_of(mesh.facets, [&](const Facet& p) { return std::ranges::any_of(p.corner, outside); }));
    opening_outside_.push_back(std::ranges::any_of(apertures, [&](const Aperture& a) {
      return std::ranges::any_of(a.corners, [&](const glm::dvec3& c) { return outside(c - mesh.origin); });
    }));
  }
}

void OpenPaths::add_sheets(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures) {
  const Box nothing{glm::dvec3(std::numeric_limits<double>::infinity()),
                    glm::dvec3(-std::numeric_limits<double>::infinity())};
  sheets_.assign(mesh.planes, {glm::dvec3(0.0), glm::dvec3(0.0), nothing});
  for (const Facet& p : mesh.facets) {
    Sheet& s = sheets_[p.plane];
    s.point = p.corner[0];
    s.normal = p.normal;
    for (const glm::dvec3& c : p.corner)
      s.box.include(c);
  }
  std::erase_if(sheets_, [](const Sheet& s) { return s.box.lo.x > s.box.hi.x; }); // planes of slivers have no facet
  first_opening_ = sheets_.size();
  for (const Aperture& a : apertures) {
    sheets_.push_back({a.corners[0] - mesh.origin, a.inward, nothing});
    for (const glm::dvec3& c : a.corners)
      sheets_.back().box.include(c - mesh.origin);
  }
}

/// The hull lies on one side of the sheet's plane, or away from the sheet's box.
bool OpenPaths::parted(const Sheet& sheet, const Patch& e, const std::vector<glm::dvec3>& front,
                       const Box& hull) const {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto add = [&](const glm::dvec3& p) {
    const double h = glm::dot(p - sheet.point, sheet.normal);
    low = std::min(low, h);
    high = std::max(high, h);
  };
  std::ranges::for_each(e.corner, add);
  std::ranges::for_each(front, add);
  if (low >= -tolerance_m_ || high <= tolerance_m_)
    return true;
  for (int k = 0; k < 3; ++k)
    if (hull.hi[k] <= sheet.box.lo[k] + tolerance_m_ || hull.lo[k] >= sheet.box.hi[k] - tolerance_m_)
      return true;
  return false;
}

/// No sheet but the opening itself cuts the hull of patch and opening: a separating plane or axis for each.
Way OpenPaths::way(const Patch& e, std::size_t index, const std::vector<glm::dvec3>& front) const {
  if (opening_outside_[index] || sheets_.size() > kMostSheets)
    return sheets_.size() - first_opening_ == 1 ? Way::one_opening : Way::any;
  Box hull{e.corner[0], e.corner[0]};
  for (const glm::dvec3& c : e.corner)
    hull.include(c);
  for (const glm::dvec3& c : front)
    hull.include(c);
  const auto free = [&](std::size_t first, std::size_t last) {
    for (std::size_t s = first; s < last; ++s)
      if (s != first_opening_ + parts_[index].aperture && !parted(sheets_[s], e, front, hull))
        return false;
    return true;
  };
  if (!free(first_opening_, sheets_.size()))
    return Way::any;
  return !facet_outside_[index] && free(0, first_opening_) ? Way::clear : Way::one_opening;
}

void receive_through(DirectLight& task, std::size_t patch, std::size_t index, Received& out) {
  const Patch& e = task.set.patches[patch];
  const AperturePart& part = task.parts[index];
  const glm::dvec3 middle = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
  const ApertureBeam beam(e, part);
  if (beam.empty() || glm::dot(middle - part.corner[0], part.inward) <= 0.0)
    return;
  // pi F with F = G / A exact; from inside, the aperture shows the face that looks along `inward`.
  const double exact =
      exchange_area_unoccluded(e.corner, e.normal, part.corner, part.inward) / e.area_m2 * std::numbers::pi;
  const std::uint64_t seed = mix_bits(patch * 4099 + index);
  const SkySweep& sweep = exact > kWide_sr ? task.wide : task.fine;
  const Way way = task.paths.way(e, index, beam.front());
  task.clear.fetch_add(way == Way::clear ? 1 : 0, std::memory_order_relaxed);
  Accumulator acc = sweep_beam(task, e, beam, sweep, index, way, kScoutingRays, seed);
  if (acc.directions < fewest_directions(task))
    acc = sample_small(task, e, beam, index, way, acc.directions, seed);
  else if (const int rays = partial_rays(task, sweep, e);
           rays > kScoutingRays && acc.visible > kShade * acc.total && acc.visible < (1.0 - kShade) * acc.total)
    acc = sweep_beam(task, e, beam, sweep, index, way, rays, seed);
  if (acc.total <= 0.0)
    return;
  for (const auto& [region, weight] : acc.seen)
    out.region[region] += weight * (exact / acc.total);
  out.opening += exact / std::numbers::pi * acc.visible / acc.total;
}

} // namespace daylit::radiosity
