#include "runtime/trace/self_visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

#include "runtime/sky/window_sampler.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr std::size_t kDirections = 256, kNearest = 4, kBits = 64;

/// Neighbours follow each other, so that a packet of rays stays together and mostly lies on one side of a surface.
std::vector<glm::vec3> even_directions() {
  std::vector<glm::vec3> directions;
  for (std::size_t i = 0; i < kDirections; ++i) {
    const glm::dvec2 u = lattice_point(static_cast<int>(i), static_cast<int>(kDirections));
    const double z = 1.0 - 2.0 * u.y, r = std::sqrt(std::max(0.0, 1.0 - z * z)), turn = 2.0 * std::numbers::pi * u.x;
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  const auto patch = [](const glm::vec3& w) {
    return std::pair(std::floor(2.0f * w.z), std::floor(2.0f * std::atan2(w.y, w.x) * std::numbers::inv_pi_v<float>));
  };
  std::stable_sort(directions.begin(), directions.end(),
                   [&](const glm::vec3& a, const glm::vec3& b) { return patch(a) < patch(b); });
  return directions;
}

std::array<std::size_t, kNearest> nearest(std::span<const glm::vec3> directions, const glm::vec3& w) {
  std::array<std::size_t, kNearest> index{};
  std::array<float, kNearest> cosine;
  cosine.fill(-2.0f);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const float c = glm::dot(directions[i], w);
    if (c <= cosine.back())
      continue;
    std::size_t k = kNearest - 1;
    for (; k > 0 && cosine[k - 1] < c; --k) {
      cosine[k] = cosine[k - 1];
      index[k] = index[k - 1];
    }
    cosine[k] = c;
    index[k] = i;
  }
  return index;
}

/// Bit j of word i becomes bit i of word j (Warren, "Hacker's Delight", section 7-3).
void transpose(std::array<std::uint64_t, kBits>& a) {
  std::uint64_t mask = 0x00000000FFFFFFFFull;
  for (std::size_t j = 32; j != 0; j >>= 1, mask ^= mask << j)
    for (std::size_t k = 0; k < kBits; k = (k + j + 1) & ~j) {
      const std::uint64_t t = ((a[k] >> j) ^ a[k + j]) & mask;
      a[k] ^= t << j;
      a[k + j] ^= t;
    }
}

} // namespace

SelfVisibility SelfVisibility::find(const PacketScene& scene, std::span<const glm::vec3> starts,
                                  std::span<const glm::vec3> normals) {
  SelfVisibility made;
  if (starts.empty() || starts.size() > kMostVertices)
    return made;
  made.vertices_ = starts.size();
  made.directions_ = even_directions();
  const std::size_t row = (starts.size() + kBits - 1) / kBits;
  made.blocked_.assign(kDirections, Row(row, 0));
  made.faced_ = made.blocked_;
  parallel_for(std::size_t{0}, row, [&](std::size_t word) {
    RayBlock rays;
    std::fill(rays.tnear, rays.tnear + kLanes, 0.0f);
    for (std::size_t v = word * kBits; v < std::min((word + 1) * kBits, starts.size()); ++v) {
      std::fill(rays.org_x, rays.org_x + kLanes, starts[v].x);
      std::fill(rays.org_y, rays.org_y + kLanes, starts[v].y);
      std::fill(rays.org_z, rays.org_z + kLanes, starts[v].z);
      for (std::size_t first = 0; first < kDirections; first += kLanes) {
        std::uint32_t faced = 0;
        for (std::size_t k = 0; k < kLanes; ++k) {
          const glm::vec3& w = made.directions_[first + k];
          rays.dir_x[k] = w.x;
          rays.dir_y[k] = w.y;
          rays.dir_z[k] = w.z;
          rays.tfar[k] = std::numeric_limits<float>::infinity();
          faced |= glm::dot(w, normals[v]) > 0.0f ? 1u << k : 0u;
        }
        const std::uint32_t blocked = scene.occluded(faced, rays);
        for (std::size_t k = 0; k < kLanes; ++k) {
          made.faced_[first + k][word] |= std::uint64_t{faced >> k & 1u} << v % kBits;
          made.blocked_[first + k][word] |= std::uint64_t{blocked >> k & 1u} << v % kBits;
        }
      }
    }
  });
  return made;
}

void SelfVisibility::set_lights(std::span<const glm::vec3> lights) {
  words_ = (lights.size() + kBits - 1) / kBits;
  const std::size_t row = (vertices_ + kBits - 1) / kBits;
  known_.assign(row * kBits * words_, {});
  std::vector<std::array<std::size_t, kNearest>> around;
  for (const glm::vec3& w : lights)
    around.push_back(nearest(directions_, w));
  parallel_for(std::size_t{0}, row, [&](std::size_t v) {
    std::array<std::uint64_t, kBits> clear, blocked; // one light in each, first
    for (std::size_t word = 0; word < words_; ++word) {
      clear.fill(0);
      blocked.fill(0);
      for (std::size_t j = word * kBits; j < std::min((word + 1) * kBits, lights.size()); ++j) {
        std::uint64_t all = ~std::uint64_t{0}, any = 0, faced = all;
        for (const std::size_t d : around[j]) {
          all &= blocked_[d][v];
          any |= blocked_[d][v];
          faced &= faced_[d][v];
        }
        clear[j % kBits] = faced & ~any;
        blocked[j % kBits] = faced & all;
      }
      transpose(clear);
      transpose(blocked);
      for (std::size_t k = 0; k < kBits; ++k)
        known_[(v * kBits + k) * words_ + word] = {clear[k], blocked[k]};
    }
  });
}

KnownLights SelfVisibility::at(const std::array<std::uint32_t, 3>& facet, std::size_t word) const {
  const KnownLights &a = known_[facet[0] * words_ + word], &b = known_[facet[1] * words_ + word],
                  &c = known_[facet[2] * words_ + word];
  return {a.clear & b.clear & c.clear, a.blocked & b.blocked & c.blocked};
}

} // namespace daylit
