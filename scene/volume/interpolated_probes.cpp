#include "scene/volume/interpolated_probes.h"

namespace daylit {

namespace {

Error broken(const char* what) { return {ErrorCode::file_malformed, what, "volume", "bake it again"}; }

} // namespace

GridNeighbours::GridNeighbours(const ProbeSet& probes) : probes_(probes), planes_(probes) {
  stride_[1] = static_cast<std::size_t>(probes.count.x);
  stride_[2] = stride_[1] * static_cast<std::size_t>(probes.count.y);
}

/// weight_b = (x - x_a) / (x_b - x_a)
std::optional<InterpolatedProbe> GridNeighbours::between(std::size_t probe, int axis) const {
  const auto k = static_cast<std::size_t>(axis);
  const int count = probes_.count[axis], here = static_cast<int>(probe / stride_[k]) % count;
  const auto at = [&](int plane) {
    return probe + stride_[k] * static_cast<std::size_t>(plane) - stride_[k] * static_cast<std::size_t>(here);
  };
  int low = here - 1, high = here + 1;
  while (low >= 0 && probes_.interpolated[at(low)] == axis + 1)
    --low;
  while (high < count && probes_.interpolated[at(high)] == axis + 1)
    ++high;
  if (low < 0 || high >= count || !serves(at(low), axis) || !serves(at(high), axis))
    return {};
  const double* x = planes_.along(axis).data();
  return InterpolatedProbe{static_cast<std::uint32_t>(probe), static_cast<std::uint32_t>(at(low)),
                           static_cast<std::uint32_t>(at(high)),
                           static_cast<float>((x[here] - x[low]) / (x[high] - x[low]))};
}

bool GridNeighbours::serves(std::size_t probe, int axis) const {
  return probes_.interpolated[probe] == 0 ? probes_.valid[probe] != 0 : probes_.interpolated[probe] > axis + 1;
}

/// Along z first, then along y, then along x: each from what is known by then.
Result<std::vector<InterpolatedProbe>> interpolated_probes(const ProbeSet& probes) {
  std::vector<InterpolatedProbe> list;
  if (probes.interpolated.empty())
    return list;
  if (!probes.is_grid || probes.interpolated.size() != probes.size())
    return broken("there are not as many numbers of interpolated probes as probes of a grid");
  for (std::size_t i = 0; i < probes.size(); ++i)
    if (probes.interpolated[i] > 3 || (probes.interpolated[i] != 0 && probes.valid[i] != 0))
      return broken("a probe is interpolated along no axis, or has light of its own too");
  const GridNeighbours neighbours(probes);
  for (const int axis : {2, 1, 0})
    for (std::size_t i = 0; i < probes.size(); ++i)
      if (probes.interpolated[i] == axis + 1) {
        const auto between = neighbours.between(i, axis);
        if (!between)
          return broken("an interpolated probe has no neighbour on one side");
        list.push_back(*between);
      }
  return list;
}

/// L = L_a + w (L_b - L_a)
void interpolate_probes(std::span<const InterpolatedProbe> probes, LightField& field) {
  const auto mix = [](const std::array<Rgb, 9>& a, const std::array<Rgb, 9>& b, float w, std::array<Rgb, 9>& out) {
    for (std::size_t k = 0; k < 9; ++k)
      out[k] = a[k] + w * (b[k] - a[k]);
  };
  for (const InterpolatedProbe& p : probes) {
    mix(field.probe[p.a], field.probe[p.b], p.weight_b, field.probe[p.probe]);
    if (!field.band4.empty())
      mix(field.band4[p.a], field.band4[p.b], p.weight_b, field.band4[p.probe]);
  }
}

} // namespace daylit
