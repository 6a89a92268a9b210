#include "runtime/object/relight.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include <glm/common.hpp>

#include "runtime/base/sh_rotation.h"
#include "scene/core/parallel.h"
#include "sh/sh9.h"

namespace daylit {

/// C'_l = D_l(R) C_l, band by band (Ivanic & Ruedenberg 1996 for any l; base/sh_rotation.h for l <= 2).
void rotate_transfer(std::span<const VertexTransfer> transfer, const glm::mat3& r, std::span<VertexTransfer> turned) {
  const Rotation9 rotation(r);
  parallel_for(tbb::blocked_range<std::size_t>(0, transfer.size(), 512), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const VertexTransfer& t = transfer[i];
      turned[i] = {rotation(t.front), t.back != TransferVector{} ? rotation(t.back) : t.back};
    }
  });
}

namespace {

/// sum_lm L_lm C_lm, the integral of two functions in an orthonormal basis.
Rgb dot9(const Sh9Rgb& light, const TransferVector& transfer) {
  Rgb sum(0.0f);
  for (int i = 0; i < 9; ++i)
    sum += light[i] * transfer[i];
  return sum;
}

/// What a chunk of vertices has of ringing: chunks are added in order, so that threads do not show.
struct RingingSum {
  std::size_t vertices = 0;
  double added = 0.0, all = 0.0;
  void add(const Rgb& irradiance) {
    const Rgb cut = glm::max(-irradiance, Rgb(0.0f)), kept = glm::max(irradiance, Rgb(0.0f));
    const float sum = cut.r + cut.g + cut.b;
    vertices += sum > 0.0f ? 1 : 0;
    added += static_cast<double>(sum);
    all += static_cast<double>(kept.r + kept.g + kept.b);
  }
};

Ringing total(std::span<const RingingSum> chunks) {
  RingingSum sum;
  for (const RingingSum& c : chunks) {
    sum.vertices += c.vertices;
    sum.added += c.added;
    sum.all += c.all;
  }
  return {sum.vertices, sum.all > 0.0 ? sum.added / sum.all : 0.0};
}

constexpr std::size_t kChunk = 256; ///< vertices

} // namespace

/// Equation 5 of Grosch et al. 2007.
Rgb reflected_radiance(const Sh9Rgb& light, const TransferVector& transfer, const Rgb& reflectance) {
  return glm::max(reflectance * dot9(light, transfer) * std::numbers::inv_pi_v<float>, Rgb(0.0f));
}

/// L + rho / pi sum_lm dL_lm C_lm.
Rgb add_reflected(const Rgb& radiance, const Sh9Rgb& change, const TransferVector& transfer, const Rgb& reflectance) {
  return glm::max(radiance + reflectance * dot9(change, transfer) * std::numbers::inv_pi_v<float>, Rgb(0.0f));
}

std::vector<VertexProbes> find_vertex_probes(const LightFieldSampler& sampler, std::span<const glm::dvec3> positions) {
  std::vector<VertexProbes> probes(positions.size());
  parallel_for(tbb::blocked_range<std::size_t>(0, positions.size(), 64), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      probes[i].count = sampler.weights(positions[i], probes[i].probe, probes[i].weight);
  });
  return probes;
}

/// Breadth-first over the mesh from all lit vertices at once.
std::size_t spread_vertex_probes(std::span<const std::array<std::uint32_t, 3>> triangles,
                                 std::vector<VertexProbes>& probes) {
  const auto without = static_cast<std::size_t>(
      std::count_if(probes.begin(), probes.end(), [](const VertexProbes& p) { return p.count == 0; }));
  if (without == 0 || without == probes.size())
    return without;
  std::vector<std::uint32_t> first(probes.size() + 1, 0), around; // triangles at each vertex
  for (const auto& t : triangles)
    for (const std::uint32_t v : t)
      ++first[v + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  around.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    for (const std::uint32_t v : triangles[i])
      around[next[v]++] = i;
  std::vector<std::uint32_t> ring; // grows from the border of the lit vertices inwards, in order
  for (std::uint32_t v = 0; v < probes.size(); ++v)
    if (probes[v].count > 0)
      ring.push_back(v);
  for (std::size_t k = 0; k < ring.size(); ++k)
    for (std::uint32_t i = first[ring[k]]; i < first[ring[k] + 1]; ++i)
      for (const std::uint32_t v : triangles[around[i]])
        if (probes[v].count == 0) {
          probes[v] = probes[ring[k]];
          ring.push_back(v);
        }
  return without;
}

std::vector<Sh9Rgb> light_between(const LightField& field, std::span<const VertexProbes> probes) {
  std::vector<Sh9Rgb> light(probes.size());
  parallel_for(tbb::blocked_range<std::size_t>(0, probes.size(), kChunk), [&](const auto& range) {
    for (std::size_t v = range.begin(); v != range.end(); ++v)
      for (int k = 0; k < probes[v].count; ++k)
        for (std::size_t c = 0; c < 9; ++c)
          light[v][c] += probes[v].weight[k] * field.probe[probes[v].probe[k]][c];
  });
  return light;
}

/// Each side: rho / pi sum L_lm C_lm.
TwoSided relight_vertex(const Sh9Rgb& light, const VertexTransfer& t, const Rgb& rho) {
  return {reflected_radiance(light, t.front, rho), reflected_radiance(light, t.back, rho)};
}

std::vector<TwoSided> relight_vertices(std::span<const Sh9Rgb> light, std::span<const VertexTransfer> world_transfer,
                                       std::span<const Rgb> reflectance, Ringing* ringing) {
  std::vector<TwoSided> radiance(light.size());
  std::vector<RingingSum> chunks((light.size() + kChunk - 1) / kChunk);
  parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t chunk) {
    for (std::size_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, light.size()); ++i) {
      chunks[chunk].add(dot9(light[i], world_transfer[i].front));
      radiance[i] = relight_vertex(light[i], world_transfer[i], reflectance[i]);
    }
  });
  if (ringing)
    *ringing = total(chunks);
  return radiance;
}

} // namespace daylit
