#include "precompute/probe_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "scene/core/parallel.h"
#include "scene/volume/interpolated_probes.h"
#include "scene/volume/probe_planes.h"
#include "scene/volume/row_kernels.h"

namespace daylit::precompute {

namespace {

constexpr std::size_t kChunk = 256; ///< values of all points at a time
constexpr std::int64_t kNone = -1;
constexpr double kOffSurfaces = 1.0; ///< of the longest step of a fit: nearer to a surface light is no parabola

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

/// Which neighbouring probes of a grid see each other. Those that are interpolated along an axis are no neighbours
/// along it: they hold what interpolation between the others gives.
class ProbeLinks {
public:
  ProbeLinks(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
             const std::function<bool(std::size_t, std::size_t)>& sees)
      : grid_(grid), count_{grid.count.x, grid.count.y, grid.count.z}, stride_{1, grid.count.x,
                                                                               std::int64_t{grid.count.x} *
                                                                                   grid.count.y},
        point_of_(grid.size(), kNone) {
    for (std::size_t p = 0; p < probe_of_point.size(); ++p)
      point_of_[probe_of_point[p]] = static_cast<std::int64_t>(p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      next_[axis].assign(grid.size(), kNone);
      previous_[axis].assign(grid.size(), kNone);
      parallel_for(std::size_t{0}, probe_of_point.size(), [&](std::size_t p) {
        const std::size_t probe = probe_of_point[p];
        const std::int64_t next = following(probe, axis);
        if (next != kNone && point_of_[static_cast<std::size_t>(next)] != kNone &&
            sees(probe, static_cast<std::size_t>(next)))
          next_[axis][probe] = next;
      });
      for (const std::size_t probe : probe_of_point)
        if (next_[axis][probe] != kNone)
          previous_[axis][static_cast<std::size_t>(next_[axis][probe])] = static_cast<std::int64_t>(probe);
    }
  }

  /// Along an axis of the grid.
  int index(std::size_t probe, std::size_t axis) const {
    return static_cast<int>(static_cast<std::int64_t>(probe) / stride_[axis] % count_[axis]);
  }
  /// Three probes in a row along the axis, each in sight of the next, the probe itself in the middle.
  std::optional<std::array<std::size_t, 3>> row(std::size_t probe, std::size_t axis) const {
    const std::int64_t previous = previous_[axis][probe], next = next_[axis][probe];
    if (previous == kNone || next == kNone)
      return {};
    return std::array{static_cast<std::size_t>(previous), probe, static_cast<std::size_t>(next)};
  }
  std::uint32_t point(std::size_t probe) const { return static_cast<std::uint32_t>(point_of_[probe]); }

private:
  /// The next probe along the axis that is not interpolated along it.
  std::int64_t following(std::size_t probe, std::size_t axis) const {
    auto next = static_cast<std::int64_t>(probe);
    for (int i = index(probe, axis) + 1; i < count_[axis]; ++i) {
      next += stride_[axis];
      if (grid_.interpolated.empty() || grid_.interpolated[static_cast<std::size_t>(next)] != axis + 1)
        return next;
    }
    return kNone;
  }

  const ProbeSet& grid_;
  std::array<int, 3> count_;
  std::array<std::int64_t, 3> stride_;
  std::vector<std::int64_t> point_of_;
  std::array<std::vector<std::int64_t>, 3> next_, previous_; ///< [axis][probe]
};

/// Steps between neighbours that see each other, and from an interpolated probe to those that it lies between.
std::vector<std::uint32_t> connected_parts(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
                                           const std::function<bool(std::size_t, std::size_t)>& sees) {
  Parts parts(grid.size());
  std::vector<std::uint8_t> in_air(grid.size(), 0);
  for (const std::size_t p : probe_of_point)
    in_air[p] = 1;
  if (const auto interpolated = interpolated_probes(grid))
    for (const InterpolatedProbe& i : *interpolated) {
      in_air[i.probe] = 1;
      parts.join(i.probe, i.a);
      parts.join(i.probe, i.b);
    }
  const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(grid.count.x),
                                          static_cast<std::size_t>(grid.count.x) * grid.count.y};
  for (std::size_t i = 0; i < grid.size(); ++i)
    for (int axis = 0; axis < 3 && in_air[i]; ++axis) {
      const std::size_t step = stride[static_cast<std::size_t>(axis)], next = i + step;
      if (static_cast<int>(i / step) % grid.count[axis] + 1 < grid.count[axis] && in_air[next] &&
          parts.of(static_cast<std::uint32_t>(i)) != parts.of(static_cast<std::uint32_t>(next)) && sees(i, next))
        parts.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(next));
    }
  std::vector<std::uint32_t> part;
  for (const std::size_t p : probe_of_point)
    part.push_back(parts.of(static_cast<std::uint32_t>(p)));
  return part;
}

/// The correction of a point between planes at distances a and b, (a^2 - a b + b^2) f'' / 12 with f'' = 2 (f_a / a +
/// f_b / b) / (a + b): as fractions of the steps f_a and f_b from it to those on the planes.
std::array<float, 2> step_fractions(double a, double b) {
  const double length2 = a * a - a * b + b * b;
  return {static_cast<float>(length2 / (6.0 * a * (a + b))), static_cast<float>(length2 / (6.0 * b * (a + b)))};
}

} // namespace

ProbeFit ProbeFit::make(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
                        const std::function<bool(std::size_t, std::size_t)>& sees,
                        const std::function<double(std::size_t)>& off_surfaces_m) {
  ProbeFit fit;
  fit.points_ = probe_of_point.size();
  fit.part_.assign(fit.points_, 0);
  if (!grid.is_grid)
    return fit;
  const ProbePlanes planes(grid);
  const ProbeLinks links(grid, probe_of_point, sees);
  fit.part_ = connected_parts(grid, probe_of_point, sees);
  for (std::uint32_t p = 0; p < fit.points_; ++p) {
    const double off_m = off_surfaces_m(probe_of_point[p]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto row = links.row(probe_of_point[p], axis);
      if (!row)
        continue;
      const auto place = [&](std::size_t k) {
        return planes.along(static_cast<int>(axis))[static_cast<std::size_t>(links.index((*row)[k], axis))];
      };
      const double a = place(1) - place(0), b = place(2) - place(1);
      const auto [to_a, to_b] = step_fractions(a, b);
      if (off_m >= kOffSurfaces * std::max(a, b))
        fit.rows_.push_back({p, links.point((*row)[0]), links.point((*row)[2]), to_a, to_b});
    }
  }
  return fit;
}

/// f_p -= to_a (f_a - f_p) + to_b (f_b - f_p) for each axis, with the values before the fit.
void ProbeFit::apply(std::span<float> values, std::size_t values_per_point) const {
  const std::size_t chunks = (values_per_point + kChunk - 1) / kChunk;
  parallel_for(std::size_t{0}, rows_.empty() ? 0 : chunks, [&](std::size_t c) {
    const std::size_t first = c * kChunk, count = std::min(kChunk, values_per_point - first);
    std::vector<float> before(points_ * count);
    for (std::size_t p = 0; p < points_; ++p)
      std::copy_n(values.data() + p * values_per_point + first, count, before.data() + p * count);
    for (const Row& row : rows_) {
      float* out = values.data() + row.point * values_per_point + first;
      const float *a = before.data() + row.a * count, *m = before.data() + row.point * count,
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
      needed.insert(needed.end(), {row.a, row.b});
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
      add(points[i], row.to_a + row.to_b);
      add(row.b, -row.to_b);
    }
    daylit::detail::add_rows(terms, values_per_point, result + i * values_per_point);
  }
}

} // namespace daylit::precompute
