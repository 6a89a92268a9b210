#include "radiosity/detail/pair_visibility.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"

namespace daylit::radiosity {

namespace {

constexpr std::uint32_t kFewest = 4, kMost = 4096; // rays of a pair

/// Rays after which a pair of which all or none were blocked is left. From 32 on, what that misses is below the noise
/// of the pairs that go on, and as often too bright as too dark.
std::uint32_t scouts(std::uint32_t wanted) { return wanted < 64 ? wanted : std::max(32u, wanted / 4 / 16 * 16); }

FacingParts::Part fan_of(const SmallPolygon& p, const glm::dvec3& shift) {
  FacingParts::Part part;
  for (std::size_t k = 1; k + 1 < static_cast<std::size_t>(p.size) && part.count < 2; ++k) {
    const glm::dvec3 &a = p.corner[0], &b = p.corner[k], &c = p.corner[k + 1];
    part.triangle[part.count] = {glm::vec3(a + shift), glm::vec3(b + shift), glm::vec3(c + shift)};
    part.area[part.count++] = static_cast<float>(0.5 * glm::length(glm::cross(b - a, c - a)));
  }
  return part;
}

} // namespace

FacingParts::FacingParts(const SmallPolygon& a, const SmallPolygon& b, const glm::dvec3& shift)
    : from(fan_of(a, shift)), to(fan_of(b, shift)) {}

/// Corner and edges of both triangles; of parts, the pair of triangles whose turn it is, and `index` in its sequence.
void PairVisibility::set_triangles(std::size_t lane, const PairQuery& query, std::uint32_t& index) {
  lanes_.scale[lane] = 1.0f;
  if (query.parts < 0) {
    const auto whole = [&](float(*out)[16], std::uint32_t i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float corner = arrays_.corner[axis][i];
        out[axis][lane] = corner;
        out[3 + axis][lane] = arrays_.corner[3 + axis][i] - corner;
        out[6 + axis][lane] = arrays_.corner[6 + axis][i] - corner;
      }
    };
    whole(lanes_.from, query.i);
    whole(lanes_.to, query.j);
    return;
  }
  const FacingParts& parts = (*parts_)[static_cast<std::size_t>(query.parts)];
  const std::uint32_t turns = parts.from.count * parts.to.count, turn = index % turns;
  index /= turns;
  const auto one = [&](float(*out)[16], const FacingParts::Part& part, std::uint32_t which) {
    const auto& t = part.triangle[which];
    for (int axis = 0; axis < 3; ++axis) {
      out[axis][lane] = t[0][axis];
      out[3 + axis][lane] = t[1][axis] - t[0][axis];
      out[6 + axis][lane] = t[2][axis] - t[0][axis];
    }
    lanes_.scale[lane] *= part.area[which];
  };
  one(lanes_.from, parts.from, turn % parts.from.count);
  one(lanes_.to, parts.to, turn / parts.from.count);
}

void PairVisibility::set_lane(std::size_t lane, const PairQuery& query, std::uint32_t index) {
  set_triangles(lane, query, index);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lanes_.normal_from[axis][lane] = arrays_.normal[axis][query.i];
    lanes_.normal_to[axis][lane] = arrays_.normal[axis][query.j];
  }
  const std::uint64_t a = mix_bits(query.seed), b = mix_bits(query.seed + 0x9E3779B97F4A7C15ull);
  const auto unit = [](std::uint64_t bits) { return static_cast<float>(bits & 0xFFFFFFu) * 0x1p-24f; };
  lanes_.shift[0][lane] = unit(a);
  lanes_.shift[1][lane] = unit(a >> 32);
  lanes_.shift[2][lane] = unit(b);
  lanes_.shift[3][lane] = unit(b >> 32);
  lanes_.index[lane] = index;
}

/// total = sum of the kernel over the rays, seen = over those that arrive; visibility = seen / total.
void PairVisibility::shoot(std::size_t lanes) {
  RayPacket16 packet;
  alignas(64) float weight[16];
  pair_rays(lanes_, 4.0f * scene_.surface_offset(), packet, weight);
  const std::uint32_t blocked = scene_.occluded16(packet, static_cast<int>(lanes));
  for (std::size_t k = 0; k < lanes; ++k) {
    Tally& t = tally_[slot_[k]];
    const float kernel = weight[k] * lanes_.scale[k];
    t.total += kernel;
    const std::uint32_t hit = blocked >> k & 1u;
    t.seen += hit != 0 ? 0.0f : kernel;
    t.blocked += hit;
  }
}

void PairVisibility::add_rays(const PairQuery& query, std::size_t slot, std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t k = first; k < last; ++k) {
    if (query.parts < 0 && used_ == 0 && k + 16 <= last && k > first && slot_[0] == slot && slot_[15] == slot) {
      for (std::uint32_t lane = 0; lane < 16; ++lane) // the lanes still hold this pair
        lanes_.index[lane] = k + lane;
      shoot(16);
      k += 15;
      continue;
    }
    slot_[used_] = slot;
    set_lane(used_, query, k);
    if (++used_ == 16) {
      shoot(16);
      used_ = 0;
    }
  }
}

void PairVisibility::flush(const PairQuery& any) {
  for (std::size_t lane = used_; lane < 16 && used_ > 0; ++lane) // defined values in idle lanes
    set_lane(lane, any, 0);
  if (used_ > 0)
    shoot(used_);
  used_ = 0;
}

/// N = rays * form factor, between 4 and 4096: the error of a pair ~ F / sqrt(N) then adds up evenly over its row.
std::uint64_t PairVisibility::resolve(std::vector<PairQuery>& queries, const std::vector<FacingParts>& parts) {
  parts_ = &parts;
  tally_.assign(queries.size(), {});
  const auto wanted = [&](const PairQuery& q) {
    const double rays = std::min(rays_ * static_cast<double>(q.form_factor), static_cast<double>(kMost));
    return std::clamp(static_cast<std::uint32_t>(rays), q.near ? 16u : kFewest, kMost);
  };
  std::uint64_t rays = 0;
  const auto shoot_range = [&](std::size_t q, std::uint32_t first, std::uint32_t last) {
    add_rays(queries[q], q, first, last);
    rays += last - first;
  };
  for (std::size_t q = 0; q < queries.size(); ++q)
    shoot_range(q, 0, scouts(wanted(queries[q])));
  flush(queries.back());
  for (std::size_t q = 0; q < queries.size(); ++q) {
    const std::uint32_t all = wanted(queries[q]), first = scouts(all);
    if (first < all && tally_[q].blocked != 0 && tally_[q].blocked != first)
      shoot_range(q, first, all);
  }
  flush(queries.back());
  for (std::size_t q = 0; q < queries.size(); ++q)
    queries[q].visibility = tally_[q].total > 0.0f ? tally_[q].seen / tally_[q].total : 0.0f;
  return rays;
}

} // namespace daylit::radiosity
