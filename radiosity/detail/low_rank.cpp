#include "radiosity/detail/low_rank.h"

#include <algorithm>
#include <cmath>

namespace daylit::radiosity {

namespace {

double dot(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += static_cast<double>(a[k]) * static_cast<double>(b[k]);
  return sum;
}

void subtract(std::vector<float>& a, float factor, const std::vector<float>& b) {
  for (std::size_t k = 0; k < a.size(); ++k)
    a[k] -= factor * b[k];
}

std::size_t largest(const std::vector<float>& values, const std::vector<bool>& used) {
  std::size_t best = values.size();
  for (std::size_t k = 0; k < values.size(); ++k)
    if (!used[k] && (best == values.size() || std::abs(values[k]) > std::abs(values[best])))
      best = k;
  return best;
}

/// One rectangle while crosses are taken out of it.
class Crosses {
public:
  Crosses(const PairArrays& arrays, std::uint32_t row, std::uint32_t rows, std::uint32_t column, std::uint32_t columns)
      : arrays_(arrays), row_(row), column_(column), state_(std::max(rows, columns)), used_row_(rows, false),
        used_column_(columns, false) {}

  /// Row i of the remainder; false when the nine-point rule does not serve.
  bool remainder_row(std::uint32_t i, std::vector<float>& out) {
    out.resize(used_column_.size());
    if (!kernel(row_ + i, column_, out))
      return false;
    for (std::size_t k = 0; k < u_.size(); ++k)
      subtract(out, u_[k][i], v_[k]);
    return true;
  }
  bool remainder_column(std::uint32_t j, std::vector<float>& out) {
    out.resize(used_row_.size());
    if (!kernel(column_ + j, row_, out))
      return false;
    for (std::size_t k = 0; k < u_.size(); ++k)
      subtract(out, v_[k][j], u_[k]);
    return true;
  }

  /// One cross of the remainder R = G - U V^T with partial pivoting (Bebendorf 2000): v = R_i: / R_ij at the largest
  /// entry j of row i, u = R_:j; the next row is that of u's largest entry. |U V^T|_F^2 grows by |u|^2 |v|^2 +
  /// 2 sum_k (u . u_k)(v . v_k). True: |u| |v| <= tolerance |U V^T|_F. Nothing: give up.
  std::optional<bool> take(double tolerance) {
    std::vector<float> u, v;
    if (!remainder_row(static_cast<std::uint32_t>(next_row_), v))
      return std::nullopt;
    used_row_[next_row_] = true;
    const std::size_t j = largest(v, used_column_);
    if (j == v.size() || v[j] == 0.0f)
      return true;
    const float pivot = v[j];
    for (float& x : v)
      x /= pivot;
    if (!remainder_column(static_cast<std::uint32_t>(j), u))
      return std::nullopt;
    used_column_[j] = true;
    const double size2 = dot(u, u) * dot(v, v);
    for (std::size_t k = 0; k < u_.size(); ++k)
      norm2_ += 2.0 * dot(u, u_[k]) * dot(v, v_[k]);
    norm2_ += size2;
    next_row_ = largest(u, used_row_);
    u_.push_back(std::move(u));
    v_.push_back(std::move(v));
    return next_row_ == used_row_.size() || size2 <= tolerance * tolerance * norm2_;
  }

  std::size_t rank() const { return u_.size(); }

  LowRank result() const {
    LowRank r{static_cast<std::uint32_t>(rank()), {}};
    for (const auto* side : {&u_, &v_})
      for (std::size_t i = 0; i < (side->empty() ? 0 : side->front().size()); ++i)
        for (const std::vector<float>& vector : *side)
          r.values.push_back(vector[i]);
    return r;
  }

private:
  /// Row of the unoccluded exchange areas; false where a pair of it needs the contour integral.
  bool kernel(std::uint32_t one, std::uint32_t first, std::vector<float>& out) {
    pair_row(arrays_, one, first, first + static_cast<std::uint32_t>(out.size()), out.data(), state_.data());
    return std::none_of(state_.begin(), state_.begin() + static_cast<std::ptrdiff_t>(out.size()),
                        [](std::int32_t s) { return s == kNear; });
  }

  const PairArrays& arrays_;
  std::uint32_t row_, column_;
  std::size_t next_row_ = 0;
  std::vector<std::int32_t> state_;
  std::vector<bool> used_row_, used_column_;
  std::vector<std::vector<float>> u_, v_;
  double norm2_ = 0;
};

} // namespace

std::optional<LowRank> cross_approximation(const PairArrays& arrays, std::uint32_t row, std::uint32_t rows,
                                           std::uint32_t column, std::uint32_t columns, double tolerance) {
  Crosses crosses(arrays, row, rows, column, columns);
  // Two small crosses in a row: one alone may be small because its row happens to be empty.
  int small = 0;
  while (small < 2) {
    if (2 * crosses.rank() * (std::size_t{rows} + columns) > std::size_t{rows} * columns)
      return std::nullopt;
    const std::size_t before = crosses.rank();
    const std::optional<bool> done = crosses.take(tolerance);
    if (!done)
      return std::nullopt;
    if (crosses.rank() == before)
      break;
    small = *done ? small + 1 : 0;
  }
  return crosses.rank() > 0 ? std::optional(crosses.result()) : std::nullopt;
}

} // namespace daylit::radiosity
