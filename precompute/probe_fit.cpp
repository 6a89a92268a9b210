#include "precompute/probe_fit.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "scene/core/parallel.h"
#include "scene/volume/probe_planes.h"
#include "scene/volume/row_kernels.h"

namespace daylit::precompute {

namespace {

constexpr std::size_t kChunk = 256; ///< values of all points at a time
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

/// Which neighbouring probes of a grid are in the air and see each other.
class ProbeLinks {
public:
  ProbeLinks(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
             const std::function<bool(std::size_t, std::size_t)>& sees)
      : count_{grid.count.x, grid.count.y, grid.count.z}, stride_{1, grid.count.x,
                                                                  std::int64_t{grid.count.x} * grid.count.y},
        point_of_(grid.size(), kNone) {
    for (std::size_t p = 0; p < probe_of_point.size(); ++p)
      point_of_[probe_of_point[p]] = static_cast<std::int64_t>(p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      linked_[axis].assign(grid.size(), 0);
      parallel_for(std::size_t{0}, probe_of_point.size(), [&](std::size_t p) {
        const std::size_t probe = probe_of_point[p], next = step(probe, axis, 1);
        linked_[axis][probe] =
            index(probe, axis) + 1 < count_[axis] && point_of_[next] != kNone && sees(probe, next) ? 1 : 0;
      });
    }
  }

  /// Along an axis of the grid.
  int index(std::size_t probe, std::size_t axis) const {
    return static_cast<int>(static_cast<std::int64_t>(probe) / stride_[axis] % count_[axis]);
  }
  /// Between the probes `steps` and `steps` + 1 further along the axis.
  bool linked(std::size_t probe, std::size_t axis, int steps) const {
    const int here = index(probe, axis) + steps;
    return here >= 0 && here + 1 < count_[axis] && linked_[axis][step(probe, axis, steps)] != 0;
  }
  std::uint32_t point(std::size_t probe, std::size_t axis, int steps) const {
    return static_cast<std::uint32_t>(point_of_[step(probe, axis, steps)]);
  }

private:
  std::size_t step(std::size_t probe, std::size_t axis, int steps) const {
    return static_cast<std::size_t>(static_cast<std::int64_t>(probe) + stride_[axis] * steps);
  }

  std::array<int, 3> count_;
  std::array<std::int64_t, 3> stride_;
  std::vector<std::int64_t> point_of_;
  std::array<std::vector<std::uint8_t>, 3> linked_; ///< [axis][probe]: to the next one
};

std::vector<std::uint32_t> connected_parts(const ProbeLinks& links, std::span<const std::size_t> probe_of_point) {
  Parts parts(probe_of_point.size());
  std::vector<std::uint32_t> part(probe_of_point.size());
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::uint32_t p = 0; p < part.size(); ++p)
      if (links.linked(probe_of_point[p], axis, 0))
        parts.join(p, links.point(probe_of_point[p], axis, 1));
  for (std::uint32_t p = 0; p < part.size(); ++p)
    part[p] = parts.of(p);
  return part;
}

/// The correction of a point, (a^2 - a b + b^2) f'' / 12 between planes at distances a and b and h^2 f'' / 12 beside a
/// wall, with f'' = 2 (f_a / a + f_b / b) / (a + b): as fractions of the steps f_a and f_b from the middle one of three
/// planes to the two others. `own`: which of the planes is the point's.
std::array<float, 2> step_fractions(std::span<const double, 3> plane, int own) {
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
  const ProbeLinks links(grid, probe_of_point, sees);
  fit.part_ = connected_parts(links, probe_of_point);
  for (std::uint32_t p = 0; p < fit.points_; ++p)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int middle : {0, 1, -1}) {
        const std::size_t probe = probe_of_point[p];
        if (!links.linked(probe, axis, middle - 1) || !links.linked(probe, axis, middle))
          continue;
        const double* first = planes.along(static_cast<int>(axis)).data() + links.index(probe, axis) + middle - 1;
        const auto [to_a, to_b] = step_fractions(std::span<const double, 3>(first, 3), 1 - middle);
        fit.rows_.push_back({p, links.point(probe, axis, middle - 1), links.point(probe, axis, middle),
                             links.point(probe, axis, middle + 1), to_a, to_b});
        break;
      }
  return fit;
}

/// f_p -= to_a (f_a - f_m) + to_b (f_b - f_m) for each axis, with the values before the fit.
void ProbeFit::apply(std::span<float> values, std::size_t values_per_point) const {
  const std::size_t chunks = (values_per_point + kChunk - 1) / kChunk;
  parallel_for(std::size_t{0}, rows_.empty() ? 0 : chunks, [&](std::size_t c) {
    const std::size_t first = c * kChunk, count = std::min(kChunk, values_per_point - first);
    std::vector<float> before(points_ * count);
    for (std::size_t p = 0; p < points_; ++p)
      std::copy_n(values.data() + p * values_per_point + first, count, before.data() + p * count);
    for (const Row& row : rows_) {
      float* out = values.data() + row.point * values_per_point + first;
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

void ProbeFit::apply(std::span<const std::uint32_t> points, std::size_t values_per_point,
                     const std::function<void(std::uint32_t point, float* values)>& value, float* result) const {
  const std::vector<std::uint32_t> needed = this->needed(points);
  const auto values = std::make_unique_for_overwrite<float[]>(needed.size() * values_per_point);
  for (std::size_t i = 0; i < needed.size(); ++i)
    value(needed[i], values.get() + i * values_per_point);
  std::vector<daylit::detail::WeightedRow<float>> terms;
  const auto add = [&](std::uint32_t p, float weight) {
    const float* of_p = values.get() + static_cast<std::size_t>(std::ranges::lower_bound(needed, p) - needed.begin()) *
                                           values_per_point;
    if (const auto known = std::ranges::find(terms, of_p, &daylit::detail::WeightedRow<float>::value);
        known != terms.end())
      known->weight += Rgb(weight);
    else
      terms.push_back({of_p, Rgb(weight)});
  };
  std::fill_n(result, points.size() * values_per_point, 0.0f);
  for (std::size_t i = 0; i < points.size(); ++i) {
    terms.clear();
    add(points[i], 1.0f);
    for (const Row& row : std::ranges::equal_range(rows_, points[i], {}, &Row::point)) {
      add(row.a, -row.to_a);
      add(row.middle, row.to_a + row.to_b);
      add(row.b, -row.to_b);
    }
    daylit::detail::add_rows(terms, values_per_point, result + i * values_per_point);
  }
}

} // namespace daylit::precompute
