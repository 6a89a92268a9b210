#include "sh/rotation.h"

#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "sh/detail/aligned_buffer.h"
#include "sh/detail/check.h"

namespace daylit::sh {
namespace {

using detail::AlignedBuffer;

struct EulerZyz {
  double a, b, c;
};

EulerZyz euler_zyz(const glm::dmat3& r) {
  // Third column = R z = (cos a sin b, sin a sin b, cos b); third row = (-sin b cos c, sin b sin c, cos b).
  const double s = std::hypot(r[2].x, r[2].y), b = std::atan2(s, r[2].z);
  if (s > 1e-8)
    return {std::atan2(r[2].y, r[2].x), b, std::atan2(r[1].z, -r[0].z)};
  // z stays on its axis up to 1e-8: a carries that tilt, a + c (or a - c) the turn, from the x-y block.
  const double a = s > 0.0 ? std::atan2(r[2].y, r[2].x) : 0.0;
  if (r[2].z > 0.0)
    return {a, b, std::atan2(r[0].y - r[1].x, r[0].x + r[1].y) - a};
  return {a, b, a - std::atan2(-r[0].y - r[1].x, r[1].y - r[0].x)};
}

/// c'_m, c'_-m = turn of (c_m, c_-m) by m angle.
void rotate_z(double angle, int degree, int channels, std::span<double> c) {
  for (int m = 1; m <= degree; ++m) {
    const double cosine = std::cos(m * angle), sine = std::sin(m * angle);
    for (std::ptrdiff_t l = m; l <= degree; ++l)
      for (int k = 0; k < channels; ++k) {
        double& plus = c[std::size_t((l * l + l + m) * channels + k)];
        double& minus = c[std::size_t((l * l + l - m) * channels + k)];
        const double p = plus * cosine - minus * sine;
        minus = plus * sine + minus * cosine;
        plus = p;
      }
  }
}

/// The quarter turns about y. In the real basis, with rows n and columns m >= 0,
///   cosine harmonics: 2 (-1)^l e_n e_m d^l_nm where l + n + m is even, else 0,
///   sine harmonics:  -2 (-1)^l d^l_nm where l + n + m is odd, else 0,      e_0 = 1/sqrt 2, else 1,
/// with d at pi/2 (Wigner's convention). So in_[0] interleaves cosine harmonics in even columns with sine ones in odd
/// columns, in_[1] the other two halves, and every d^l_nm meets exactly one of them.
class QuarterTurn {
public:
  explicit QuarterTurn(int degree)
      : degree_(degree), lanes_(std::size_t(detail::kernels().lanes)), degrees_(std::size_t(degree) + 1) {
    const std::size_t size = (degrees_ + lanes_ - 1) / lanes_ * lanes_ * degrees_;
    for (AlignedBuffer* b : {&first_, &second_, &in_[0], &in_[1], &out_[0], &out_[1]})
      b->reserve(size);
    for (int l = 0; l < degree_; ++l)
      for (int m = 0; m <= l; ++m) {
        const double v = std::sqrt(double(l - m) * (l + m)), next = std::sqrt(double(l + 1 - m) * (l + 1 + m));
        first_[at(l, m)] = m / next;
        second_[at(l, m)] = v / next;
      }
    for (Row& row : rows_) {
      row.values.reserve(4 * degrees_);
      row.sums.reserve(2 * lanes_ * degrees_);
    }
    lane_values_.reserve(4 * lanes_);
  }

  void apply(bool inverse, int channels, int channel, std::span<double> c) {
    read(channels, channel, c);
    central_ = 1.0;
    for (int n = 0; n <= degree_; n += kTile) {
      const int end = std::min(degree_ + 1, n + kTile);
      for (int i = n; i < end; ++i)
        begin_row(i);
      for (int m0 = 0; m0 < end; m0 += int(lanes_))
        for (int i = std::max(n, m0); i < end; ++i)
          apply_columns(i, m0, inverse);
      for (int i = n; i < end; ++i)
        finish_row(i);
    }
    write(channels, channel, c);
  }

private:
  /// Rows that share the columns while these are in the second-level cache.
  static constexpr int kTile = 4;
  struct Row {
    AlignedBuffer values; ///< two factors of the recurrence, cosine and sine input, by degree from n
    AlignedBuffer sums;
    double mantissa = 0.0, exponent = 0.0; ///< d^n_{n,m} of the next column
  };

  /// A vector of columns is contiguous over the degrees.
  std::size_t at(int l, int m) const {
    const std::size_t column = std::size_t(m);
    return (column / lanes_ * degrees_ + std::size_t(l)) * lanes_ + column % lanes_;
  }
  Row& row(int n) { return rows_[std::size_t(n % kTile)]; }

  void read(int channels, int channel, std::span<const double> c) {
    for (AlignedBuffer& out : out_)
      std::fill(out.data(), out.data() + (degrees_ + lanes_ - 1) / lanes_ * lanes_ * degrees_, 0.0);
    for (int m = 0; m <= degree_; ++m)
      for (int l = m; l <= degree_; ++l) {
        const std::size_t centre = std::size_t(l) * std::size_t(l) + std::size_t(l);
        const std::size_t plus = (centre + std::size_t(m)) * std::size_t(channels) + std::size_t(channel);
        const std::size_t minus = (centre - std::size_t(m)) * std::size_t(channels) + std::size_t(channel);
        in_[m & 1][at(l, m)] = m == 0 ? c[plus] / std::numbers::sqrt2 : c[plus];
        in_[1 - (m & 1)][at(l, m)] = m == 0 ? 0.0 : c[minus];
      }
  }

  void write(int channels, int channel, std::span<double> c) const {
    for (int m = 0; m <= degree_; ++m)
      for (int l = m; l <= degree_; ++l) {
        const double sign = l & 1 ? -2.0 : 2.0;
        const std::size_t centre = std::size_t(l) * std::size_t(l) + std::size_t(l);
        const std::size_t plus = (centre + std::size_t(m)) * std::size_t(channels) + std::size_t(channel);
        const std::size_t minus = (centre - std::size_t(m)) * std::size_t(channels) + std::size_t(channel);
        if (m > 0)
          c[minus] = -sign * out_[1 - (m & 1)][at(l, m)];
        c[plus] = sign * (m == 0 ? 1.0 / std::numbers::sqrt2 : 1.0) * out_[m & 1][at(l, m)];
      }
  }

  /// Row factors of d_{l+1} = -(2l+1) n m / (l u' v') d_l - (l+1) u v / (l u' v') d_{l-1}, u^2 = l^2 - n^2,
  /// v^2 = l^2 - m^2, primes for l + 1; the input of row n; the start |d^n_{n,0}| = 2^-n sqrt((2n)!) / n!.
  void begin_row(int n) {
    Row& r = row(n);
    for (int l = n; l <= degree_; ++l) {
      const std::size_t i = std::size_t(l - n);
      r.values[i] = l == 0 || l == degree_ ? 0.0 : -(2.0 * l + 1.0) / l * first_[at(l, n)];
      r.values[degrees_ + i] = l == 0 || l == degree_ ? 0.0 : (l + 1.0) / l * second_[at(l, n)];
      r.values[2 * degrees_ + i] = in_[n & 1][at(l, n)];
      r.values[3 * degrees_ + i] = in_[1 - (n & 1)][at(l, n)];
    }
    std::fill(r.sums.data(), r.sums.data() + 2 * lanes_ * std::size_t(degree_ - n + 1), 0.0);
    if (n > 0)
      central_ *= std::sqrt((2.0 * n - 1.0) / (2.0 * n));
    r.mantissa = n & 1 ? -central_ : central_;
    r.exponent = 0.0;
  }

  void apply_columns(int n, int m0, bool inverse) {
    Row& r = row(n);
    double *start = lane_values_.data(), *start_exp = start + lanes_, *row_sign = start + 2 * lanes_,
           *column_sign = start + 3 * lanes_;
    for (std::size_t k = 0; k < lanes_; ++k) {
      const int m = m0 + int(k);
      start[k] = m <= n ? r.mantissa : 0.0;
      start_exp[k] = m <= n ? r.exponent : 0.0;
      const double parity = (n - m) & 1 ? -1.0 : 1.0;
      row_sign[k] = inverse ? parity : 1.0;                     // row n of the turn, or of its transpose
      column_sign[k] = m == n ? 0.0 : (inverse ? 1.0 : parity); // column n; the diagonal is part of row n
      if (m < n)
        r.mantissa *= -std::sqrt(double(n - m) / double(n + m + 1));
      if (std::abs(r.mantissa) < detail::kSmall) {
        r.mantissa *= detail::kScaleUp;
        r.exponent -= 1.0;
      }
    }
    const std::size_t origin = at(n, m0);
    const double* values = r.values.data();
    detail::kernels().rotate_columns({n,
                                      degree_,
                                      start,
                                      start_exp,
                                      first_.data() + origin,
                                      second_.data() + origin,
                                      values,
                                      values + degrees_,
                                      row_sign,
                                      column_sign,
                                      values + 2 * degrees_,
                                      values + 3 * degrees_,
                                      {in_[0].data() + origin, in_[1].data() + origin},
                                      {out_[0].data() + origin, out_[1].data() + origin},
                                      r.sums.data()});
  }

  /// Even and odd lanes of the row sums belong to cosine and sine harmonics, or the other way round.
  void finish_row(int n) {
    const double* vectors = row(n).sums.data();
    for (int l = n; l <= degree_; ++l) {
      double sums[2][2] = {};
      for (std::size_t q = 0; q < 2; ++q)
        for (std::size_t k = 0; k < lanes_; ++k)
          sums[q][k & 1] += vectors[(std::size_t(l - n) * 2 + q) * lanes_ + k];
      out_[n & 1][at(l, n)] += sums[0][0] + sums[1][1];
      out_[1 - (n & 1)][at(l, n)] += sums[0][1] + sums[1][0];
    }
  }

  int degree_;
  std::size_t lanes_, degrees_;
  double central_ = 1.0;
  AlignedBuffer first_, second_, in_[2], out_[2], lane_values_;
  std::array<Row, kTile> rows_;
};

} // namespace

Expected<void> rotate(const glm::dmat3& rotation, int degree, int channels, std::span<double> coefficients) {
  constexpr const char* where = "rotate";
  if (const auto ok = detail::check_degree(degree, where, kMaxRotationDegree); !ok)
    return ok;
  if (const auto ok = detail::check_coefficients(coefficients.size(), degree, channels, where); !ok)
    return ok;
  if (const auto ok = detail::check_finite<double>(coefficients, "coefficient", where); !ok)
    return ok;
  const glm::dvec3 x = glm::normalize(rotation[0]), z = glm::normalize(glm::cross(x, rotation[1])),
                   y = glm::cross(z, x);
  double off = 0.0;
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 delta = rotation[i] - (i == 0 ? x : i == 1 ? y : z);
    off = std::max({std::isnan(off) ? 1.0 : off, std::abs(delta.x), std::abs(delta.y), std::abs(delta.z)});
    if (!(off <= 1e-6) || !(glm::dot(delta, delta) <= 1e-11))
      return Error{ErrorCode::parameter_out_of_range, "matrix is not a rotation (orthonormal, determinant +1)", where};
  }
  const EulerZyz angles = euler_zyz(glm::dmat3(x, y, z));
  QuarterTurn turn(degree);
  constexpr double quarter = std::numbers::pi / 2.0;
  rotate_z(angles.c + quarter, degree, channels, coefficients);
  for (int c = 0; c < channels; ++c)
    turn.apply(false, channels, c, coefficients);
  rotate_z(angles.b, degree, channels, coefficients);
  for (int c = 0; c < channels; ++c)
    turn.apply(true, channels, c, coefficients);
  rotate_z(angles.a - quarter, degree, channels, coefficients);
  return {};
}

} // namespace daylit::sh
