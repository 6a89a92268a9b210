#include "scene/volume/volume_combiner.h"

#include <algorithm>
#include <cassert>

#include "scene/volume/basis_rows.h"

namespace daylit {

VolumeCombiner VolumeCombiner::make(const BasisVolume& volume, ShOrder order) {
  const bool band4 = order == ShOrder::fourth && volume.has_band4();
  VolumeCombiner c;
  c.compact_ = volume.compact;
  c.region_ = volume.stored_region;
  c.basis_ = volume.basis;
  if (band4)
    c.band4_ = volume.band4;
  if (auto interpolated = interpolated_probes(volume.probes))
    c.interpolated_ = std::move(*interpolated);
  c.current_.assign(volume.compact ? static_cast<std::size_t>(volume.partition.size()) : c.region_.size(), Rgb(0.0f));
  c.field_.probe.assign(volume.probes.size(), Sh9Rgb{});
  c.field_.band4.assign(band4 ? volume.probes.size() : 0, Band4Rgb{});
  return c;
}

/// Factors have no rows of single nodes: all of them or none.
std::size_t VolumeCombiner::update(std::span<const Rgb> region_radiance) {
  if (!compact_) {
    const std::size_t rows = update_rows(region_radiance);
    interpolate_probes(interpolated_, field_);
    return rows;
  }
  assert(region_radiance.size() == current_.size());
  if (std::ranges::equal(region_radiance, current_))
    return 0;
  std::ranges::copy(region_radiance, current_.begin());
  combine(*compact_, region_radiance, field_.probe, field_.band4);
  interpolate_probes(interpolated_, field_);
  return current_.size();
}

/// L_lm(t) = L_lm(t - 1) + sum_r (L_r(t) - L_r(t - 1)) L_lm^(r) where fewer rows changed than are lit, else the whole
/// sum. Each step adds a rounding of 2^-24 of the terms; after kRefreshAfter steps the sum starts anew.
std::size_t VolumeCombiner::update_rows(std::span<const Rgb> region_radiance) {
  const std::vector<Rgb> next = detail::radiance_of_rows(region_, region_radiance);
  std::vector<Rgb> weight(next.size());
  std::ranges::transform(next, current_, weight.begin(), [](const Rgb& a, const Rgb& b) { return a - b; });
  const auto lit = [](const std::vector<Rgb>& rows) {
    return static_cast<std::size_t>(std::ranges::count_if(rows, [](const Rgb& x) { return x != Rgb(0.0f); }));
  };
  const std::size_t changed = lit(weight);
  if (changed == 0)
    return 0;
  if (changed >= lit(next) || ++steps_ > kRefreshAfter) {
    steps_ = 0;
    weight = next;
    std::ranges::fill(field_.probe, Sh9Rgb{});
    std::ranges::fill(field_.band4, Band4Rgb{});
  }
  current_ = next;
  if (!field_.band4.empty())
    detail::add_basis_rows(band4_, weight, field_.band4);
  return detail::add_basis_rows(basis_, weight, field_.probe);
}

} // namespace daylit
