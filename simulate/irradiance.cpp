#include "simulate/irradiance.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"
#include "sh/band4.h"
#include "sh/sh9.h"
#include "simulate/path_tracer.h"

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;
// Direct and indirect parts of one receiver draw from different sequences.
constexpr std::uint32_t kDirectKey = 0x44495243u;

/// Mean and standard error of kBatches values in double.
template <std::size_t N>
struct BatchMeans {
  std::array<std::array<glm::dvec3, N>, kBatches> batch{};

  std::array<Rgb, N> mean() const {
    std::array<Rgb, N> out;
    for (std::size_t k = 0; k < N; ++k)
      out[k] = Rgb(exact_mean(k));
    return out;
  }
  std::array<Rgb, N> standard_error() const {
    std::array<Rgb, N> out;
    for (std::size_t k = 0; k < N; ++k) {
      const glm::dvec3 m = exact_mean(k);
      glm::dvec3 spread(0.0);
      for (const auto& b : batch)
        spread += (b[k] - m) * (b[k] - m);
      out[k] = Rgb(glm::sqrt(spread / static_cast<double>(kBatches * (kBatches - 1))));
    }
    return out;
  }

private:
  glm::dvec3 exact_mean(std::size_t k) const {
    glm::dvec3 sum(0.0);
    for (const auto& b : batch)
      sum += b[k];
    return sum / static_cast<double>(kBatches);
  }
};

/// Runs body(receiver, batch, key, samples in the batch) for all pairs; every pair writes its own entry.
template <class Body>
Result<void> for_each_batch(std::size_t receivers, const IrradianceSettings& settings, const Progress& progress,
                            const Body& body) {
  if (settings.samples < kBatches)
    return Error{ErrorCode::usage, "too few samples per point", "--spp", "use at least 16"};
  const std::size_t jobs = receivers * kBatches;
  const int per_batch = (settings.samples + kBatches - 1) / kBatches;
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  parallel_for(std::size_t{0}, jobs, [&](std::size_t job) {
    if (stop.load(std::memory_order_relaxed))
      return;
    const auto receiver = static_cast<std::uint32_t>(job / kBatches),
               batch = static_cast<std::uint32_t>(job % kBatches);
    body(receiver, batch, combine_keys(combine_keys(settings.seed, receiver), batch), per_batch);
    const std::size_t finished = done.fetch_add(1) + 1;
    if (progress && !progress("paths", static_cast<double>(finished) / static_cast<double>(jobs)))
      stop.store(true);
  });
  if (stop.load())
    return interrupted_error("path tracing");
  return {};
}

glm::vec3 uniform_direction(const glm::vec2& u) {
  const float z = 1.0f - 2.0f * u.x, r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const float a = 2.0f * std::numbers::pi_v<float> * u.y;
  return {r * std::cos(a), r * std::sin(a), z};
}

// Receivers at one point share their paths.
constexpr std::size_t kLargestGroup = 8;
struct ReceiverGroup {
  std::size_t first = 0, count = 1;
};

std::vector<ReceiverGroup> group_receivers(std::span<const Receiver> receivers, bool joined) {
  std::vector<ReceiverGroup> groups;
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    ReceiverGroup* last = groups.empty() ? nullptr : &groups.back();
    if (joined && last && last->count < kLargestGroup && receivers[last->first].position == receivers[i].position)
      ++last->count;
    else
      groups.push_back({i, 1});
  }
  return groups;
}

/// Every path of every receiver of the group counts for all of them: the density is the mean of their cosine lobes,
/// sampled in equal parts (balance heuristic). A sun is found better from the receiver itself: there groups are
/// single.
void add_indirect(const TraceScene& scene, const PathTracer& tracer, std::span<const Receiver> group, std::uint32_t key,
                  int count, std::span<glm::dvec3> sum) {
  const glm::vec3 point = scene.to_local(group.front().position);
  for (std::uint32_t lobe = 0; lobe < group.size(); ++lobe)
    for (int i = 0; i < count; ++i) {
      const SampleStream samples(combine_keys(key, lobe), static_cast<std::uint32_t>(i));
      const glm::vec3 normal(group[lobe].normal);
      if (group.size() == 1) {
        sum[0] += glm::dvec3(tracer.indirect_irradiance(point, normal, samples, false).value);
        continue;
      }
      const glm::vec3 direction = sample_cosine(normal, samples.point(0));
      const glm::dvec3 radiance(tracer.indirect_radiance(point, direction, samples, false).value);
      std::array<double, kLargestGroup> cosine{};
      double lobes = 0.0;
      for (std::size_t k = 0; k < group.size(); ++k)
        lobes += cosine[k] = std::max(0.0, glm::dot(group[k].normal, glm::dvec3(direction)));
      for (std::size_t k = 0; k < group.size() && lobes > 0.0; ++k)
        sum[k] += radiance * (kPi * cosine[k] / lobes);
    }
}

void add_direct(const TraceScene& scene, const PathTracer& tracer, std::span<const Receiver> group, std::uint32_t key,
                int count, std::span<glm::dvec3> sum) {
  const glm::vec3 point = scene.to_local(group.front().position);
  for (std::uint32_t k = 0; k < group.size(); ++k)
    for (int i = 0; i < count; ++i) {
      const SampleStream samples(combine_keys(key, k), static_cast<std::uint32_t>(i));
      sum[k] += glm::dvec3(tracer.direct_irradiance(point, glm::vec3(group[k].normal), samples, false).value);
    }
}

} // namespace

Result<std::vector<IrradianceEstimate>> trace_irradiance(const TraceScene& scene, std::span<const Receiver> receivers,
                                                         const IrradianceSettings& settings, const Progress& progress) {
  const PathTracer tracer(scene);
  const std::vector<ReceiverGroup> groups = group_receivers(receivers, !scene.sky().sun());
  std::vector<BatchMeans<1>> sums(receivers.size());
  const auto batch = [&](std::uint32_t g, std::uint32_t b, std::uint32_t key, int count) {
    const std::span<const Receiver> group = receivers.subspan(groups[g].first, groups[g].count);
    std::array<glm::dvec3, kLargestGroup> sum{};
    if (settings.indirect)
      add_indirect(scene, tracer, group, key, count, sum);
    if (settings.direct)
      add_direct(scene, tracer, group, combine_keys(key, kDirectKey), count, sum);
    for (std::size_t k = 0; k < group.size(); ++k)
      sums[groups[g].first + k].batch[b][0] = sum[k] / static_cast<double>(count);
  };
  if (const auto done = for_each_batch(groups.size(), settings, progress, batch); !done)
    return done.error();
  std::vector<IrradianceEstimate> result;
  for (const auto& s : sums)
    result.push_back({s.mean()[0], s.standard_error()[0]});
  return result;
}

Result<std::vector<CoefficientEstimate>> trace_coefficients(const TraceScene& scene,
                                                            std::span<const Receiver> receivers,
                                                            const IrradianceSettings& settings,
                                                            const Progress& progress) {
  const PathTracer tracer(scene);
  constexpr std::size_t kNumbers = 18;
  std::vector<BatchMeans<kNumbers>> sums(receivers.size());
  const auto batch = [&](std::uint32_t r, std::uint32_t b, std::uint32_t key, int count) {
    const glm::vec3 point = scene.to_local(receivers[r].position);
    std::array<glm::dvec3, kNumbers> sum{};
    for (int i = 0; i < count; ++i) {
      const SampleStream samples(key, static_cast<std::uint32_t>(i));
      const glm::vec3 direction = uniform_direction(samples.point(0));
      const PathResult path = settings.direct ? tracer.radiance(point, direction, samples, false)
                                              : tracer.indirect_radiance(point, direction, samples, false);
      const auto low = sh::evaluate9(glm::dvec3(direction)), band4 = sh::evaluate_band4(glm::dvec3(direction));
      for (std::size_t k = 0; k < 9; ++k) {
        sum[k] += low[k] * glm::dvec3(path.value);
        sum[9 + k] += band4[k] * glm::dvec3(path.value);
      }
    }
    for (std::size_t k = 0; k < kNumbers; ++k)
      sums[r].batch[b][k] = sum[k] * (4.0 * kPi / count);
  };
  if (const auto done = for_each_batch(receivers.size(), settings, progress, batch); !done)
    return done.error();
  std::vector<CoefficientEstimate> result;
  for (const auto& s : sums) {
    const auto mean = s.mean(), error = s.standard_error();
    CoefficientEstimate& e = result.emplace_back();
    for (std::size_t k = 0; k < 9; ++k) {
      e.value[k] = mean[k];
      e.standard_error[k] = error[k];
      e.band4[k] = mean[9 + k];
      e.band4_error[k] = error[9 + k];
    }
  }
  return result;
}

} // namespace daylit
