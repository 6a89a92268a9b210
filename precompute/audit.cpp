#include "precompute/audit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
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
constexpr int kSunsOfBand = 2, kSunsOfBandInRoom = 3, kMostInRooms = 18; ///< of a band, the last of all rooms together
constexpr double kSkyOfSun = 1.0 / 7; ///< of a clear day: diffuse and direct light that a plane facing it receives
constexpr double kAxes = 6 * 3;       ///< values of irradiance at a point
constexpr double kClearance = 0.04;   ///< of the room's longest side: nearer to a facet its own shape shows

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

/// a + part b
ShRadiance sum(ShRadiance a, float part, const ShRadiance& b) {
  for (std::size_t k = 0; k < 9; ++k) {
    a.nine[k] += part * b.nine[k];
    a.band4[k] += part * b.band4[k];
  }
  return a;
}

/// Radiance of the uniform sky around a sun: its irradiance on a plane, pi L, is kSkyOfSun of the sun's own.
float sky_around(const HeldOutSky& sky) {
  double sun = 0;
  for (int r = 0; sky.is_sun && r < held_out_partition().size(); ++r)
    sun += static_cast<double>(sky.radiance[static_cast<std::size_t>(r)]) * held_out_partition().solid_angle_sr(r);
  return static_cast<float>(kSkyOfSun * sun / std::numbers::pi);
}

/// a + part b
SixIrradiances sum(SixIrradiances a, float part, const SixIrradiances& b) {
  for (std::size_t k = 0; k < a.size(); ++k)
    a[k] += part * b[k];
  return a;
}

/// Of coefficients to order 4 where they are there.
SixIrradiances irradiances(const ShRadiance& light) {
  SixIrradiances out;
  for (int axis = 0; axis < 6; ++axis) {
    glm::vec3 n(0.0f);
    n[axis / 2] = axis % 2 == 0 ? 1.0f : -1.0f;
    out[static_cast<std::size_t>(axis)] = irradiance(light, n);
  }
  return out;
}

void add_irradiance(Ratio& ratio, const ShRadiance& value, const SixIrradiances& truth) {
  const SixIrradiances got = irradiances(value);
  for (std::size_t axis = 0; axis < got.size(); ++axis)
    for (int c = 0; c < 3; ++c)
      ratio.add(static_cast<double>(got[axis][c]), static_cast<double>(truth[axis][c]));
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

/// One sky's light at the points, taken directly.
struct Audit::PointTruth {
  Column nine, band4, axes;
  SixIrradiances irradiance(std::size_t point) const {
    const Sh9Rgb rows = axes.at(point);
    SixIrradiances out;
    std::copy_n(rows.begin(), out.size(), out.begin());
    return out;
  }
};

Sh9Rgb Audit::Column::at(std::size_t point) const {
  Sh9Rgb out{};
  for (std::size_t l = 0; l < 9; ++l)
    for (int c = 0; c < 3; ++c)
      out[l][c] = values[((point * 9 + l) * 3 + static_cast<std::size_t>(c)) * columns + column];
  return out;
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
  const auto known = [&](const glm::dvec3& p) { return sampler->weights(p, probe, weight) > 0; };
  const auto keep = [&](const std::vector<glm::dvec3>& list) {
    const std::size_t most = audit.points_.size() + kPoints;
    for (const glm::dvec3& p : list)
      if (audit.points_.size() < most && known(p))
        audit.points_.push_back(p);
  };
  keep(candidates);
  audit.in_air_ = audit.points_.size();
  keep(standing);
  audit.standing_ = audit.points_.size() - audit.in_air_;
  for (const RoomPoints& one : rooms) {
    RoomPoints& kept = audit.rooms_.emplace_back(RoomPoints{one.box});
    for (std::size_t p = 0; p < one.points.size(); ++p)
      if (known(one.points[p])) {
        kept.points.push_back(one.points[p]);
        kept.weight.push_back(one.weight[p]);
      }
    audit.points_.insert(audit.points_.end(), kept.points.begin(), kept.points.end());
  }
  return audit;
}

std::array<std::size_t, 2> Audit::range_of_room(std::size_t room) const {
  std::size_t first = in_air_ + standing_;
  for (std::size_t r = 0; r < room; ++r)
    first += rooms_[r].points.size();
  return {first, first + rooms_[room].points.size()};
}

/// The smooth skies, and suns where they come in. The weight of an element for all: importance times area.
radiosity::FirstBounce Audit::direct_light(std::span<const radiosity::FirstBounceRow> light,
                                           const radiosity::PatchSet& set,
                                           std::span<const std::vector<double>> in_room) {
  skies_ = smooth_skies();
  std::vector<double> weight;
  for (const radiosity::Patch& e : set.patches)
    weight.push_back(static_cast<double>(e.importance) * e.area_m2);
  for (HeldOutSky& sun : suns(light, weight, kSunsOfBand))
    skies_.push_back(std::move(sun));
  const int of_band = std::clamp(kMostInRooms / std::max(1, static_cast<int>(in_room.size())), 1, kSunsOfBandInRoom);
  for (const std::vector<double>& weight_there : in_room)
    for (HeldOutSky& sun : suns(light, weight_there, of_band)) {
      sun.of_room = true;
      if (std::ranges::none_of(skies_, [&](const HeldOutSky& s) { return s.radiance == sun.radiance; }))
        skies_.push_back(std::move(sun));
    }
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

/// Of each point with the elements that any sky lights.
std::vector<FirstReflection::Exchange> Audit::near_surfaces(const SentLight& sent) const {
  if (!sent.surfaces)
    return {};
  const std::size_t elements = sent.surfaces->elements().size();
  std::vector<Rgb> lit(elements, Rgb(0.0f));
  for (std::size_t k = 0; k < sent.radiance.size(); ++k)
    lit[k % elements] += sent.radiance[k];
  std::vector<FirstReflection::Exchange> near(points_.size());
  parallel_for(std::size_t{0}, points_.size(), [&](std::size_t p) {
    std::array<std::uint32_t, 8> probe;
    std::array<float, 8> weight;
    const auto used = static_cast<std::size_t>(sampler_.weights(points_[p], probe, weight));
    near[p] = sent.surfaces->exchange(points_[p], std::span(probe).first(used), std::span(weight).first(used), lit);
  });
  return near;
}

/// Of the volume, corrected by what the surfaces near a point send it; 0 where it knows none.
std::vector<ShRadiance> Audit::light_at_points(std::size_t s, const LightField& field, std::span<const Rgb> radiance,
                                               const SentLight& sent,
                                               std::span<const FirstReflection::Exchange> near) const {
  const std::size_t first = skies_[s].of_room ? in_air_ + standing_ : 0;
  const std::vector<Rgb> stored = sent.surfaces ? sent.surfaces->radiance(radiance) : std::vector<Rgb>{};
  const std::span<const Rgb> actual = sent.radiance.subspan(s * stored.size(), stored.size());
  std::vector<ShRadiance> light(points_.size());
  parallel_for(first, points_.size(), [&](std::size_t p) {
    const auto here = sampler_.sample_all(field, points_[p]);
    if (!here)
      return;
    light[p] = *here;
    if (near.empty())
      return;
    ShRadiance more = FirstReflection::correction(near[p], stored, actual);
    if (field.band4.empty())
      more.band4 = {};
    light[p] += more;
  });
  return light;
}

/// Irradiance where objects stand. A sun is judged with the uniform sky around it, `sky_part` of it.
double Audit::judge_standing(const NearLight& light, const NearLight& uniform, float sky_part) const {
  Ratio all;
  for (std::size_t p = 0; p < standing_; ++p)
    add_irradiance(all, sum(light.got[p], sky_part, uniform.got[p]), sum(light.exact[p], sky_part, uniform.exact[p]));
  return all.nrms();
}

/// Irradiance room by room, each point counting by the part of the room it stands for. A sun is judged with the uniform
/// sky around it, `sky_part` of it; the light that is told is the sun's alone.
std::vector<RoomError> Audit::judge_rooms(const NearLight& light, const NearLight& uniform, float sky_part) const {
  std::vector<RoomError> errors;
  std::size_t p = standing_;
  for (const RoomPoints& room : rooms_) {
    Ratio all;
    double power2 = 0, weights = 0;
    for (const double weight : room.weight) {
      Ratio alone, with_sky;
      add_irradiance(alone, light.got[p], light.exact[p]);
      add_irradiance(with_sky, sum(light.got[p], sky_part, uniform.got[p]),
                     sum(light.exact[p], sky_part, uniform.exact[p]));
      all.error2 += weight * with_sky.error2;
      all.power2 += weight * with_sky.power2;
      power2 += weight * alone.power2;
      weights += weight;
      ++p;
    }
    errors.push_back({all.nrms(), weights > 0 ? std::sqrt(power2 / (kAxes * weights)) : 0.0});
  }
  return errors;
}

/// Exact probes, interpolated, against truth at the points; and the volume's probes against the exact ones.
void Audit::judge_probes(const LightField& field, const Column& exact_at_probes, std::span<const std::size_t> probes,
                         const PointTruth& truth, SkyError& error) const {
  LightField exact{std::vector<Sh9Rgb>(field.probe.size())};
  Ratio sky_part;
  for (std::size_t p = 0; p < probes.size(); ++p) {
    exact.probe[probes[p]] = exact_at_probes.at(p);
    add(sky_part, field.probe[probes[p]], exact.probe[probes[p]]);
  }
  interpolate_probes(interpolated_, exact);
  PointRatios grid_part;
  for (std::size_t p = 0; p < in_air_; p += grid_step_)
    grid_part.add(ratio_of(sampler_.sample(exact, points_[p]).value_or(Sh9Rgb{}), truth.nine.at(p)));
  error.sky_part = sky_part.nrms();
  error.grid_part = grid_part.limited_nrms();
}

/// Volume against truth at the points in the air. band 4: nine true coefficients against order 4, as irradiance.
void Audit::judge_points(std::span<const ShRadiance> got, const PointTruth& truth, SkyError& error) const {
  Ratio received, nine_leave;
  PointRatios total;
  for (std::size_t p = 0; p < in_air_; ++p) {
    total.add(ratio_of(got[p].nine, truth.nine.at(p)));
    add_irradiance(received, got[p], truth.irradiance(p));
    add_irradiance(nine_leave, {truth.nine.at(p), {}}, irradiances({truth.nine.at(p), truth.band4.at(p)}));
  }
  error.total = total.nrms();
  error.limited = total.limited_nrms();
  error.irradiance = received.nrms();
  error.band4 = nine_leave.nrms();
}

SkyError Audit::judge_sky(std::size_t s, const BasisVolume& volume, const AuditTruth& truth, const SentLight& sent,
                          std::span<const FirstReflection::Exchange> surfaces, NearLight& near) const {
  std::vector<Rgb> radiance;
  for (const float r : radiance_on(volume.partition, skies_[s]))
    radiance.emplace_back(r);
  const LightField field = combine(volume, radiance, ShOrder::fourth);
  const std::vector<ShRadiance> light = light_at_points(s, field, radiance, sent, surfaces);
  const PointTruth here{{truth.at_points, skies_.size(), s},
                        {truth.band4_at_points, skies_.size(), s},
                        {truth.irradiance_at_points, skies_.size(), s}};
  for (std::size_t p = in_air_; p < points_.size(); ++p) {
    near.got.push_back(light[p]);
    near.exact.push_back(here.irradiance(p));
  }
  SkyError error{.sky = skies_[s].name, .is_sun = skies_[s].is_sun, .of_room = skies_[s].of_room};
  if (error.of_room)
    return error;
  judge_points(light, here, error);
  judge_probes(field, {truth.at_probes, skies_.size(), s}, truth.probes, here, error);
  return error;
}

/// One sky after another, the uniform one first, and the exact coefficients at the points, kept for comparison with
/// other meshes.
AuditReport Audit::judge(const BasisVolume& volume, const AuditTruth& truth, const SentLight& sent) const {
  const auto middle = points_.begin() + static_cast<std::ptrdiff_t>(in_air_);
  AuditReport report{{points_.begin(), middle},
                     {middle, middle + static_cast<std::ptrdiff_t>(standing_)},
                     std::vector<SkyError>(skies_.size()),
                     {},
                     rooms_};
  std::vector<NearLight> near(skies_.size());
  const std::vector<FirstReflection::Exchange> surfaces = near_surfaces(sent);
  parallel_for(std::size_t{0}, skies_.size(),
               [&](std::size_t s) { report.sky[s] = judge_sky(s, volume, truth, sent, surfaces, near[s]); });
  for (std::size_t s = 0; s < skies_.size(); ++s) {
    const float around = sky_around(skies_[s]);
    report.sky[s].rooms = judge_rooms(near[s], near[0], around);
    report.sky[s].standing = skies_[s].of_room ? 0.0 : judge_standing(near[s], near[0], around);
  }
  for (std::size_t s = 0; s < skies_.size(); ++s)
    for (std::size_t p = 0; p < in_air_; ++p) {
      const Sh9Rgb exact = Column{truth.at_points, skies_.size(), s}.at(p);
      for (std::size_t l = 0; l < 9; ++l)
        for (int c = 0; c < 3; ++c)
          report.exact.push_back(exact[l][c]);
    }
  return report;
}

} // namespace daylit::precompute
