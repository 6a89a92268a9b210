#include "sh/band_probe.h"

#include <algorithm>
#include <cmath>

#include "sh/detail/aligned_buffer.h"
#include "sh/detail/check.h"
#include "sh/detail/difference_table.h"
#include "sh/detail/legendre_engine.h"

namespace daylit::sh {
namespace {

/// (c_{l,m}, c_{l,-m}) of one order, degree by degree and channel by channel.
void gather_pairs(std::span<const double> c, int degree, int channels, int m, std::vector<double>& pairs) {
  pairs.clear();
  for (std::ptrdiff_t l = m; l <= degree; ++l)
    for (std::ptrdiff_t k = 0; k < channels; ++k) {
      pairs.push_back(c[std::size_t((l * l + l + m) * channels + k)]);
      pairs.push_back(m == 0 ? 0.0 : c[std::size_t((l * l + l - m) * channels + k)]);
    }
}

} // namespace

Expected<BandProbe> BandProbe::create(std::span<const double> coefficients, int channels, std::span<const double> x,
                                      std::span<const double> y, std::span<const double> z) {
  constexpr const char* where = "BandProbe::create";
  BandProbe probe;
  probe.channels_ = channels;
  probe.directions_ = x.size();
  const std::size_t per_channel = channels > 0 ? coefficients.size() / std::size_t(channels) : 0;
  probe.degree_ = int(std::lround(std::sqrt(double(per_channel)))) - 1;
  if (const auto ok = detail::check_degree(probe.degree_, where); !ok)
    return ok.error();
  const std::size_t degrees = std::size_t(probe.degree_) + 1;
  if (const auto ok =
          detail::check_count(coefficients.size(), degrees * degrees * std::size_t(channels), "coefficients", where);
      !ok)
    return ok.error();
  if (x.empty() || y.size() != x.size() || z.size() != x.size())
    return Error{ErrorCode::wrong_count, "x, y and z are empty or differ in length", where};

  const detail::Kernels& kernels = detail::kernels();
  const std::size_t lanes = std::size_t(kernels.lanes), padded = (x.size() + lanes - 1) / lanes * lanes;
  detail::AlignedBuffer fields(9 * padded), values(padded * degrees * std::size_t(channels));
  detail::BatchState<double> state{{}, padded};
  for (std::size_t k = 0; k < 9; ++k)
    state.field[k] = fields.data() + k * padded;
  for (std::size_t i = 0; i < padded; ++i) {
    const std::size_t at = std::min(i, x.size() - 1);
    detail::Directions<double> d{};
    if (!detail::polar<double>(x[at], y[at], z[at], d))
      return Error{ErrorCode::not_a_unit_direction, "direction " + std::to_string(at) + " is not of unit length",
                   where};
    const double set[5] = {d.mu, d.sine, d.hemisphere, d.cosine1, d.sine1};
    for (std::size_t k = 0; k < 5; ++k)
      state.field[k][i] = set[k];
  }
  detail::DifferenceTable<double> table;
  std::vector<double> pairs;
  for (int m = 0; m <= probe.degree_; ++m) {
    const int count = probe.degree_ - m + 1;
    table.build(m, count);
    gather_pairs(coefficients, probe.degree_, channels, m, pairs);
    kernels.add_band_values(state,
                            {table.a.data(), table.b.data(), table.q.data(), m, count, detail::sectoral_factor(m)},
                            pairs.data(), channels, values.data());
  }
  const std::size_t series = degrees * std::size_t(channels); // per direction
  probe.values_.resize(x.size() * series);
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t k = 0; k < series; ++k)
      probe.values_[i * series + k] = values[(i / lanes * series + k) * lanes + i % lanes];
  return probe;
}

std::vector<double> BandProbe::mean_relative_errors(std::span<const double> bands, bool ratio) const {
  const std::size_t degrees = std::size_t(degree_) + 1, channels = std::size_t(channels_);
  const std::size_t shown = ratio ? channels - 1 : channels, used = std::min(bands.size(), degrees);
  std::vector<double> error(degrees, 0.0), full(channels), part(channels);
  for (std::size_t i = 0; i < directions_; ++i) {
    const double* v = values_.data() + i * degrees * channels;
    std::fill(full.begin(), full.end(), 0.0);
    for (std::size_t l = used; l-- > 0;) // small contributions first
      for (std::size_t c = 0; c < channels; ++c)
        full[c] += bands[l] * v[l * channels + c];
    std::fill(part.begin(), part.end(), 0.0);
    for (std::size_t l = degrees; l-- > 0;) {
      for (std::size_t c = 0; c < shown; ++c) {
        // part = what the bands above l contribute; truncated = full - part.
        const double truth = ratio ? full[c] / full[shown] : full[c];
        const double cut = ratio ? (full[c] - part[c]) / (full[shown] - part[shown]) : full[c] - part[c];
        const double off = std::abs(cut - truth);
        error[l] += off == 0.0 ? 0.0 : off / std::abs(truth);
      }
      for (std::size_t c = 0; c < channels && l < used; ++c)
        part[c] += bands[l] * v[l * channels + c];
    }
  }
  for (double& e : error)
    e /= double(directions_ * std::max<std::size_t>(1, shown));
  return error;
}

int BandProbe::needed_degree(std::span<const double> bands, bool ratio, double tolerance) const {
  const std::vector<double> error = mean_relative_errors(bands, ratio);
  int degree = degree_;
  while (degree > 0 && error[std::size_t(degree) - 1] < tolerance)
    --degree;
  return degree;
}

} // namespace daylit::sh
