#include "scene/first_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "scene/detail/tile_kernels.h"

namespace daylit {

namespace {

constexpr std::size_t kGrain = 64; ///< rows; fewer are not worth another thread

Error broken(const char* what) {
  return {ErrorCode::file_malformed, what, "compact basis", "bake it again with daylit-precompute"};
}

bool rises_to(const std::vector<std::uint32_t>& offsets, std::size_t end) {
  return !offsets.empty() && offsets.front() == 0 && offsets.back() == end && std::ranges::is_sorted(offsets);
}

} // namespace

std::size_t FirstLight::bytes() const {
  return 4 * (scale.size() + first_run.size() + first_weight.size() + 2 * run.size()) + 2 * weight.size();
}

std::vector<Rgb> received(const FirstLight& light, std::size_t pieces, std::span<const Rgb> region_radiance) {
  const std::size_t regions = region_radiance.size();
  std::vector<float> planes(3 * regions);
  for (std::size_t i = 0; i < regions; ++i)
    for (int c = 0; c < 3; ++c)
      planes[static_cast<std::size_t>(c) * regions + i] = region_radiance[i][c];
  const bool tinted = light.rows() > pieces;
  std::vector<Rgb> irradiance(pieces, Rgb(0.0f));
  const detail::TileKernels& kernels = detail::tile_kernels();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pieces, kGrain), [&](const auto& part) {
    for (std::size_t piece = part.begin(); piece < part.end(); ++piece)
      for (int colour = 0; colour < (tinted ? 3 : 1); ++colour) {
        const std::size_t row = static_cast<std::size_t>(colour) * pieces + piece;
        const auto runs =
            std::span(light.run).subspan(light.first_run[row], light.first_run[row + 1] - light.first_run[row]);
        std::array<float, 3> sum;
        kernels.dot_half_planes(light.weight.data() + light.first_weight[row], runs, planes.data(), regions,
                                sum.data());
        for (int c = tinted ? colour : 0; c < (tinted ? colour + 1 : 3); ++c)
          irradiance[piece][c] = light.scale[row] * sum[static_cast<std::size_t>(c)];
      }
  });
  return irradiance;
}

Result<void> check_first_light(const FirstLight& light, std::size_t pieces, int regions) {
  const std::size_t rows = light.rows();
  if ((rows != pieces && rows != 3 * pieces) || light.first_run.size() != rows + 1 ||
      light.first_weight.size() != rows + 1 || !rises_to(light.first_run, light.run.size()) ||
      !rises_to(light.first_weight, light.weight.size()))
    return broken("the rows of the first light disagree");
  for (std::size_t row = 0; row < rows; ++row) {
    std::uint64_t end = 0, weights = 0;
    for (std::uint32_t r = light.first_run[row]; r < light.first_run[row + 1]; ++r) {
      const FirstLight::Run& run = light.run[r];
      if (run.first_region < end)
        return broken("runs of the first light overlap");
      end = std::uint64_t{run.first_region} + run.count;
      weights += run.count;
    }
    if (end > static_cast<std::uint64_t>(regions) || weights != light.first_weight[row + 1] - light.first_weight[row])
      return broken("a run of the first light leaves the sky, or has too few weights");
  }
  if (!std::ranges::all_of(light.scale, [](float x) { return std::isfinite(x); }) ||
      !std::ranges::all_of(light.weight, [](std::uint16_t h) { return (h & 0x7c00u) != 0x7c00u; }))
    return broken("a weight of the first light is not finite");
  return {};
}

} // namespace daylit
