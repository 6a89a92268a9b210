#include "precompute/probe_matrix.h"

#include <array>

#include <fmt/format.h>

#include "scene/core/parallel.h"
#include "scene/room/window_view.h"

namespace daylit::precompute {

namespace {

constexpr double kCell_sr = 2e-4; // as DirectSky
constexpr std::size_t kMostValues = std::size_t{1} << 28;

struct Interpolation {
  std::array<std::uint32_t, 8> probe{};
  std::array<float, 8> weight{};
  int count = 0;

  /// L_lm = sum_i weight_i L_lm(probe_i)
  ShRadiance sample(const LightField& field) const {
    ShRadiance sum;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
      for (std::size_t k = 0; k < 9; ++k) {
        sum.nine[k] += weight[i] * field.probe[probe[i]][k];
        if (!field.band4.empty())
          sum.band4[k] += weight[i] * field.band4[probe[i]][k];
      }
    return sum;
  }
};

Result<std::vector<Interpolation>> interpolations_of(const LightFieldSampler& sampler,
                                                     std::span<const ProbePoint> points) {
  std::vector<Interpolation> interpolations(points.size());
  parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    interpolations[i].count = sampler.weights(points[i].position, interpolations[i].probe, interpolations[i].weight);
  });
  for (std::size_t i = 0; i < interpolations.size(); ++i)
    if (interpolations[i].count == 0)
      return Error{ErrorCode::not_found, "the point is outside the room or inside furniture",
                   fmt::format("stdin, line {}", i + 1), "a matrix has no row for it; leave it out"};
  return interpolations;
}

/// Irradiance per radiance of the cells of the sky that a point sees: transmittance * cosine * solid angle.
void add_direct(const BasisVolume& volume, const RayScene& scene, std::span<const ProbePoint> points,
                const ReinhartPatches& patches, RadianceMatrix& matrix) {
  parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    const WindowView view(volume.room, volume.apertures, scene, points[i].position, points[i].normal);
    for (const SkyCell& cell : view.cells(kCell_sr))
      matrix.at(static_cast<int>(i), patches.patch_of(cell.direction)) += Rgb(cell.weight);
  });
}

} // namespace

/// Column by column: combine() of a sky that is 1 in one patch, then the interpolation of the points.
Result<RadianceMatrix> daylight_matrix(const BasisVolume& volume, const LightFieldSampler& sampler,
                                       const RayScene& scene, std::span<const ProbePoint> points,
                                       const ReinhartPatches& patches, MatrixContent content,
                                       const Progress& progress) {
  const std::size_t per_point = content.coefficients ? 9 : 1, columns = static_cast<std::size_t>(patches.size());
  if (points.empty() || points.size() > kMostValues / per_point / columns)
    return Error{ErrorCode::limit_exceeded,
                 fmt::format("{} points make no matrix of 1 to {} values", points.size(), kMostValues), "stdin",
                 "give fewer points or a coarser sky"};
  const Result<std::vector<Interpolation>> interpolations = interpolations_of(sampler, points);
  if (!interpolations)
    return interpolations.error();
  RadianceMatrix matrix{static_cast<int>(points.size() * per_point), patches.size(), {}};
  matrix.value.assign(points.size() * per_point * columns, Rgb(0.0f));
  std::vector<Rgb> radiance(static_cast<std::size_t>(volume.partition.size()), Rgb(0.0f));
  for (int patch = 0; patch < patches.size(); ++patch) {
    if (!progress("daylight coefficients", static_cast<double>(patch) / patches.size()))
      return interrupted_error("stdin");
    const std::vector<RegionWeight> lit = patches.region_radiances(patch, volume.partition);
    for (const RegionWeight& w : lit)
      radiance[static_cast<std::size_t>(w.region)] = Rgb(static_cast<float>(w.weight));
    const LightField field = combine(volume, radiance, content.coefficients ? ShOrder::second : ShOrder::fourth);
    for (const RegionWeight& w : lit)
      radiance[static_cast<std::size_t>(w.region)] = Rgb(0.0f);
    parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
      const ShRadiance sh = (*interpolations)[i].sample(field);
      for (std::size_t k = 0; k < per_point; ++k)
        matrix.at(static_cast<int>(i * per_point + k), patch) =
            content.coefficients ? sh.nine[k] : irradiance(sh, glm::vec3(points[i].normal));
    });
  }
  if (content.total)
    add_direct(volume, scene, points, patches, matrix);
  return matrix;
}

} // namespace daylit::precompute
