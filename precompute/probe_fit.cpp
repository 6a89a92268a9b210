#include "precompute/probe_fit.h"

#include <algorithm>
#include <array>
#include <utility>

#include <tbb/parallel_for.h>

namespace daylit::precompute {

namespace {

constexpr float kShare = 1.0f / 12.0f;
constexpr std::size_t kChunk = 256; ///< numbers of all points at a time
constexpr std::int64_t kNone = -1;

} // namespace

ProbeFit ProbeFit::make(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
                        const std::function<bool(std::size_t, std::size_t)>& sees) {
  ProbeFit fit;
  fit.points_ = probe_of_point.size();
  if (!grid.is_grid)
    return fit;
  std::vector<std::int64_t> point_of(grid.size(), kNone);
  for (std::size_t p = 0; p < probe_of_point.size(); ++p)
    point_of[probe_of_point[p]] = static_cast<std::int64_t>(p);
  const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(grid.count.x),
                                          static_cast<std::size_t>(grid.count.x) *
                                              static_cast<std::size_t>(grid.count.y)};
  // linked[axis][probe]: the probe and the next one along the axis are in the air and see each other.
  std::array<std::vector<std::uint8_t>, 3> linked;
  const auto place = [&](std::size_t probe, std::size_t axis) {
    return static_cast<int>(probe / stride[axis]) % grid.count[static_cast<int>(axis)];
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    linked[axis].assign(grid.size(), 0);
    tbb::parallel_for(std::size_t{0}, probe_of_point.size(), [&](std::size_t p) {
      const std::size_t probe = probe_of_point[p], next = probe + stride[axis];
      linked[axis][probe] =
          place(probe, axis) + 1 < grid.count[static_cast<int>(axis)] && point_of[next] != kNone && sees(probe, next);
    });
  }
  for (std::size_t p = 0; p < probe_of_point.size(); ++p)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t probe = probe_of_point[p], s = stride[axis];
      const int here = place(probe, axis), count = grid.count[static_cast<int>(axis)];
      const auto link = [&](int steps) { // between the probes at here + steps and here + steps + 1
        return here + steps >= 0 && here + steps + 1 < count &&
               linked[axis][probe + static_cast<std::size_t>(static_cast<std::int64_t>(s) * steps)] != 0;
      };
      for (const int middle : {0, 1, -1})
        if (link(middle - 1) && link(middle)) {
          const auto at = [&](int steps) {
            return static_cast<std::uint32_t>(
                point_of[probe + static_cast<std::size_t>(static_cast<std::int64_t>(s) * steps)]);
          };
          fit.rows_.push_back({static_cast<std::uint32_t>(p), at(middle - 1), at(middle), at(middle + 1)});
          break;
        }
    }
  return fit;
}

void ProbeFit::apply(std::span<float> values, std::size_t numbers_per_point) const {
  const std::size_t chunks = (numbers_per_point + kChunk - 1) / kChunk;
  tbb::parallel_for(std::size_t{0}, rows_.empty() ? 0 : chunks, [&](std::size_t c) {
    const std::size_t first = c * kChunk, count = std::min(kChunk, numbers_per_point - first);
    std::vector<float> before(points_ * count);
    for (std::size_t p = 0; p < points_; ++p)
      std::copy_n(values.data() + p * numbers_per_point + first, count, before.data() + p * count);
    for (const Row& row : rows_) {
      float* out = values.data() + row.point * numbers_per_point + first;
      const float *a = before.data() + row.a * count, *m = before.data() + row.middle * count,
                  *b = before.data() + row.b * count;
      for (std::size_t k = 0; k < count; ++k)
        out[k] -= kShare * (a[k] - 2.0f * m[k] + b[k]);
    }
  });
}

void ProbeFit::apply(std::size_t point, std::size_t numbers, const std::function<void(std::size_t, float*)>& values_of,
                     float* out) const {
  values_of(point, out);
  std::vector<float> other(numbers);
  const auto of_point = std::ranges::equal_range(rows_, point, {}, &Row::point);
  for (const Row& row : of_point)
    for (const auto& [from, share] : {std::pair{row.a, -kShare}, {row.middle, 2.0f * kShare}, {row.b, -kShare}}) {
      values_of(from, other.data());
      for (std::size_t k = 0; k < numbers; ++k)
        out[k] += share * other[k];
    }
}

} // namespace daylit::precompute
