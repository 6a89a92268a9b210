#include "radiosity/detail/cholesky.h"

#include <cblas.h>

// LAPACK's own name: Debian's OpenBLAS carries it without a C header.
extern "C" void spotrf_(const char* triangle, const int* n, float* a, const int* stride, int* info);

namespace daylit::radiosity {

namespace {
constexpr std::size_t kLargest = 12000; // 576 MB
} // namespace

/// I - S G S = L L^T: symmetric, and positive definite while every closed room absorbs something.
std::optional<CholeskyFactor> CholeskyFactor::of(const ExchangeMatrix& exchange, const std::vector<float>& scale) {
  CholeskyFactor f;
  f.n_ = exchange.size();
  f.factor_ = exchange.dense_in_tree_order();
  for (std::size_t i = 0; i < f.n_; ++i)
    for (std::size_t j = 0; j < f.n_; ++j)
      f.factor_[i * f.n_ + j] = (i == j ? 1.0f : 0.0f) - scale[i] * f.factor_[i * f.n_ + j] * scale[j];
  const auto n = static_cast<int>(f.n_);
  int info = 0;
  spotrf_("U", &n, f.factor_.data(), &n, &info); // column-major upper = row-major lower
  return info == 0 ? std::optional(std::move(f)) : std::nullopt;
}

/// L (L^T z) = r, for all columns at once.
void CholeskyFactor::solve(float* right_sides, std::size_t columns) const {
  const auto n = static_cast<int>(n_), w = static_cast<int>(columns);
  for (const CBLAS_TRANSPOSE transpose : {CblasNoTrans, CblasTrans})
    cblas_strsm(CblasRowMajor, CblasLeft, CblasLower, transpose, CblasNonUnit, n, w, 1.0f, factor_.data(), n,
                right_sides, w);
}

/// Multiply-adds: n^3 / 6 for the factor and n^2 per column, against one product with the matrix per column and step.
/// One more product each gives the residual.
bool CholeskyFactor::cheaper(const ExchangeMatrix& exchange, std::size_t columns, int iterations) {
  const auto n = static_cast<double>(exchange.size()), w = static_cast<double>(columns);
  if (exchange.size() > kLargest)
    return false;
  double product = 0; // multiply-adds of one product with one column
  for (const ExchangeBlock& b : exchange.blocks())
    product += (b.diagonal() ? 1.0 : 2.0) * static_cast<double>(b.values.size());
  return n * n * n / 6.0 + n * n + w * (n * n + product) < w * product * iterations;
}

} // namespace daylit::radiosity
