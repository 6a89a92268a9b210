#include "simulate/irradiance.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <tbb/parallel_for.h>

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

/// Runs body(receiver, batch, key, samples in the batch) for all pairs; every pair writes its own place.
template <class Body>
Result<void> for_each_batch(std::size_t receivers, const IrradianceSettings& settings, const Progress& progress,
                            const Body& body) {
  if (settings.samples < kBatches)
    return Error{ErrorCode::usage, "too few samples per point", "--spp", "use at least 16"};
  const std::size_t jobs = receivers * kBatches;
  const int per_batch = (settings.samples + kBatches - 1) / kBatches;
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, jobs, [&](std::size_t job) {
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

} // namespace

Result<std::vector<IrradianceEstimate>> trace_irradiance(const TraceScene& scene, std::span<const Receiver> receivers,
                                                         const IrradianceSettings& settings, const Progress& progress) {
  const PathTracer tracer(scene);
  std::vector<BatchMeans<1>> sums(receivers.size());
  const auto batch = [&](std::uint32_t r, std::uint32_t b, std::uint32_t key, int count) {
    const glm::vec3 point = scene.to_local(receivers[r].position), normal(receivers[r].normal);
    glm::dvec3 sum(0.0);
    for (int i = 0; i < count; ++i) {
      const auto index = static_cast<std::uint32_t>(i);
      if (settings.indirect)
        sum += glm::dvec3(tracer.indirect_irradiance(point, normal, SampleStream(key, index), false).value);
      if (settings.direct)
        sum += glm::dvec3(
            tracer.direct_irradiance(point, normal, SampleStream(combine_keys(key, kDirectKey), index), false).value);
    }
    sums[r].batch[b][0] = sum / static_cast<double>(count);
  };
  if (const auto done = for_each_batch(receivers.size(), settings, progress, batch); !done)
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
  std::vector<BatchMeans<9>> sums(receivers.size());
  const auto batch = [&](std::uint32_t r, std::uint32_t b, std::uint32_t key, int count) {
    const glm::vec3 point = scene.to_local(receivers[r].position);
    std::array<glm::dvec3, 9> sum{};
    for (int i = 0; i < count; ++i) {
      const SampleStream samples(key, static_cast<std::uint32_t>(i));
      const glm::vec3 direction = uniform_direction(samples.point(0));
      const PathResult path = settings.direct ? tracer.radiance(point, direction, samples, false)
                                              : tracer.indirect_radiance(point, direction, samples, false);
      const auto basis = sh::evaluate9(glm::dvec3(direction));
      for (std::size_t k = 0; k < 9; ++k)
        sum[k] += basis[k] * glm::dvec3(path.value);
    }
    for (std::size_t k = 0; k < 9; ++k)
      sums[r].batch[b][k] = sum[k] * (4.0 * kPi / count);
  };
  if (const auto done = for_each_batch(receivers.size(), settings, progress, batch); !done)
    return done.error();
  std::vector<CoefficientEstimate> result;
  for (const auto& s : sums)
    result.push_back({s.mean(), s.standard_error()});
  return result;
}

} // namespace daylit
