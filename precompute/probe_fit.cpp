#include "precompute/probe_fit.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <utility>

#include "scene/core/parallel.h"
#include "scene/volume/probe_planes.h"
#include "scene/volume/row_kernels.h"

namespace daylit::precompute {

namespace {

constexpr std::size_t kChunk = 256;  ///< numbers of all points at a time
constexpr std::int64_t kNone = -1;

/// Disjoint sets, each named by its smallest member.
class Parts {
public:
  explicit Parts(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t of(std::uint32_t i) {
    while (parent_[i] != i)
      i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = of(a);
    b = of(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

private:
  std::vector<std::uint32_t> parent_;
};

/// The correction of a point as shares of the steps from the middle one of three planes to the two others.
/// `own`: which of the planes is the point's.
std::array<float, 2> shares(std::span<const double, 3> plane, int own) {
  const double a = plane[1] - plane[0], b = plane[2] - plane[1];
  const double length2 = own == 0 ? a * a : own == 2 ? b * b : a * a - a * b + b * b;
  return {static_cast<float>(length2 / (6.0 * a * (a + b))), static_cast<float>(length2 / (6.0 * b * (a + b)))};
}

} // namespace

ProbeFit ProbeFit::make(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
                        const std::function<bool(std::size_t, std::size_t)>& sees) {
  ProbeFit fit;
  fit.points_ = probe_of_point.size();
  fit.part_.assign(fit.points_, 0);
  if (!grid.is_grid)
    return fit;
  const ProbePlanes planes(grid);
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
    parallel_for(std::size_t{0}, probe_of_point.size(), [&](std::size_t p) {
      const std::size_t probe = probe_of_point[p], next = probe + stride[axis];
      linked[axis][probe] =
          place(probe, axis) + 1 < grid.count[static_cast<int>(axis)] && point_of[next] != kNone && sees(probe, next);
    });
  }
  Parts parts(fit.points_);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t p = 0; p < probe_of_point.size(); ++p)
      if (const std::size_t probe = probe_of_point[p]; linked[axis][probe] != 0)
        parts.join(static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(point_of[probe + stride[axis]]));
  for (std::uint32_t p = 0; p < fit.points_; ++p)
    fit.part_[p] = parts.of(p);
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
          const auto [to_a, to_b] =
              shares(std::span<const double, 3>(planes.along(static_cast<int>(axis)).data() + here + middle - 1, 3),
                     1 - middle);
          fit.rows_.push_back({static_cast<std::uint32_t>(p), at(middle - 1), at(middle), at(middle + 1), to_a, to_b});
          break;
        }
    }
  return fit;
}

void ProbeFit::apply(std::span<float> values, std::size_t numbers_per_point) const {
  const std::size_t chunks = (numbers_per_point + kChunk - 1) / kChunk;
  parallel_for(std::size_t{0}, rows_.empty() ? 0 : chunks, [&](std::size_t c) {
    const std::size_t first = c * kChunk, count = std::min(kChunk, numbers_per_point - first);
    std::vector<float> before(points_ * count);
    for (std::size_t p = 0; p < points_; ++p)
      std::copy_n(values.data() + p * numbers_per_point + first, count, before.data() + p * count);
    for (const Row& row : rows_) {
      float* out = values.data() + row.point * numbers_per_point + first;
      const float *a = before.data() + row.a * count, *m = before.data() + row.middle * count,
                  *b = before.data() + row.b * count;
      for (std::size_t k = 0; k < count; ++k)
        out[k] -= row.to_a * (a[k] - m[k]) + row.to_b * (b[k] - m[k]);
    }
  });
}

std::vector<std::uint32_t> ProbeFit::needed(std::span<const std::uint32_t> points) const {
  std::vector<std::uint32_t> needed(points.begin(), points.end());
  for (const std::uint32_t p : points)
    for (const Row& row : std::ranges::equal_range(rows_, p, {}, &Row::point))
      needed.insert(needed.end(), {row.a, row.middle, row.b});
  std::ranges::sort(needed);
  const auto repeated = std::ranges::unique(needed);
  needed.erase(repeated.begin(), repeated.end());
  return needed;
}

void ProbeFit::apply(std::span<const std::uint32_t> points, std::size_t numbers_per_point,
                     const std::function<void(std::uint32_t point, float* values)>& value, float* result) const {
  const std::vector<std::uint32_t> needed = this->needed(points);
  const auto values = std::make_unique_for_overwrite<float[]>(needed.size() * numbers_per_point);
  for (std::size_t i = 0; i < needed.size(); ++i)
    value(needed[i], values.get() + i * numbers_per_point);
  std::vector<daylit::detail::WeightedRow<float>> terms;
  const auto add = [&](std::uint32_t p, float weight) {
    const float* of_p = values.get() + static_cast<std::size_t>(std::ranges::lower_bound(needed, p) - needed.begin()) *
                                           numbers_per_point;
    if (const auto known = std::ranges::find(terms, of_p, &daylit::detail::WeightedRow<float>::number);
        known != terms.end())
      known->weight += Rgb(weight);
    else
      terms.push_back({of_p, Rgb(weight)});
  };
  std::fill_n(result, points.size() * numbers_per_point, 0.0f);
  for (std::size_t i = 0; i < points.size(); ++i) {
    terms.clear();
    add(points[i], 1.0f);
    for (const Row& row : std::ranges::equal_range(rows_, points[i], {}, &Row::point)) {
      add(row.a, -row.to_a);
      add(row.middle, row.to_a + row.to_b);
      add(row.b, -row.to_b);
    }
    daylit::detail::add_rows(terms, numbers_per_point, result + i * numbers_per_point);
  }
}

} // namespace daylit::precompute
