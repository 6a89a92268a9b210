#include "runtime/object/self_exchange.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <utility>

#include "runtime/object/vertex_rays.h"
#include "scene/core/parallel.h"
#include "scene/core/parallel_stage.h"

namespace daylit {

namespace {

constexpr std::size_t kChunk = 64;
constexpr int kMostSteps = 12;
constexpr double kSettled = 0.01; // of all light

/// Of the corner nearest to the point where a ray ends.
std::uint32_t nearest_corner(const ObjectMesh& mesh, const SeenPoint& p) {
  const auto& t = mesh.triangles[p.triangle];
  const int first = 65535 - p.u - p.v;
  return first >= std::max(p.u, p.v) ? t[0] : p.u >= p.v ? t[1] : t[2];
}

double sum(const Rgb& light) { return static_cast<double>(light.r + light.g + light.b); }

} // namespace

/// One entry for each side of a sender that rays end on.
std::vector<SelfExchange::Seen> SelfExchange::row_of(const std::vector<SeenPoint>& seen, const ObjectMesh& mesh,
                                                     std::span<const std::uint32_t> sender, float weight) {
  std::vector<std::uint32_t> sides;
  for (const SeenPoint& p : seen)
    sides.push_back(2 * sender[nearest_corner(mesh, p)] + p.on_back);
  std::ranges::sort(sides);
  std::vector<Seen> row;
  for (const std::uint32_t side : sides) {
    if (row.empty() || row.back().side != side)
      row.push_back({side, 0.0f});
    row.back().weight += weight;
  }
  return row;
}

Result<SelfExchange> SelfExchange::make(const ObjectMesh& mesh, const RayScene& scene, const MeshSenders& senders,
                                        bool closed, const Progress& progress) {
  const VertexRays rays(mesh, scene, kRays);
  const float weight = std::numbers::pi_v<float> / static_cast<float>(rays.rays());
  const std::size_t count = senders.vertex.size();
  std::vector<std::vector<Seen>> rows(2 * count);
  SelfExchange exchange;
  exchange.visibility_ = SelfVisibility(rays, count);
  const auto looked = parallel_stage("light within objects", (count + kChunk - 1) / kChunk, 1, progress, [&](auto c) {
    for (std::size_t i = c * kChunk; i < std::min((c + 1) * kChunk, count); ++i) {
      const std::uint32_t v = senders.vertex[i];
      for (const bool back : {false, true}) {
        if (back && closed)
          continue;
        const SideView view = rays.look(v, back ? -mesh.normals[v] : mesh.normals[v]);
        rows[2 * i + back] = row_of(view.seen, mesh, senders.of, weight);
        exchange.visibility_.set(i, back, view);
      }
    }
  });
  if (!looked)
    return looked.error();
  exchange.first_.push_back(0);
  for (const std::vector<Seen>& row : rows) {
    exchange.seen_.insert(exchange.seen_.end(), row.begin(), row.end());
    exchange.first_.push_back(static_cast<std::uint32_t>(exchange.seen_.size()));
  }
  return exchange;
}

std::vector<TwoSided> SelfExchange::irradiance(std::span<const TwoSided> radiance) const {
  std::vector<TwoSided> found(radiance.size());
  if (empty())
    return found;
  const auto gather = [&](std::size_t row) {
    Rgb sum(0.0f);
    for (std::uint32_t k = first_[row]; k < first_[row + 1]; ++k) {
      const TwoSided& from = radiance[seen_[k].side / 2];
      sum += seen_[k].weight * (seen_[k].side % 2 == 0 ? from.front : from.back);
    }
    return sum;
  };
  parallel_for(tbb::blocked_range<std::size_t>(0, found.size(), kChunk), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      found[i] = {gather(2 * i), gather(2 * i + 1)};
  });
  return found;
}

void SelfExchange::reflect(std::span<const TwoSided> direct, std::span<const TwoSided> from_outside,
                           std::span<const Rgb> reflectance, std::span<TwoSided> radiance) const {
  if (empty()) {
    std::ranges::copy(from_outside, radiance.begin());
    return;
  }
  std::vector<TwoSided> leaving(radiance.size());
  double change = 1.0, all = 0.0;
  for (int step = 0; step < kMostSteps && change > kSettled * all; ++step) {
    for (std::size_t i = 0; i < leaving.size(); ++i)
      leaving[i] = {direct[i].front + radiance[i].front, direct[i].back + radiance[i].back};
    const std::vector<TwoSided> arriving = irradiance(leaving);
    change = all = 0.0;
    for (std::size_t i = 0; i < leaving.size(); ++i) {
      const Rgb rho = reflectance[i] * std::numbers::inv_pi_v<float>;
      const TwoSided next{from_outside[i].front + rho * arriving[i].front,
                          from_outside[i].back + rho * arriving[i].back};
      change += sum(glm::abs(next.front - radiance[i].front)) + sum(glm::abs(next.back - radiance[i].back));
      all += sum(next.front) + sum(next.back);
      radiance[i] = next;
    }
  }
}

} // namespace daylit
