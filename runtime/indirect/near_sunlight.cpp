#include "runtime/indirect/near_sunlight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/box_lattice.h"
#include "runtime/indirect/room_planes.h"
#include "scene/core/parallel.h"
#include "scene/volume/lit_piece.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

using Triangle = std::array<glm::dvec3, 3>;

constexpr int kSide = 12;       // points of the lattice
constexpr double kInset = 0.02; // of the box: floors touch it
constexpr double kFine = 0.5;   // longest edge of a piece, of its distance
constexpr double kLeast = 0.02; // the same, of half the box's diagonal,
constexpr double kDark = 0.2;   // and of pieces that lie in shadow
constexpr double kLift = 0.015; // the same: upwards off what a vertex may lie on, as far as the smallest pieces
constexpr double kKnown = 1.5;  // of the box's diagonal: what is further away is looked at point by point
constexpr double kReach = 2.0;  // of the distance of probes, as FirstReflection has it

double longest_edge(const Triangle& t) {
  return std::max({glm::distance(t[0], t[1]), glm::distance(t[1], t[2]), glm::distance(t[2], t[0])});
}

glm::dvec3 middle_of(const Triangle& t) { return (t[0] + t[1] + t[2]) / 3.0; }

double distance_to(const Bounds& box, const glm::dvec3& p) { return glm::distance(p, glm::clamp(p, box.min, box.max)); }

std::array<Triangle, 4> quarters(const Triangle& t) {
  const glm::dvec3 a = 0.5 * (t[0] + t[1]), b = 0.5 * (t[1] + t[2]), c = 0.5 * (t[2] + t[0]);
  return {Triangle{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}};
}

/// tan(omega / 2) = |a (b x c)| / (|a||b||c| + (a b)|c| + (b c)|a| + (c a)|b|) (Van Oosterom & Strackee 1983).
double solid_angle(const Triangle& t, const glm::dvec3& from) {
  const glm::dvec3 a = t[0] - from, b = t[1] - from, c = t[2] - from;
  const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
  return 2.0 * std::atan2(std::abs(glm::dot(a, glm::cross(b, c))),
                          la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
}

} // namespace

NearSunlight::NearSunlight(const BasisVolume& volume, const RayScene& rays, const ApertureCrossings& windows)
    : volume_(&volume), rays_(&rays), windows_(&windows), surfaces_(FirstReflection::make(volume, rays)) {}

/// Radiance of each element as the volume has it, the sun alone in the nodes around it.
std::vector<Rgb> NearSunlight::stored() const {
  const SkyPartition& sky = volume_->partition;
  std::vector<Rgb> node(static_cast<std::size_t>(sky.size()), Rgb(0.0f));
  for (const RegionWeight& w : sky.interpolation(*sun_))
    node[static_cast<std::size_t>(w.region)] += Rgb(static_cast<float>(w.weight / sky.solid_angle_sr(w.region)));
  return surfaces_->radiance(node);
}

/// L = rho / pi cos T V
Rgb NearSunlight::sunlit(const FirstReflection::Element& element, const glm::dvec3& point) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const double cosine = glm::dot(*sun_, element.normal);
  const glm::dvec3 from = point + kAirGap_m * element.normal;
  if (cosine <= 0.0 ||
      rays_->occluded(rays_->to_local(from), glm::vec3(*sun_), 0.0f, std::numeric_limits<float>::infinity()))
    return Rgb(0.0f);
  const Rgb past_objects = shadow_ ? shadow_->passed_by_objects(from, *sun_) : Rgb(1.0f);
  return past_objects * static_cast<float>(cosine * std::numbers::inv_pi) * element.reflectance *
         windows_->met(from, *sun_, kFar).transmittance;
}

double NearSunlight::longest_at(const glm::dvec3& point, const Bounds& box) const {
  const double half = 0.5 * glm::length(box.size()), to_box = distance_to(box, point);
  const double away = shadow_ && to_box < half ? shadow_->distance_to_objects(point, half) : to_box;
  return std::max(kFine * away, kLeast * half);
}

/// Cut until it is small beside its distance from the object, then as points of it are lit, times the part of the
/// object's corners that see it.
void NearSunlight::cut(std::uint32_t index, const FirstReflection::Element& element, const Bounds& box,
                       Pieces& pieces) const {
  const Triangle t = pieces.all[index].corner;
  const glm::dvec3 middle = middle_of(t);
  const double edge = longest_edge(t);
  const bool is_large = edge > longest_at(middle, box), may_be_dark = edge < 0.5 * kDark * glm::length(box.size());
  Rgb radiance(0.0f);
  if (!is_large || may_be_dark)
    radiance = mean_over_piece(t, [&](const glm::dvec3& point, int) { return sunlit(element, point); });
  if (is_large && !(may_be_dark && radiance == Rgb(0.0f))) {
    const auto first = static_cast<std::uint32_t>(pieces.all.size());
    Rgb sum(0.0f);
    for (const Triangle& part : quarters(t))
      pieces.all.push_back({part, element.normal, Rgb(0.0f), 0});
    for (std::uint32_t k = first; k < first + 4; ++k) {
      cut(k, element, box, pieces);
      sum += pieces.all[k].radiance;
    }
    pieces.all[index].radiance = 0.25f * sum;
    pieces.all[index].first_part = first;
    return;
  }
  if (radiance == Rgb(0.0f))
    return;
  const BoxLattice corners(box, 2, kInset);
  const glm::dvec3 from = middle + kAirGap_m * element.normal;
  int seen = 0;
  for (std::size_t k = 0; k < corners.point_count(); ++k) {
    const glm::dvec3 way = corners.position(k) - from;
    seen += glm::dot(way, element.normal) <= 0.0 || !rays_->occluded(rays_->to_local(from), glm::vec3(way), 0.0f, 1.0f);
  }
  pieces.all[index].radiance = static_cast<float>(seen) / static_cast<float>(corners.point_count()) * radiance;
}

NearSunlight::Pieces NearSunlight::pieces(std::span<const FirstReflection::Near> near, const Bounds& box) const {
  std::vector<Pieces> of(near.size());
  parallel_for(std::size_t{0}, near.size(), [&](std::size_t k) {
    const FirstReflection::Element& element = surfaces_->elements()[near[k].element];
    of[k].all.push_back({element.corner, element.normal, Rgb(0.0f), 0});
    cut(0, element, box, of[k]);
    for (Piece& p : of[k].all)
      p.radiance *= near[k].weight;
  });
  Pieces joined;
  for (Pieces& one : of) {
    const auto first = static_cast<std::uint32_t>(joined.all.size());
    if (one.all.front().radiance == Rgb(0.0f))
      continue;
    joined.whole.push_back(first);
    for (Piece& p : one.all) {
      p.first_part += p.first_part > 0 ? first : 0;
      joined.all.push_back(p);
    }
  }
  return joined;
}

/// work(corners, w, L omega) for each piece, w towards its middle; of those that are large beside their distance, for
/// their parts.
static void for_each_piece(const auto& pieces, const glm::dvec3& x, const auto& work) {
  std::vector<std::uint32_t> left = pieces.whole;
  while (!left.empty()) {
    const auto& p = pieces.all[left.back()];
    left.pop_back();
    const glm::dvec3 way = middle_of(p.corner) - x;
    if (p.radiance == Rgb(0.0f) || glm::dot(x - p.corner[0], p.normal) <= 0.0)
      continue;
    const double distance = glm::length(way);
    if (p.first_part > 0 && longest_edge(p.corner) > kFine * distance) {
      for (std::uint32_t k = 0; k < 4; ++k)
        left.push_back(p.first_part + k);
      continue;
    }
    work(p.corner, glm::vec3(way / distance), static_cast<float>(solid_angle(p.corner, x)) * p.radiance);
  }
}

/// L_lm = sum over the pieces of L omega Y_lm(w)
static Sh9Rgb light_of(const auto& pieces, const glm::dvec3& x) {
  Sh9Rgb sum{};
  for_each_piece(pieces, x, [&](const Triangle&, const glm::vec3& w, const Rgb& light) {
    const auto y = sh::evaluate9(w);
    for (std::size_t i = 0; i < 9; ++i)
      sum[i] += y[i] * light;
  });
  return sum;
}

static float product(const std::array<float, 9>& a, const TransferVector& b) {
  float sum = 0.0f;
  for (std::size_t i = 0; i < 9; ++i)
    sum += a[i] * b[i];
  return sum;
}

/// Off the surface that a foot stands on, and as far to its own side: what it looks at is a lit floor or a dark one.
static glm::dvec3 beside_foot(const glm::dvec3& x, const glm::dvec3& normal, double lift_m) {
  const glm::dvec2 level(normal);
  const double length = glm::length(level);
  return x + lift_m * glm::dvec3(length > 0.0 ? level / length : level, 1.0);
}

/// Delta E = sum over the pieces of L omega (k V cos + (1 - k) sum_lm Y_lm(w) C_lm) - sum_lm L_lm C_lm, V of the object
/// itself and k 1 near it: V cos of a piece is the mean over its quarters.
void NearSunlight::find_missed(const VirtualObjects& objects, std::span<const Pieces> pieces,
                               std::span<const Received> received) {
  for_each_side(objects, [&](const LitSide& side) {
    const Received& own = received[side.number];
    if (own.place == Place::nowhere)
      return;
    const Pieces& sunlit = pieces[side.part];
    const SurfacesKnown& around = around_[side.part];
    const bool at_foot = own.place == Place::at_foot;
    const glm::dvec3 x = at_foot ? beside_foot(side.position(), side.normal(), sunlit.lift_m) : side.position();
    const SenderSide seen = side.seen();
    const TransferVector& transfer = side.transfer();
    Rgb& missed = missed_[side.number][side.back];
    for_each_piece(sunlit, x, [&](const Triangle& corners, const glm::vec3& w, const Rgb& light) {
      const float far = around.share_beyond(middle_of(corners));
      float taken = 0.0f;
      if (far < 1.0f)
        for (const Triangle& part : quarters(corners))
          taken += 0.25f * (1.0f - far) * seen.visible_cosine(glm::vec3(glm::normalize(middle_of(part) - x)));
      if (far > 0.0f)
        taken += far * product(sh::evaluate9(w), transfer);
      missed += taken * light;
    });
    for (std::size_t i = 0; i < 9; ++i)
      missed -= transfer[i] * own.light[i];
  });
}

/// c(v) = N(v) - sum over probes of w_p N_stored(p): N between the points of a lattice around the object, what the
/// volume has of it exactly as it is interpolated there.
NearSunlight::Pieces NearSunlight::correct_part(const VirtualObjects& objects, std::size_t part,
                                                std::span<const VertexProbes> probes, std::span<const Rgb> stored,
                                                std::span<Received> received) {
  const std::span<const glm::dvec3> at(objects.senders.surface.positions);
  const auto [first, last] = of_part(objects.parts[part], objects.senders.vertex);
  Bounds box;
  std::map<std::uint32_t, Sh9Rgb> has; // what the volume has, by probe
  double farthest = 0.0;
  for (std::size_t v = first; v < last; ++v) {
    box.include(at[v]);
    for (int k = 0; k < probes[v].count; ++k) {
      has[probes[v].probe[k]] = {};
      farthest =
          std::max(farthest, glm::distance(at[v], volume_->probes.origin +
                                                      glm::dvec3(volume_->probes.positions[probes[v].probe[k]])));
    }
  }
  if (has.empty())
    return {};
  const double reach = kReach * farthest + glm::length(box.size());
  const auto near = surfaces_->near(box.centre(), reach, stored);
  if (near.empty())
    return {};
  around_[part] = {box.centre(), std::min(kKnown * glm::length(box.size()), 0.5 * reach)};
  std::vector<std::pair<const std::uint32_t, Sh9Rgb>*> wanted;
  for (auto& one : has)
    wanted.push_back(&one);
  parallel_for(std::size_t{0}, wanted.size(),
               [&](std::size_t k) { wanted[k]->second = surfaces_->at_probe(wanted[k]->first, near, stored).nine; });
  Pieces sunlit = pieces(near, box);
  const BoxLattice lattice(box, kSide, kInset);
  std::vector<Sh9Rgb> light(lattice.point_count());
  std::vector<std::uint8_t> used(lattice.point_count(), 0);
  for (std::size_t v = first; v < last; ++v)
    for (const BoxLattice::Corner& c : lattice.around(at[v]))
      used[c.point] = 1;
  parallel_for(std::size_t{0}, light.size(), [&](std::size_t k) {
    if (used[k])
      light[k] = light_of(sunlit, lattice.position(k));
  });
  const double lift = sunlit.lift_m = 0.5 * kLift * glm::length(box.size()), rim = kInset * box.size().z;
  const auto off_surfaces = [&](const glm::dvec3& x) {
    const auto away = static_cast<double>(rays_->distance(rays_->to_local(x), static_cast<float>(lift)));
    return x + glm::dvec3(0.0, 0.0, lift - std::min(away, lift));
  };
  parallel_for(first, last, [&](std::size_t v) {
    if (probes[v].count == 0)
      return;
    received[v].place = at[v].z < box.min.z + rim ? Place::at_foot : Place::within;
    if (received[v].place == Place::at_foot)
      unit_[v] = light_of(sunlit, off_surfaces(at[v]));
    else
      for (const BoxLattice::Corner& c : lattice.around(at[v]))
        for (std::size_t i = 0; i < 9; ++i)
          unit_[v][i] += c.weight * light[c.point][i];
    received[v].light = unit_[v];
    for (int k = 0; k < probes[v].count; ++k)
      for (std::size_t i = 0; i < 9; ++i)
        unit_[v][i] -= probes[v].weight[k] * has.at(probes[v].probe[k])[i];
  });
  return sunlit;
}

std::vector<Sh9Rgb> NearSunlight::correction(const VirtualObjects& objects, std::span<const VertexProbes> probes,
                                             std::uint64_t placement, const std::optional<DetectedSun>& sun,
                                             const IndirectShadow* objects_too) {
  std::vector<Sh9Rgb> light(probes.size());
  if (!sun || !surfaces_) {
    sun_.reset();
    missed_.clear();
    around_.clear();
    return light;
  }
  if (sun_ != sun->direction || placement_ != placement) {
    sun_ = sun->direction;
    placement_ = placement;
    shadow_ = objects_too;
    unit_.assign(probes.size(), {});
    missed_.assign(probes.size(), {Rgb(0.0f), Rgb(0.0f)});
    around_.assign(objects.parts.size(), {});
    const std::vector<Rgb> radiance = stored();
    std::vector<Pieces> pieces;
    std::vector<Received> received(probes.size());
    for (std::size_t part = 0; part < objects.parts.size(); ++part)
      pieces.push_back(correct_part(objects, part, probes, radiance, received));
    find_missed(objects, pieces, received);
  }
  normal_irradiance_ = sun->normal_irradiance;
  for (std::size_t v = 0; v < light.size(); ++v)
    for (std::size_t i = 0; i < 9; ++i)
      light[v][i] = sun->normal_irradiance * unit_[v][i];
  return light;
}

} // namespace daylit
