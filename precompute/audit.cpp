#include "precompute/audit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <ranges>
#include <set>

#include <glm/geometric.hpp>

#include "precompute/detail/point_ratios.h"
#include "scene/core/parallel.h"

namespace daylit::precompute {

namespace {

using detail::PointRatios;
using detail::Ratio;

constexpr std::size_t kPoints = 128;
constexpr std::size_t kManyProbes = 2048; ///< from here on light at the probes of every second point is enough
constexpr double kPercentile = 0.95, kFaintestSun = 0.1;
constexpr double kAxes = 6 * 3;     ///< values of irradiance at a point
constexpr double kClearance = 0.04; ///< of the room's longest side: nearer to a facet its own shape shows

/// Coefficient (l, c) of row `point` for one column of [point][lm][channel * columns + column].
struct Column {
  std::span<const float> values;
  std::size_t columns, column;
  Sh9Rgb at(std::size_t point) const {
    Sh9Rgb out{};
    for (std::size_t l = 0; l < 9; ++l)
      for (int c = 0; c < 3; ++c)
        out[l][c] = values[((point * 9 + l) * 3 + static_cast<std::size_t>(c)) * columns + column];
    return out;
  }
};

/// All nine coefficients of the three channels.
void add(Ratio& ratio, const Sh9Rgb& value, const Sh9Rgb& truth) {
  for (std::size_t l = 0; l < 9; ++l)
    for (int c = 0; c < 3; ++c)
      ratio.add(static_cast<double>(value[l][c]), static_cast<double>(truth[l][c]));
}

Ratio ratio_of(const Sh9Rgb& value, const Sh9Rgb& truth) {
  Ratio ratio;
  add(ratio, value, truth);
  return ratio;
}

/// Irradiance on the six axes, to order 4 where the coefficients are there.
void add_irradiance(Ratio& ratio, const ShRadiance& value, const ShRadiance& truth) {
  for (int axis = 0; axis < 6; ++axis) {
    glm::vec3 n(0.0f);
    n[axis / 2] = axis % 2 == 0 ? 1.0f : -1.0f;
    const Rgb a = irradiance(value, n), b = irradiance(truth, n);
    for (int c = 0; c < 3; ++c)
      ratio.add(static_cast<double>(a[c]), static_cast<double>(b[c]));
  }
}

/// Points spread over the air away from the walls, or some of the given probes.
std::vector<glm::dvec3> candidates_in(const Room& room, const ProbeSet& probes) {
  std::vector<glm::dvec3> out;
  if (!probes.is_grid) {
    const std::size_t step = std::max<std::size_t>(1, probes.size() / kPoints);
    for (std::size_t i = 0; i < probes.size(); i += step)
      out.push_back(probes.origin + glm::dvec3(probes.positions[i]));
    return out;
  }
  const glm::dvec3 size = room.bounds().size();
  for (double clearance = kClearance * std::max({size.x, size.y, size.z}); out.empty(); clearance *= 0.25) {
    out = spread_points(room, room.bounds(), 4 * kPoints, clearance);
    if (clearance < 1e-6 * size.x)
      break;
  }
  return out;
}

} // namespace

/// The worst of the smooth skies: the bound that a target is held against.
double AuditReport::smooth(double SkyError::*part) const {
  double worst = 0;
  for (const SkyError& s : sky)
    worst = s.is_sun ? worst : std::max(worst, s.*part);
  return worst;
}

/// Root of the mean square over the suns: where they stand is chance.
double AuditReport::sun(double SkyError::*part) const {
  double sum = 0;
  int suns = 0;
  for (const SkyError& s : sky)
    if (s.is_sun) {
      sum += (s.*part) * (s.*part);
      ++suns;
    }
  return suns > 0 ? std::sqrt(sum / suns) : 0.0;
}

/// Percentile at 0.95 (n - 1) of the sorted errors.
ErrorSpread ErrorSpread::of(std::vector<double> errors) {
  if (errors.empty())
    return {};
  std::ranges::sort(errors);
  const double at = kPercentile * static_cast<double>(errors.size() - 1), below = std::floor(at);
  const auto i = static_cast<std::size_t>(below);
  return {errors.size(), std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size()),
          std::lerp(errors[i], errors[std::min(i + 1, errors.size() - 1)], at - below), errors.back()};
}

RoomErrors AuditReport::errors_in(std::size_t room, double mesh) const {
  double brightest = 0;
  for (const SkyError& s : sky)
    brightest = std::max(brightest, s.is_sun ? s.rooms[room].light : 0.0);
  std::vector<double> smooth, sun;
  for (const SkyError& s : sky)
    if (!s.is_sun || (s.rooms[room].light > 0 && s.rooms[room].light >= kFaintestSun * brightest))
      (s.is_sun ? sun : smooth).push_back(std::hypot(s.rooms[room].error, mesh));
  return {ErrorSpread::of(std::move(smooth)), ErrorSpread::of(std::move(sun))};
}

/// nrms difference of the direct transports at the points that both have, worst of the smooth skies.
double mesh_difference(const AuditReport& coarse, const AuditReport& fine) {
  // Points outside one of the two grids are in one list only; the order is the same.
  std::vector<std::array<std::size_t, 2>> common;
  for (std::size_t i = 0, j = 0; i < coarse.points.size() && j < fine.points.size();) {
    const glm::dvec3 &a = coarse.points[i], &b = fine.points[j];
    if (glm::length(a - b) <= 1e-9 * (glm::length(a) + glm::length(b)))
      common.push_back({i++, j++});
    else if (coarse.points.size() - i > fine.points.size() - j)
      ++i;
    else
      ++j;
  }
  double worst = 0;
  for (std::size_t s = 0; s < fine.sky.size() && !fine.sky[s].is_sun; ++s) {
    Ratio r;
    for (const auto& [i, j] : common)
      for (std::size_t k = 0; k < 27; ++k)
        r.add(static_cast<double>(coarse.exact[(s * coarse.points.size() + i) * 27 + k]),
              static_cast<double>(fine.exact[(s * fine.points.size() + j) * 27 + k]));
    worst = std::max(worst, r.nrms());
  }
  return worst;
}

/// Keeps the first kPoints candidates at which the volume interpolates; an empty volume of these probes decides.
Result<Audit> Audit::prepare(const Room& room, const std::vector<Aperture>& apertures, const ProbeSet& probes,
                             std::vector<glm::dvec3> candidates, const std::vector<glm::dvec3>& standing,
                             const std::vector<RoomPoints>& rooms) {
  BasisVolume empty{.partition = held_out_partition(),
                    .probes = probes,
                    .stored_region = {},
                    .basis = {},
                    .compact = {},
                    .room = room,
                    .apertures = apertures,
                    .provenance = {}};
  const auto sampler = LightFieldSampler::make(empty);
  if (!sampler)
    return sampler.error();
  Audit audit;
  audit.grid_step_ = probes.size() > kManyProbes ? 2 : 1;
  audit.sampler_ = *sampler;
  if (auto interpolated = interpolated_probes(probes))
    audit.interpolated_ = std::move(*interpolated);
  if (candidates.empty())
    candidates = candidates_in(room, probes);
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  const auto keep = [&](const std::vector<glm::dvec3>& list) {
    const std::size_t most = audit.points_.size() + kPoints;
    for (const glm::dvec3& p : list)
      if (audit.points_.size() < most && sampler->weights(p, probe, weight) > 0)
        audit.points_.push_back(p);
  };
  keep(candidates);
  audit.in_air_ = audit.points_.size();
  keep(standing);
  audit.standing_ = audit.points_.size() - audit.in_air_;
  for (const RoomPoints& one : rooms) {
    const auto first = static_cast<std::ptrdiff_t>(audit.points_.size());
    keep(one.points);
    audit.rooms_.push_back({one.box, {audit.points_.begin() + first, audit.points_.end()}});
  }
  return audit;
}

/// The smooth skies, and suns where this room lets them in.
radiosity::FirstBounce Audit::direct_light(std::span<const radiosity::FirstBounceRow> light,
                                           const radiosity::PatchSet& set) {
  skies_ = smooth_skies();
  for (HeldOutSky& sun : suns(light, set))
    skies_.push_back(std::move(sun));
  return precompute::direct_light(light, skies_);
}

/// Union of the interpolation stencils of every grid_step_-th point, and of what their interpolated probes come from.
std::vector<std::size_t> Audit::probes() const {
  std::set<std::size_t> list;
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  for (std::size_t p = 0; p < in_air_; p += grid_step_)
    list.insert(probe.begin(), probe.begin() + sampler_.weights(points_[p], probe, weight));
  for (const InterpolatedProbe& i : std::views::reverse(interpolated_))
    if (list.erase(i.probe) > 0)
      list.insert({i.a, i.b});
  return {list.begin(), list.end()};
}

/// Of the volume; 0 where it knows none.
std::vector<ShRadiance> Audit::light_at_points(const LightField& field, const FirstReflection* surfaces,
                                               std::span<const Rgb> stored, std::span<const Rgb> sent) const {
  std::vector<ShRadiance> light(points_.size());
  parallel_for(std::size_t{0}, points_.size(), [&](std::size_t p) {
    const auto light_here = surfaces ? surfaces->corrected(sampler_, field, points_[p], stored,
                                                           [&](std::size_t e, const glm::dvec3&) { return sent[e]; })
                                     : sampler_.sample_all(field, points_[p]);
    light[p] = light_here.value_or(ShRadiance{});
  });
  return light;
}

/// total: volume against truth at the points. sky part: volume against truth at the probes. grid part: exact probes,
/// interpolated, against truth at the points. band 4: nine true coefficients against order 4, as irradiance.
SkyError Audit::judge_sky(std::size_t s, const BasisVolume& volume, std::span<const float> exact_at_points,
                          std::span<const float> band4_at_points, std::span<const float> exact_at_probes,
                          std::span<const std::size_t> probes, const FirstReflection* surfaces,
                          std::span<const Rgb> sent) const {
  std::vector<Rgb> radiance;
  for (const float r : radiance_on(volume.partition, skies_[s]))
    radiance.emplace_back(r);
  const LightField field = combine(volume, radiance, ShOrder::fourth);
  const bool near = surfaces && skies_[s].is_sun;
  const std::vector<ShRadiance> light =
      near ? light_at_points(field, surfaces, surfaces->radiance(radiance),
                             sent.subspan(s * surfaces->elements().size(), surfaces->elements().size()))
           : light_at_points(field, nullptr, {}, {});
  const Column at_points{exact_at_points, skies_.size(), s}, band4{band4_at_points, skies_.size(), s},
      at_probes{exact_at_probes, skies_.size(), s};
  LightField exact{std::vector<Sh9Rgb>(volume.probes.size())};
  Ratio sky_part, received, nine_leave, standing;
  PointRatios total, grid_part;
  std::vector<Ratio> room(rooms_.size());
  std::vector<std::size_t> room_of;
  for (std::size_t r = 0; r < rooms_.size(); ++r)
    room_of.insert(room_of.end(), rooms_[r].points.size(), r);
  for (std::size_t p = 0; p < probes.size(); ++p) {
    exact.probe[probes[p]] = at_probes.at(p);
    add(sky_part, field.probe[probes[p]], exact.probe[probes[p]]);
  }
  interpolate_probes(interpolated_, exact);
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Sh9Rgb truth = at_points.at(p);
    const ShRadiance all{truth, band4.at(p)}, &got = light[p];
    if (p >= in_air_) {
      add_irradiance(p < in_air_ + standing_ ? standing : room[room_of[p - in_air_ - standing_]], got, all);
      continue;
    }
    total.add(ratio_of(got.nine, truth));
    if (p % grid_step_ == 0)
      grid_part.add(ratio_of(sampler_.sample(exact, points_[p]).value_or(Sh9Rgb{}), truth));
    add_irradiance(received, got, all);
    add_irradiance(nine_leave, {truth, {}}, all);
  }
  std::vector<RoomError> rooms;
  for (std::size_t r = 0; r < room.size(); ++r) {
    const double values = kAxes * std::max(1.0, static_cast<double>(rooms_[r].points.size()));
    rooms.push_back({room[r].nrms(), std::sqrt(room[r].power2 / values)});
  }
  return {skies_[s].name,           skies_[s].is_sun, total.nrms(),      total.limited_nrms(), sky_part.nrms(),
          grid_part.limited_nrms(), received.nrms(),  nine_leave.nrms(), standing.nrms(),      std::move(rooms)};
}

/// One sky after another, and the exact coefficients at the points, kept for comparison with other meshes.
AuditReport Audit::judge(const BasisVolume& volume, std::span<const float> exact_at_points,
                         std::span<const float> band4_at_points, std::span<const float> exact_at_probes,
                         std::span<const std::size_t> probes, const FirstReflection* surfaces,
                         std::span<const Rgb> sent) const {
  const auto middle = points_.begin() + static_cast<std::ptrdiff_t>(in_air_);
  AuditReport report{{points_.begin(), middle},
                     {middle, middle + static_cast<std::ptrdiff_t>(standing_)},
                     std::vector<SkyError>(skies_.size()),
                     {},
                     rooms_};
  parallel_for(std::size_t{0}, skies_.size(), [&](std::size_t s) {
    report.sky[s] = judge_sky(s, volume, exact_at_points, band4_at_points, exact_at_probes, probes, surfaces, sent);
  });
  for (std::size_t s = 0; s < skies_.size(); ++s)
    for (std::size_t p = 0; p < in_air_; ++p) {
      const Sh9Rgb truth = Column{exact_at_points, skies_.size(), s}.at(p);
      for (std::size_t l = 0; l < 9; ++l)
        for (int c = 0; c < 3; ++c)
          report.exact.push_back(truth[l][c]);
    }
  return report;
}

} // namespace daylit::precompute
