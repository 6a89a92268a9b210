#include "sh/detail/legendre_engine.h"

#include <cmath>
#include <numbers>

namespace daylit::sh::detail {
namespace {

/// Tables of all orders are kept up to this degree (2 MB); above it building them on the way costs less than 5 %.
constexpr int kKeepTables = 511;
/// Amplitudes below exp(-kSkip) of the largest are left out: 1e-25, far below the rounding of the sums.
constexpr double kSkip = 58.0;

int padded_count(int m, int degree) { return (degree - m + kStep) / kStep * kStep; }

/// Exponent of the decay of P_lm from the turning point m = (l + 1/2) sin(theta_c) to theta < theta_c, by WKB:
/// the integral of sqrt(m^2 / sin^2 t - (l + 1/2)^2).
double decay_exponent(int degree, int m, double x, double sine) {
  const double lambda = degree + 0.5, q2 = double(m) * m - lambda * lambda * sine * sine;
  if (q2 <= 0.0)
    return 0.0;
  const double q = std::sqrt(q2);
  if (q >= m * x || q >= lambda * x)
    return sine == 0.0 && m > 0 ? 1e9 : 0.0;
  return m * std::atanh(q / (m * x)) - lambda * std::atanh(q / (lambda * x));
}

int last_order_of(int degree, double x, double sine) {
  int low = 0, high = degree; // decay grows with m
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (decay_exponent(degree, middle, x, sine) < kSkip)
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

} // namespace

void build_order(int m, int count, double* alpha, double* gamma) {
  const double m2 = 4.0 * double(m) * m - 1.0;
  for (int i = 1; i < count + 2; ++i) {
    // A^2 = 4 + (4 m^2 - 1) / (l^2 - m^2), l^2 - m^2 = i (2 m + i)
    const double d = double(i) * (2.0 * m + i);
    gamma[i] = std::sqrt(4.0 + m2 / d);
  }
  alpha[0] = 0.0;
  alpha[1] = gamma[1];
  double before = gamma[1], even = 1.0, odd = 1.0; // `before` = A_{i-1}
  gamma[0] = gamma[1] = 1.0;
  for (int i = 2; i < count + 2; ++i) {
    const double a = gamma[i];
    const double g = even * (a / before);
    alpha[i] = a * odd / g;
    gamma[i] = g;
    before = a;
    even = odd;
    odd = g;
  }
}

double sectoral_factor(int m) {
  return m == 0 ? 0.5 / std::sqrt(std::numbers::pi) : std::sqrt((2.0 * m + 1.0) / (2.0 * m));
}

LegendreEngine::LegendreEngine(std::vector<RingPair> pairs, int degree, std::size_t block_bytes, const Kernels& kernels)
    : pairs_(std::move(pairs)), degree_(degree), kernels_(&kernels) {
  const int lanes = kernels_->lanes;
  vectors_ = (int(pairs_.size()) + lanes - 1) / lanes;
  const std::size_t vector_bytes = std::size_t(degree_ + 2) * 2 * 3 * 2 * lanes * sizeof(double);
  vectors_per_block_ = int(std::max<std::size_t>(1, std::min<std::size_t>(vectors_, block_bytes / vector_bytes)));
  const std::size_t padded = std::size_t(vectors_) * lanes;
  x_.reserve(padded);
  sine_.reserve(padded);
  for (std::size_t i = 0; i < padded; ++i) {
    const RingPair& p = pairs_[std::min(i, pairs_.size() - 1)];
    x_[i] = p.x;
    sine_[i] = p.sine;
  }
  for (int v = 0; v < vectors_; ++v) { // the last lane is the one nearest to the equator
    const std::size_t i = std::size_t(v) * lanes + lanes - 1;
    last_order_.push_back(last_order_of(degree_, x_[i], sine_[i]));
  }
  const std::size_t block = std::size_t(vectors_per_block_) * lanes;
  state_.reserve(5 * block);
  live_.resize(std::size_t(vectors_per_block_));
  accumulators_.reserve(12 * block + 6 * kChunk * std::size_t(lanes));
  order_values_.reserve(6 * std::size_t(degree_ + 1 + kStep));
  std::size_t total = 0;
  const bool keep = degree_ <= kKeepTables;
  for (int m = 0; m <= degree_; ++m) {
    offset_.push_back(keep ? total : 0);
    total += std::size_t(padded_count(m, degree_)) + 2;
  }
  total = keep ? total : std::size_t(padded_count(0, degree_)) + 2;
  alpha_.resize(total);
  gamma_.resize(total);
  for (int m = 0; keep && m <= degree_; ++m)
    build_order(m, padded_count(m, degree_), &alpha_[offset_[std::size_t(m)]], &gamma_[offset_[std::size_t(m)]]);
}

int LegendreEngine::blocks() const { return (vectors_ + vectors_per_block_ - 1) / vectors_per_block_; }

int LegendreEngine::block_vectors(int block) const {
  return std::min(vectors_per_block_, vectors_ - block * vectors_per_block_);
}

const RingPair* LegendreEngine::pair(int vector, int lane) const {
  const std::size_t i = std::size_t(vector) * kernels_->lanes + lane;
  return i < pairs_.size() ? &pairs_[i] : nullptr;
}

Amplitudes LegendreEngine::amplitudes(int block, int channels) {
  // An odd stride in cache lines keeps rows of different vectors out of each other's sets.
  const int stride = (degree_ + 1) | 1;
  const std::size_t rows = std::size_t(block_vectors(block)) * 2 * channels;
  return {amplitudes_.reserve(rows * stride * 2 * kernels_->lanes), stride, channels};
}

double* LegendreEngine::row(const Amplitudes& a, int vector_in_block, int south, int channel) const {
  const std::size_t row = (std::size_t(vector_in_block) * 2 + south) * a.channels + channel;
  return a.data + row * a.order_stride * 2 * kernels_->lanes;
}

RingBlock LegendreEngine::begin_block(int block) {
  const std::size_t size = std::size_t(vectors_per_block_) * kernels_->lanes, at = std::size_t(block) * size;
  double* s = state_.data();
  for (std::size_t i = 0; i < size; ++i) {
    s[i] = 1.0;
    s[size + i] = 0.0;
  }
  return {block_vectors(block), x_.data() + at, sine_.data() + at, s,           s + size,
          s + 2 * size,         s + 3 * size,   s + 4 * size,      live_.data()};
}

OrderTable LegendreEngine::order_table(int m, const double** gamma) {
  const int count = padded_count(m, degree_);
  const std::size_t at = offset_[std::size_t(m)];
  if (degree_ > kKeepTables)
    build_order(m, count, alpha_.data(), gamma_.data());
  *gamma = gamma_.data() + at;
  return {alpha_.data() + at, count};
}

template <class PerOrder>
void LegendreEngine::for_each_order(int block, PerOrder&& body) {
  RingBlock rings = begin_block(block);
  const int start = first_vector(block);
  for (int m = 0, first = 0; m <= degree_; ++m) {
    while (first < rings.vectors && last_order(start + first) < m)
      ++first;
    if (first == rings.vectors)
      return;
    kernels_->start_order(rings, first, m, sectoral_factor(m));
    const double* gamma = nullptr;
    const OrderTable table = order_table(m, &gamma);
    body(rings, table, gamma, first, m);
  }
}

std::size_t LegendreEngine::order_offset(int m) const {
  return std::size_t(m) * std::size_t(degree_ + 1) - std::size_t(m) * std::size_t(m - 1) / 2;
}

/// body(l, m, position of (l, m) in by_order_), in tiles that touch few pages at a time on either side.
template <class Body>
void LegendreEngine::for_each_index(Body&& body) const {
  constexpr int kTile = 32;
  for (int m0 = 0; m0 <= degree_; m0 += kTile)
    for (int l = m0; l <= degree_; ++l)
      for (int m = m0; m <= std::min(l, m0 + kTile - 1); ++m)
        body(std::ptrdiff_t(l), std::ptrdiff_t(m), order_offset(m) + std::size_t(l - m));
}

void LegendreEngine::set_coefficients(const double* coefficients, int stride, int channels, double scale) {
  double* table = by_order_.reserve(order_offset(degree_ + 1) * 2 * std::size_t(channels));
  const auto copy = [&](auto count) {
    constexpr int kChannels = decltype(count)::value;
    for_each_index([&](std::ptrdiff_t l, std::ptrdiff_t m, std::size_t at) {
      const double* plus = coefficients + (l * l + l + m) * stride;
      const double* minus = plus - 2 * m * stride;
      const double f = m == 0 ? scale : scale * std::numbers::sqrt2, g = m == 0 ? 0.0 : -f;
      double* out = table + at * 2 * kChannels;
      for (int c = 0; c < kChannels; ++c) {
        out[2 * c] = f * plus[c];
        out[2 * c + 1] = g * minus[c];
      }
    });
  };
  channels == 3 ? copy(std::integral_constant<int, 3>()) : copy(std::integral_constant<int, 1>());
}

void LegendreEngine::get_coefficients(double* coefficients, int stride, int channels, double scale) const {
  const double* table = by_order_.data();
  const auto copy = [&](auto count) {
    constexpr int kChannels = decltype(count)::value;
    for_each_index([&](std::ptrdiff_t l, std::ptrdiff_t m, std::size_t at) {
      double* plus = coefficients + (l * l + l + m) * stride;
      double* minus = plus - 2 * m * stride;
      const double f = m == 0 ? scale : scale * std::numbers::sqrt2;
      const double* in = table + at * 2 * kChannels;
      for (int c = 0; c < kChannels; ++c) {
        if (m > 0)
          minus[c] = -f * in[2 * c + 1];
        plus[c] = f * in[2 * c];
      }
    });
  };
  channels == 3 ? copy(std::integral_constant<int, 3>()) : copy(std::integral_constant<int, 1>());
}

void LegendreEngine::synthesise(int block, const Amplitudes& out) {
  const std::size_t width = 2 * std::size_t(out.channels);
  double* values = order_values_.data();
  for_each_order(block, [&](const RingBlock& rings, const OrderTable& table, const double* gamma, int first, int m) {
    const std::size_t used = std::size_t(degree_ - m) + 1;
    const double* in = by_order_.data() + order_offset(m) * width;
    for (std::size_t i = 0; i < used; ++i)
      for (std::size_t k = 0; k < width; ++k)
        values[i * width + k] = in[i * width + k] * gamma[i];
    std::fill(values + used * width, values + std::size_t(table.count) * width, 0.0);
    kernels_->synthesise_order(rings, table, first, m, values, accumulators_.data(), out);
  });
}

void LegendreEngine::analyse(int block, const Amplitudes& in) {
  const std::size_t width = 2 * std::size_t(in.channels);
  double* sums = by_order_.reserve(order_offset(degree_ + 1) * width);
  if (block == 0)
    std::fill(sums, sums + order_offset(degree_ + 1) * width, 0.0);
  double* values = order_values_.data();
  for_each_order(block, [&](const RingBlock& rings, const OrderTable& table, const double* gamma, int first, int m) {
    std::fill(values, values + std::size_t(table.count) * width, 0.0);
    kernels_->analyse_order(rings, table, first, m, values, accumulators_.data(), in);
    double* out = sums + order_offset(m) * width;
    for (std::size_t i = 0; i < std::size_t(degree_ - m) + 1; ++i)
      for (std::size_t k = 0; k < width; ++k)
        out[i * width + k] += values[i * width + k] * gamma[i];
  });
}

} // namespace daylit::sh::detail
