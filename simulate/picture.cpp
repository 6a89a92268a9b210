#include "simulate/picture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "scene/core/parallel.h"
#include "simulate/path_tracer.h"

namespace daylit {

namespace {

constexpr int kPictureBatches = 8;
constexpr std::uint32_t kPixelPair = 0; // paths of a camera ray start at depth 1

// Both pictures share their noise there, so that a shadow, their ratio, needs fewer samples than the object.
constexpr int kShadowFraction = 4;
// A pixel counts as changed when, averaged over its neighbourhood, the object changes it by more than this.
constexpr float kVisibleChange = 0.01f;
constexpr int kNeighbourhood = 4, kMaskMargin = 2; // pixels

struct Camera {
  const LensModel& lens;
  glm::vec3 origin;
  glm::dmat3 world_from_camera;
};

PixelEstimate estimate_pixel(const PathTracer& tracer, const Camera& camera, int x, int y, int samples,
                             std::uint32_t seed) {
  const int per_batch = std::max(1, samples / kPictureBatches);
  const std::uint32_t pixel_key = combine_keys(seed, static_cast<std::uint32_t>(y * camera.lens.width_px + x));
  std::array<glm::dvec3, kPictureBatches> truth{};
  glm::dvec3 room_sum(0.0), truth_sum(0.0);
  int covered = 0;
  for (std::uint32_t b = 0; b < kPictureBatches; ++b) {
    for (int i = 0; i < per_batch; ++i) {
      const SampleStream stream(combine_keys(pixel_key, b), static_cast<std::uint32_t>(i));
      const glm::dvec2 jitter(stream.point(kPixelPair));
      const auto ray = camera.lens.unproject(glm::dvec2(x - 0.5, y - 0.5) + jitter);
      if (!ray)
        continue;
      const glm::vec3 direction(glm::normalize(camera.world_from_camera * *ray));
      const PathResult with = tracer.radiance(camera.origin, direction, stream, true);
      const PathResult without = with.touched ? tracer.radiance(camera.origin, direction, stream, false) : with;
      truth[b] += glm::dvec3(with.value);
      room_sum += glm::dvec3(without.value);
      covered += with.on_object ? 1 : 0;
    }
    truth_sum += truth[b];
  }
  const double total = static_cast<double>(per_batch) * kPictureBatches;
  glm::dvec3 spread(0.0);
  for (const glm::dvec3& t : truth) {
    const glm::dvec3 d = t / static_cast<double>(per_batch) - truth_sum / total;
    spread += d * d;
  }
  return {Rgb(room_sum / total), Rgb(truth_sum / total),
          Rgb(glm::sqrt(spread / static_cast<double>(kPictureBatches * (kPictureBatches - 1)))),
          static_cast<float>(covered / total)};
}

/// Sums over a square neighbourhood, by rows then columns.
std::vector<float> box_sum(const std::vector<float>& in, int width, int height, int radius) {
  std::vector<float> rows(in.size()), out(in.size());
  const auto pass = [&](const std::vector<float>& from, std::vector<float>& to, bool horizontal) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        float sum = 0.0f;
        for (int k = -radius; k <= radius; ++k) {
          const int xx = horizontal ? std::clamp(x + k, 0, width - 1) : x;
          const int yy = horizontal ? y : std::clamp(y + k, 0, height - 1);
          sum += from[static_cast<std::size_t>(yy) * width + xx];
        }
        to[static_cast<std::size_t>(y) * width + x] = sum;
      }
  };
  pass(in, rows, true);
  pass(rows, out, false);
  return out;
}

/// 2 where the object is, 1 where its effect can be seen, else 0.
std::vector<std::uint8_t> influence(const InteriorPictures& p) {
  const std::size_t n = p.room.texels.size();
  std::vector<float> change(n), level(n), cover(n);
  for (std::size_t i = 0; i < n; ++i) {
    change[i] = luminance(p.truth.texels[i]) - luminance(p.room.texels[i]);
    level[i] = luminance(p.room.texels[i]);
    cover[i] = p.coverage.texels[i].r;
  }
  change = box_sum(change, p.room.width, p.room.height, kNeighbourhood);
  level = box_sum(level, p.room.width, p.room.height, kNeighbourhood);
  cover = box_sum(cover, p.room.width, p.room.height, kMaskMargin);
  std::vector<std::uint8_t> influenced(n);
  for (std::size_t i = 0; i < n; ++i)
    influenced[i] = cover[i] > 0.0f ? 2 : std::abs(change[i]) > kVisibleChange * level[i] ? 1 : 0;
  return influenced;
}

void store(InteriorPictures& p, std::size_t i, const PixelEstimate& e) {
  p.room.texels[i] = e.room;
  p.truth.texels[i] = e.truth;
  p.truth_standard_error.texels[i] = e.standard_error;
  p.coverage.texels[i] = Rgb(e.coverage);
}

Result<void> check_settings(const TraceScene& scene, const PictureSettings& settings) {
  if (settings.base_samples < 2 * kPictureBatches || settings.samples < 2 * kPictureBatches)
    return Error{ErrorCode::usage, "too few samples per pixel", "--spp", "use at least 16"};
  if (!scene.has_object())
    return Error{ErrorCode::usage, "the scene has no object", "render_interior", ""};
  return {};
}

} // namespace

DepthPicture render_depth(const TraceScene& scene, const LensModel& lens, const glm::dmat4& world_from_camera) {
  DepthPicture depth{lens.width_px, lens.height_px, {}};
  depth.z_m.resize(static_cast<std::size_t>(lens.width_px) * static_cast<std::size_t>(lens.height_px));
  const glm::vec3 origin = scene.to_local(glm::dvec3(world_from_camera[3]));
  parallel_for(0, lens.height_px, [&](int y) {
    for (int x = 0; x < lens.width_px; ++x) {
      const auto ray = lens.unproject(glm::dvec2(x, y));
      if (!ray)
        continue;
      bool touched = false;
      const glm::vec3 direction(glm::normalize(glm::dmat3(world_from_camera) * *ray));
      if (const auto point = scene.closest(origin, direction, false, touched))
        depth.z_m[static_cast<std::size_t>(y) * lens.width_px + x] =
            std::max(point->distance * static_cast<float>(ray->z / glm::length(*ray)), 0.0f);
    }
  });
  return depth;
}

Result<std::vector<PixelEstimate>> render_pixels(const TraceScene& scene, const LensModel& lens,
                                                 const glm::dmat4& world_from_camera,
                                                 std::span<const glm::ivec2> pixels, const PictureSettings& settings,
                                                 const Progress& progress) {
  if (const auto good = check_settings(scene, settings); !good)
    return good.error();
  const PathTracer tracer(scene);
  const Camera camera{lens, scene.to_local(glm::dvec3(world_from_camera[3])), glm::dmat3(world_from_camera)};
  std::vector<PixelEstimate> estimates(pixels.size());
  std::atomic<bool> stop{false};
  std::atomic<std::size_t> done{0};
  parallel_for(std::size_t{0}, pixels.size(), [&](std::size_t i) {
    if (stop.load(std::memory_order_relaxed))
      return;
    const auto [x, y] = std::pair(pixels[i].x, pixels[i].y);
    PixelEstimate e = estimate_pixel(tracer, camera, x, y, settings.base_samples, settings.seed);
    // A single pixel has no neighbours to average: half the change that counts is enough to look closer.
    const float change = std::abs(luminance(e.truth) - luminance(e.room));
    if (e.coverage > 0.0f || change > 0.5f * kVisibleChange * luminance(e.room))
      e = estimate_pixel(tracer, camera, x, y, settings.samples, settings.seed);
    estimates[i] = e;
    if (const std::size_t n = ++done; progress && n % 64 == 0)
      if (!progress("pixels", static_cast<double>(n) / static_cast<double>(pixels.size())))
        stop.store(true);
  });
  if (stop.load())
    return interrupted_error("rendering");
  return estimates;
}

Result<InteriorPictures> render_interior(const TraceScene& scene, const LensModel& lens,
                                         const glm::dmat4& world_from_camera, const PictureSettings& settings,
                                         const Progress& progress) {
  if (const auto good = check_settings(scene, settings); !good)
    return good.error();
  const PathTracer tracer(scene);
  const Camera camera{lens, scene.to_local(glm::dvec3(world_from_camera[3])), glm::dmat3(world_from_camera)};
  const int width = lens.width_px, height = lens.height_px;
  InteriorPictures p;
  for (RgbImage* image : {&p.room, &p.truth, &p.truth_standard_error, &p.coverage})
    *image = RgbImage(width, height);
  std::atomic<bool> stop{false};
  const auto render = [&](const char* stage, int samples, const std::vector<std::uint8_t>& where, std::uint8_t wanted) {
    std::atomic<int> rows{0};
    parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width && !stop.load(std::memory_order_relaxed); ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        if (where[i] == wanted)
          store(p, i, estimate_pixel(tracer, camera, x, y, samples, settings.seed));
      }
      if (progress && !progress(stage, static_cast<double>(++rows) / height))
        stop.store(true);
    });
  };
  const int base = std::min(settings.samples, settings.base_samples);
  render("room", base, std::vector<std::uint8_t>(p.room.texels.size()), 0);
  const std::vector<std::uint8_t> influenced = influence(p);
  if (const int shadow = settings.samples / kShadowFraction; shadow > base && !stop.load())
    render("shadow", shadow, influenced, 1);
  if (settings.samples > base && !stop.load())
    render("object", settings.samples, influenced, 2);
  if (stop.load())
    return interrupted_error("rendering");
  const auto quiet = std::count(influenced.begin(), influenced.end(), 0);
  p.influenced_fraction = 1.0 - static_cast<double>(quiet) / static_cast<double>(influenced.size());
  return p;
}

} // namespace daylit
