#include "scene/volume/basis_rows.h"

#include <algorithm>

#include "scene/core/parallel.h"
#include "scene/volume/row_kernels.h"

namespace daylit::detail {

namespace {

/// Numbers of the field that a thread takes at once: whole colours and whole vectors of any width.
constexpr std::size_t kTile = 32 * 48;
constexpr std::size_t kGrain_bytes = 512 * 1024; ///< of the rows; less is not worth another thread

} // namespace

std::vector<Rgb> radiance_of_rows(std::span<const std::int32_t> region, std::span<const Rgb> region_radiance) {
  std::vector<Rgb> radiance(region.size());
  std::ranges::transform(region, radiance.begin(),
                         [&](std::int32_t r) { return region_radiance[static_cast<std::size_t>(r)]; });
  return radiance;
}

/// One row per region that is lit; a thread sums a run of tiles over all rows, so that no two write the same number and
/// the order of a sum is that of the rows.
std::size_t add_basis_rows(std::span<const float> basis, std::span<const Rgb> radiance,
                           std::span<std::array<Rgb, 9>> field) {
  static_assert(sizeof(std::array<Rgb, 9>) == 27 * sizeof(float));
  const std::size_t floats = 27 * field.size();
  std::vector<WeightedRow<float>> rows;
  for (std::size_t r = 0; r < radiance.size(); ++r)
    if (radiance[r] != Rgb(0.0f))
      rows.push_back({basis.data() + r * floats, radiance[r]});
  if (rows.empty() || floats == 0)
    return 0;
  const std::size_t tile_bytes = rows.size() * kTile * sizeof(float),
                    grain = std::max<std::size_t>(kGrain_bytes / tile_bytes, 1);
  float* const sum = &field[0][0].r;
  parallel_for(tbb::blocked_range<std::size_t>(0, (floats + kTile - 1) / kTile, grain), [&](const auto& tiles) {
    std::vector<WeightedRow<float>> part(rows);
    const std::size_t first = tiles.begin() * kTile, end = std::min(tiles.end() * kTile, floats);
    for (WeightedRow<float>& row : part)
      row.value += first;
    add_rows(part, end - first, sum + first);
  });
  return rows.size();
}

} // namespace daylit::detail
