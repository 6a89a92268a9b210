#include "radiosity/exchange_matrix.h"

#include <algorithm>

#include <cblas.h>

#include "scene/core/parallel.h"

namespace daylit::radiosity {

namespace {

/// c += a b, or a^T b; c has m rows and w columns.
void add_product(CBLAS_TRANSPOSE transpose, std::size_t m, std::size_t w, std::size_t k, const float* a,
                 std::size_t stride, const float* b, float* c) {
  const auto width = static_cast<int>(w);
  cblas_sgemm(CblasRowMajor, transpose, CblasNoTrans, static_cast<int>(m), width, static_cast<int>(k), 1.0f, a,
              static_cast<int>(stride), b, width, 1.0f, c, width);
}

/// y += B x for a block, and y += B^T x for its mirror image.
void apply_dense(const ExchangeBlock& b, const float* x, std::size_t w, float* y) {
  add_product(CblasNoTrans, b.rows, w, b.columns, b.values.data(), b.columns, x + b.column * w, y + b.row * w);
  if (!b.diagonal())
    add_product(CblasTrans, b.columns, w, b.rows, b.values.data(), b.columns, x + b.row * w, y + b.column * w);
}

/// The same of B = U V^T: y += U (V^T x), y += V (U^T x).
void apply_low_rank(const ExchangeBlock& b, const float* x, std::size_t w, std::vector<float>& work, float* y) {
  const float *u = b.values.data(), *v = u + std::size_t{b.rows} * b.rank;
  work.assign(b.rank * w, 0.0f);
  add_product(CblasTrans, b.rank, w, b.columns, v, b.rank, x + b.column * w, work.data());
  add_product(CblasNoTrans, b.rows, w, b.rank, u, b.rank, work.data(), y + b.row * w);
  work.assign(b.rank * w, 0.0f);
  add_product(CblasTrans, b.rank, w, b.rows, u, b.rank, x + b.row * w, work.data());
  add_product(CblasNoTrans, b.columns, w, b.rank, v, b.rank, work.data(), y + b.column * w);
}

} // namespace

ExchangeMatrix::ExchangeMatrix(std::vector<std::uint32_t> order, std::vector<ExchangeBlock> blocks)
    : order_(std::move(order)), blocks_(std::move(blocks)) {}

std::size_t ExchangeMatrix::bytes() const {
  std::size_t sum = order_.size() * sizeof(std::uint32_t) + blocks_.size() * sizeof(ExchangeBlock);
  for (const ExchangeBlock& b : blocks_)
    sum += b.values.size() * sizeof(float);
  return sum;
}

void ExchangeMatrix::multiply(const float* x, std::size_t columns, float* y) const {
  std::fill_n(y, size() * columns, 0.0f);
  std::vector<float> work;
  for (const ExchangeBlock& b : blocks_) {
    if (b.rank == 0)
      apply_dense(b, x, columns, y);
    else
      apply_low_rank(b, x, columns, work, y);
  }
}

std::vector<double> ExchangeMatrix::row_sums() const { return scaled_row_sums(std::vector<double>(size(), 1.0)); }

/// sum_j s_i G_ij s_j of every i, m^2: one product with s.
std::vector<double> ExchangeMatrix::scaled_row_sums(std::span<const double> diagonal) const {
  std::vector<float> x(size()), sum(size());
  for (std::size_t k = 0; k < size(); ++k)
    x[k] = static_cast<float>(diagonal[order_[k]]);
  multiply(x.data(), 1, sum.data());
  std::vector<double> result(size());
  for (std::size_t k = 0; k < size(); ++k)
    result[order_[k]] = diagonal[order_[k]] * static_cast<double>(sum[k]);
  return result;
}

/// Blocks become s_i B_ij s_j; of a product U V^T the rows of either factor are scaled.
void ExchangeMatrix::scale(std::span<const double> diagonal) {
  std::vector<float> s(size());
  for (std::size_t k = 0; k < size(); ++k)
    s[k] = static_cast<float>(diagonal[order_[k]]);
  parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t k) {
    ExchangeBlock& b = blocks_[k];
    float* v = b.values.data();
    if (b.rank > 0)
      for (std::uint32_t i = 0; i < b.rows + b.columns; ++i)
        for (std::uint32_t r = 0; r < b.rank; ++r)
          *v++ *= s[i < b.rows ? b.row + i : b.column + i - b.rows];
    else
      for (std::uint32_t i = 0; i < b.rows; ++i)
        for (std::uint32_t j = 0; j < b.columns; ++j)
          *v++ *= s[b.row + i] * s[b.column + j];
  });
}

std::vector<float> ExchangeMatrix::dense_in_tree_order() const {
  const std::size_t n = size();
  std::vector<float> result(n * n, 0.0f), block;
  for (const ExchangeBlock& b : blocks_) {
    const float* values = b.values.data();
    if (b.rank > 0) {
      block.assign(std::size_t{b.rows} * b.columns, 0.0f);
      cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, static_cast<int>(b.rows), static_cast<int>(b.columns),
                  static_cast<int>(b.rank), 1.0f, values, static_cast<int>(b.rank),
                  values + std::size_t{b.rows} * b.rank, static_cast<int>(b.rank), 0.0f, block.data(),
                  static_cast<int>(b.columns));
      values = block.data();
    }
    for (std::size_t i = 0; i < b.rows; ++i)
      for (std::size_t j = 0; j < b.columns; ++j) {
        result[(b.row + i) * n + b.column + j] = values[i * b.columns + j];
        result[(b.column + j) * n + b.row + i] = values[i * b.columns + j];
      }
  }
  return result;
}

} // namespace daylit::radiosity
