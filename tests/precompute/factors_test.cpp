// Factors of a block whose singular components are known in closed form.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "precompute/detail/factors.h"

namespace daylit::precompute::detail {
namespace {

constexpr std::size_t kRows = 64, kSources = 256, kWidth = 24;

/// Orthonormal rows k, columns i (discrete cosine transform, type 2).
double cosine(std::size_t k, std::size_t i, std::size_t n) {
  return std::sqrt((k == 0 ? 1.0 : 2.0) / static_cast<double>(n)) *
         std::cos(std::numbers::pi * static_cast<double>(k) * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
}

double strength(std::size_t k) { return 3.0 / (1.0 + static_cast<double>(k)); }

/// Root of the metric of a source: M = diag(d^2).
double root(std::size_t s) { return 0.2 + 0.01 * static_cast<double>(s % 97); }

/// [rows][kSources]: sums of `count` terms.
template <class Term>
std::vector<float> product(std::size_t rows, std::size_t count, const Term& term) {
  std::vector<float> out;
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t s = 0; s < kSources; ++s) {
      double sum = 0;
      for (std::size_t k = 0; k < count; ++k)
        sum += term(r, s, k);
      out.push_back(static_cast<float>(sum));
    }
  return out;
}

/// sum over k of strength_k u_k v_k^T / d: its singular values in the metric M are the strengths.
std::vector<float> block() {
  return product(kRows, kRows, [](std::size_t r, std::size_t s, std::size_t k) {
    return strength(k) * cosine(k, r, kRows) * cosine(k, s, kSources) / root(s);
  });
}

/// Orthonormal too (type 4), columns in a scattered order: the first ones hold something of every row.
double mixed(std::size_t k, std::size_t c, std::size_t n) {
  return std::sqrt(2.0 / static_cast<double>(n)) *
         std::cos(std::numbers::pi * (static_cast<double>(k) + 0.5) * (static_cast<double>(c * 89 % n) + 0.5) /
                  static_cast<double>(n));
}

/// d times an orthogonal matrix: sample sample^T = M.
const std::vector<float>& sample() {
  static const std::vector<float> once = product(kSources, kSources, [](std::size_t s, std::size_t c, std::size_t k) {
    return root(s) * cosine(k, s, kSources) * mixed(k, c, kSources);
  });
  return once;
}

double dot(const std::vector<float>& a, std::size_t k, std::size_t l, std::size_t length) {
  double sum = 0;
  for (std::size_t i = 0; i < length; ++i)
    sum += static_cast<double>(a[k * length + i]) * static_cast<double>(a[l * length + i]);
  return sum;
}

TEST(Factors, are_the_strongest_singular_components_in_the_metric) {
  const Factors f = decompose(block(), kRows, sample(), kWidth);
  ASSERT_EQ(f.rank(), kWidth);
  double kept = 0, best = 0;
  for (std::size_t k = 0; k < kWidth; ++k) {
    kept += f.power[k];
    best += strength(k) * strength(k);
    for (std::size_t l = 0; l <= k; ++l)
      EXPECT_NEAR(dot(f.row_factor, k, l, kRows), k == l ? 1.0 : 0.0, 1e-4) << k << " " << l;
  }
  double left = 0; // by the best of this rank
  for (std::size_t k = kWidth; k < kRows; ++k)
    left += strength(k) * strength(k);
  EXPECT_LT(best - kept, 0.1 * left);
  for (std::size_t k = 0; k < kWidth / 2; ++k)
    EXPECT_NEAR(f.power[k], strength(k) * strength(k), 0.02 * strength(k) * strength(k)) << k;
}

TEST(Factors, of_full_width_give_the_block) {
  const std::vector<float> transport = block();
  const Factors f = decompose(transport, kRows, sample(), kRows);
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t s = 0; s < kSources; ++s) {
      double sum = 0;
      for (std::size_t k = 0; k < f.rank(); ++k)
        sum +=
            static_cast<double>(f.row_factor[k * kRows + r]) * static_cast<double>(f.source_factor[k * kSources + s]);
      ASSERT_NEAR(sum, static_cast<double>(transport[r * kSources + s]), 1e-4) << r << " " << s;
    }
}

TEST(Factors, of_nothing_are_none) {
  const std::vector<float> black(kRows * kSources, 0.0f);
  EXPECT_EQ(decompose(black, kRows, sample(), kWidth).rank(), 0u);
  EXPECT_EQ(decompose({}, 0, {}, kWidth).rank(), 0u);
}

} // namespace
} // namespace daylit::precompute::detail
