#include "sh/quadrature.h"

#include <cmath>
#include <numbers>

#include "sh/detail/fft_plan.h"

namespace daylit::sh {
namespace {

using Wide = long double;
constexpr Wide kPi = std::numbers::pi_v<Wide>;
constexpr int kMaxSamples = 4 * kMaxDegree;

Error out_of_range(const char* where, const char* name, int value, int least, int most) {
  return {ErrorCode::parameter_out_of_range,
          std::string(name) + " is " + std::to_string(value) + ", must be " + std::to_string(least) + " to " +
              std::to_string(most),
          where};
}

/// P_n(cos theta) and its derivative by theta, with mu = 1 - cos theta (Reinsch's difference form:
/// d_l = P_l - P_{l-1} = (1 - 1/l) d_{l-1} - (2 - 1/l) mu P_{l-1}).
struct LegendreValue {
  Wide value, slope;
};
LegendreValue legendre(int n, Wide theta) {
  const Wide half = std::sin(theta / 2), mu = 2 * half * half;
  Wide p = 1, d = 0;
  for (int l = 1; l <= n; ++l) {
    const Wide inverse = Wide(1) / Wide(l);
    d = (1 - inverse) * d - (2 - inverse) * mu * p;
    p += d;
  }
  return {p, Wide(n) * (d - mu * p) / std::sin(theta)};
}

void set_node(LatitudeRule& rule, int i, Wide theta, Wide weight) {
  const int mirror = int(rule.theta.size()) - 1 - i;
  const Wide cosine = i == mirror ? Wide(0) : std::cos(theta);
  rule.theta[i] = double(theta);
  rule.cos_theta[i] = double(cosine);
  rule.sin_theta[i] = double(std::sin(theta));
  rule.weight[i] = double(weight);
  rule.theta[mirror] = double(kPi - theta);
  rule.cos_theta[mirror] = i == mirror ? 0.0 : -double(cosine);
  rule.sin_theta[mirror] = rule.sin_theta[i];
  rule.weight[mirror] = rule.weight[i];
}

LatitudeRule sized(int count, int exact_degree) {
  LatitudeRule rule;
  for (auto* v : {&rule.theta, &rule.cos_theta, &rule.sin_theta, &rule.weight})
    v->resize(std::size_t(count));
  rule.exact_degree = exact_degree;
  return rule;
}

/// cos(k pi / n) for any k, from a table of one period.
class CosineTable {
public:
  explicit CosineTable(int n) : period_(2L * n), values_(std::size_t(2) * n) {
    for (long k = 0; k < period_; ++k)
      values_[std::size_t(k)] = std::cos(kPi * Wide(k) / Wide(n));
  }
  Wide operator()(long k) const { return values_[std::size_t(k % period_)]; }

private:
  long period_;
  std::vector<Wide> values_;
};

RingGrid rings_of(const LatitudeRule& rule, int longitudes) {
  RingGrid grid;
  grid.cos_theta = rule.cos_theta;
  grid.sin_theta = rule.sin_theta;
  grid.longitudes = longitudes;
  grid.exact_degree = std::min(rule.exact_degree, longitudes - 1);
  for (const double w : rule.weight)
    grid.weight_sr.push_back(w * 2.0 * std::numbers::pi / longitudes);
  return grid;
}

} // namespace

Expected<LatitudeRule> gauss_legendre(int count) {
  if (count < 1 || count > kMaxSamples)
    return out_of_range("gauss_legendre", "count", count, 1, kMaxSamples);
  LatitudeRule rule = sized(count, 2 * count - 1);
  const Wide n = Wide(count);
  for (int i = 0; i < (count + 1) / 2; ++i) {
    const Wide phase = kPi * (Wide(4 * i + 3)) / (4 * n + 2);
    // Tricomi's asymptotic position; three Newton steps reach the last bit of long double for every n >= 2.
    Wide theta = phase + 1 / (8 * n * n * std::tan(phase));
    LegendreValue at{};
    for (int step = 0; step < 4; ++step) {
      at = legendre(count, theta);
      const Wide move = at.value / at.slope;
      theta -= move;
      if (std::abs(move) < Wide(1e-13) * theta)
        break;
    }
    at = legendre(count, theta);
    set_node(rule, i, theta, 2 / (at.slope * at.slope));
  }
  return rule;
}

Expected<LatitudeRule> fejer(int count) {
  if (count < 1 || count > kMaxSamples)
    return out_of_range("fejer", "count", count, 1, kMaxSamples);
  LatitudeRule rule = sized(count, count - 1);
  const CosineTable cosine(count);
  for (int i = 0; i < (count + 1) / 2; ++i) {
    Wide sum = 0;
    for (long j = count / 2; j >= 1; --j)
      sum += cosine(j * (2L * i + 1)) / Wide(4 * j * j - 1);
    set_node(rule, i, kPi * Wide(2 * i + 1) / Wide(2 * count), 2 * (1 - 2 * sum) / Wide(count));
  }
  return rule;
}

Expected<LatitudeRule> clenshaw_curtis(int count) {
  if (count < 2 || count > kMaxSamples)
    return out_of_range("clenshaw_curtis", "count", count, 2, kMaxSamples);
  LatitudeRule rule = sized(count, count - 1);
  const int n = count - 1;
  const CosineTable cosine(n);
  for (int i = 0; i < (count + 1) / 2; ++i) {
    Wide sum = 0;
    for (long j = n / 2; j >= 1; --j)
      sum += (2 * j == n ? 1 : 2) * cosine(2 * j * i) / Wide(4 * j * j - 1);
    set_node(rule, i, kPi * Wide(i) / Wide(n), (i == 0 ? 1 : 2) * (1 - sum) / Wide(n));
  }
  rule.sin_theta.front() = rule.sin_theta.back() = 0.0;
  return rule;
}

Expected<RingGrid> gauss_legendre_grid(int degree, int longitudes) {
  if (degree < 0 || degree > kMaxDegree)
    return out_of_range("gauss_legendre_grid", "degree", degree, 0, kMaxDegree);
  if (longitudes < 0 || longitudes > kMaxSamples)
    return out_of_range("gauss_legendre_grid", "longitudes", longitudes, 0, kMaxSamples);
  const auto rule = gauss_legendre(degree + 1);
  if (!rule)
    return rule.error();
  return rings_of(*rule, longitudes ? longitudes : detail::fast_even_length(2 * degree + 2));
}

Expected<RingGrid> equirectangular_grid(int width, int height) {
  if (width < 1 || width > kMaxSamples)
    return out_of_range("equirectangular_grid", "width", width, 1, kMaxSamples);
  const auto rule = fejer(height);
  if (!rule)
    return rule.error();
  RingGrid grid = rings_of(*rule, width);
  grid.turn = -1;
  grid.first_azimuth = std::numbers::pi - std::numbers::pi / width;
  return grid;
}

Expected<RingGrid> clenshaw_curtis_grid(int rings, int longitudes) {
  if (longitudes < 1 || longitudes > kMaxSamples)
    return out_of_range("clenshaw_curtis_grid", "longitudes", longitudes, 1, kMaxSamples);
  const auto rule = clenshaw_curtis(rings);
  if (!rule)
    return rule.error();
  return rings_of(*rule, longitudes);
}

} // namespace daylit::sh
