#include "calibration/material_samples.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <span>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit::calibration {

namespace {

constexpr std::size_t kOfMaterial = 600; ///< samples of one material in one view
constexpr std::size_t kLooked = 160000;  ///< pixels of a view that are looked at
constexpr std::uint32_t kTiles = 6;      ///< across and down a picture
constexpr double kEdge_px = 1.5;
constexpr double kFlat = 0.999; ///< cosine between normals on one surface

/// A fixed shuffle of the pixels: 32-bit finaliser of MurmurHash3.
std::uint32_t hashed(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x85ebca6bu;
  x = (x ^ (x >> 13)) * 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/// Pixels in a fixed random order.
std::vector<std::uint32_t> some_pixels(const MaterialView& view) {
  std::vector<std::uint32_t> pixels(view.left_out.size());
  std::iota(pixels.begin(), pixels.end(), 0u);
  std::ranges::sort(pixels, {}, [](std::uint32_t i) { return hashed(i); });
  pixels.resize(std::min(pixels.size(), kLooked));
  return pixels;
}

struct Pixel {
  std::uint32_t index = 0;
  std::optional<SurfacePoint> at;
};

glm::dvec2 position(const MaterialView& view, std::uint32_t index) {
  const auto width = static_cast<std::uint32_t>(view.radiance.width);
  return {index % width, index / width};
}

/// Whether everything within kEdge_px of a pixel is the same flat surface.
bool inside_surface(const MaterialView& view, const RoomTransport& transport, const glm::dvec2& pixel,
                    const SurfacePoint& at) {
  const glm::dvec3 eye(view.world_from_camera[3]);
  for (const glm::dvec2& step : {glm::dvec2(1, 1), glm::dvec2(-1, 1), glm::dvec2(1, -1), glm::dvec2(-1, -1)}) {
    const auto d = pixel_direction(view, pixel + kEdge_px * step);
    const auto beside = d ? transport.first_surface(eye, *d) : std::nullopt;
    if (!beside || beside->material != at.material || beside->patch < 0 || glm::dot(beside->normal, at.normal) < kFlat)
      return false;
  }
  return true;
}

std::uint32_t tile_of(const MaterialView& view, const glm::dvec2& pixel) {
  const auto x = static_cast<std::uint32_t>(pixel.x * kTiles / view.radiance.width);
  const auto y = static_cast<std::uint32_t>(pixel.y * kTiles / view.radiance.height);
  return y * kTiles + x;
}

/// What a view's pixels show, at most kOfMaterial of a material.
std::vector<std::pair<MaterialSample, SurfacePoint>> points_of_view(const MaterialScene& scene, std::size_t v,
                                                                    const RoomTransport& transport,
                                                                    std::vector<double>& coverage, double& over_range) {
  const MaterialView& view = scene.views[v];
  const glm::dvec3 eye(view.world_from_camera[3]);
  const std::vector<std::uint32_t> looked = some_pixels(view);
  std::vector<Pixel> pixels(looked.size());
  parallel_for(std::size_t{0}, looked.size(), [&](std::size_t k) {
    const auto d = pixel_direction(view, position(view, looked[k]));
    pixels[k] = {looked[k], d ? transport.first_surface(eye, *d) : std::nullopt};
  });
  coverage.assign(scene.room.room.materials.size(), 0.0);
  std::vector<std::size_t> taken(coverage.size(), 0);
  std::vector<std::pair<MaterialSample, SurfacePoint>> points;
  double surface = 1e-30;
  for (const Pixel& p : pixels) {
    if (!p.at || p.at->patch < 0)
      continue;
    const std::uint32_t m = p.at->material;
    coverage[m] += 1.0 / static_cast<double>(pixels.size());
    ++surface;
    over_range += view.left_out[p.index] == MaterialView::kOverRange ? 1 : 0;
    const Rgb& measured = view.radiance.texels[p.index];
    const glm::dvec2 pixel = position(view, p.index);
    if (taken[m] >= kOfMaterial || view.left_out[p.index] || std::min({measured.r, measured.g, measured.b}) <= 0.0f ||
        !inside_surface(view, transport, pixel, *p.at))
      continue;
    ++taken[m];
    const auto tile = static_cast<std::uint32_t>(v) * kTiles * kTiles + tile_of(view, pixel);
    points.push_back({{static_cast<std::uint32_t>(v), m, tile, measured, Rgb(0.0f), glm::vec2(pixel)}, *p.at});
  }
  over_range /= surface;
  return points;
}

} // namespace

std::optional<glm::dvec3> pixel_direction(const MaterialView& view, const glm::dvec2& pixel) {
  const auto d = view.lens.unproject(pixel);
  return d ? std::optional(glm::normalize(glm::dmat3(view.world_from_camera) * *d)) : std::nullopt;
}

Result<MaterialSamples> sample_materials(const MaterialScene& scene, const RoomTransport& transport,
                                         const Progress& progress) {
  MaterialSamples samples;
  std::vector<SurfacePoint> at;
  samples.coverage.resize(scene.views.size());
  samples.over_range.resize(scene.views.size());
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    for (const auto& [sample, point] :
         points_of_view(scene, v, transport, samples.coverage[v], samples.over_range[v])) {
      samples.list.push_back(sample);
      at.push_back(point);
    }
  samples.patch.resize(at.size() * MaterialSamples::kRays);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stopped{false};
  parallel_for(std::size_t{0}, at.size(), [&](std::size_t i) {
    if (stopped)
      return;
    MaterialSample& sample = samples.list[i];
    sample.direct = transport.direct(at[i], scene.views[sample.view].sky);
    transport.gather(at[i], hashed(static_cast<std::uint32_t>(i)) % 65536,
                     std::span(samples.patch).subspan(i * MaterialSamples::kRays, MaterialSamples::kRays));
    if (!progress("light at the pixels", static_cast<double>(++done) / static_cast<double>(at.size())))
      stopped = true;
  });
  if (stopped)
    return interrupted_error("light at the pixels");
  return samples;
}

} // namespace daylit::calibration
