#include <algorithm>
#include <array>
#include <numeric>

#include "scene/core/parallel.h"
#include "scene/sky/region_texels.h"
#include "scene/sky/sky_partition.h"

namespace daylit {

namespace {

constexpr int kRegionProbes = 8;   ///< per side, to see whether a region reaches out of the field
constexpr double kRounding = 0.02; ///< of a hat: pixels are whole, hats are not
constexpr std::size_t kGrain = 64; ///< regions; fewer are not worth another thread

/// Whether some of the region lies outside the picture's field.
bool reaches_out(const SkyGeometry& geometry, const SkyPartition& partition, int region) {
  for (int k = 0; k < kRegionProbes * kRegionProbes; ++k)
    if (!geometry.pixel(partition.sample(region, (k % kRegionProbes + 0.5) / kRegionProbes,
                                         (k / kRegionProbes + 0.5) / kRegionProbes)))
      return true;
  return false;
}

/// Steradians of a region, or of a node's hat, that the picture leaves to the fill. Of a region that does not reach out
/// of the field the difference is the rounding of split pixels, and the fill must not leak in.
double gap_sr(const SkyGeometry& geometry, const SkyPartition& partition, int region, double covered_sr) {
  if (geometry.covers_sphere())
    return 0.0;
  if (partition.interpolated()) {
    const double hat_sr = partition.hat_sr(region), missing = hat_sr - covered_sr;
    return missing < kRounding * hat_sr ? 0.0 : missing;
  }
  return reaches_out(geometry, partition, region) ? std::max(0.0, partition.solid_angle_sr(region) - covered_sr) : 0.0;
}

} // namespace

/// covered_i = sum of the pixels' weights: the divisor is made of the same numbers as the sums, so that a constant sky
/// keeps its value.
void RegionSums::measure_coverage(const SkyPartition& partition) {
  const auto regions = static_cast<std::size_t>(partition.size());
  covered_.assign(regions, 0.0);
  gap_.assign(regions, 0.0);
  centre_.resize(regions);
  parallel_for(std::size_t{0}, regions, [&](std::size_t region) {
    const float* weight = texels_->weight_sr.data();
    covered_[region] =
        std::accumulate(weight + texels_->first_weight[region], weight + texels_->first_weight[region + 1], 0.0);
    centre_[region] = partition.centre(static_cast<int>(region));
    gap_[region] = gap_sr(*geometry_, partition, static_cast<int>(region), covered_[region]);
  });
}

/// Of regions that nobody needs they stay zero.
void RegionSums::set_divisors(const SkyPartition& partition, std::span<const std::uint8_t> needed) {
  divisor_.resize(covered_.size());
  for (std::size_t region = 0; region < covered_.size(); ++region) {
    if (!needed.empty() && needed[region] == 0)
      continue;
    const double total_sr =
        partition.interpolated() ? partition.solid_angle_sr(static_cast<int>(region)) : covered_[region] + gap_[region];
    if (total_sr <= 0) { // smaller than a sub-pixel
      unseen_.push_back(static_cast<std::uint32_t>(region));
      continue;
    }
    divisor_[region].per_sr = 1 / total_sr;
    const auto fill = static_cast<float>(gap_[region] / total_sr);
    (centre_[region].z < 0 ? divisor_[region].fill_below : divisor_[region].fill_above) = fill;
  }
}

RegionSums RegionSums::make(std::shared_ptr<const SkyGeometry> geometry, const SkyPartition& partition,
                            std::span<const std::uint8_t> needed) {
  RegionSums sums;
  sums.geometry_ = std::move(geometry);
  sums.texels_ = std::make_shared<const detail::TexelMatrix>(
      detail::TexelMatrix(detail::region_texels(*sums.geometry_, partition, needed)));
  sums.measure_coverage(partition);
  sums.set_divisors(partition, needed);
  return sums;
}

std::size_t RegionSums::bytes() const { return divisor_.size() * sizeof(Divisor) + texels_->bytes(); }

/// mean_i = (sum over pixels of weight_i L + gap_i * fill) / (covered_i + gap_i), by solid angle; of nodes over the
/// solid angle of the region: the integral of L times hat. The gap takes the fill of the half-space in which the
/// region's centre lies.
std::vector<Rgb> RegionSums::reduce(const SkyImage& sky) const {
  const Rgb above = sky.sky_fill_radiance(), below = sky.fill_radiance();
  std::vector<Rgb> mean(divisor_.size());
  parallel_for(tbb::blocked_range<std::size_t>(0, mean.size(), kGrain), [&](const auto& part) {
    std::vector<std::array<double, 3>> sums(part.size());
    texels_->sum(part.begin(), part.end(), sky.image().texels, sums);
    for (std::size_t region = part.begin(); region < part.end(); ++region) {
      const std::array<double, 3>& sum = sums[region - part.begin()];
      const Divisor& d = divisor_[region];
      mean[region] = Rgb(static_cast<float>(sum[0] * d.per_sr), static_cast<float>(sum[1] * d.per_sr),
                         static_cast<float>(sum[2] * d.per_sr)) +
                     d.fill_above * above + d.fill_below * below;
    }
  });
  for (const std::uint32_t region : unseen_)
    mean[region] = sky.radiance(centre_[region]);
  return mean;
}

double RegionSums::covered_fraction(int region) const {
  const auto r = static_cast<std::size_t>(region);
  const double total = covered_[r] + gap_[r];
  return total > 0 ? covered_[r] / total : 1.0;
}

std::vector<Rgb> region_radiance(const SkyImage& sky, const SkyPartition& partition) {
  return RegionSums::make(sky.geometry(), partition).reduce(sky);
}

} // namespace daylit
