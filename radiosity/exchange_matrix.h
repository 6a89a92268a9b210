#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace daylit::radiosity {

/// A rectangle of the matrix, in tree positions. One that is not on the diagonal stands for its mirror image too.
struct ExchangeBlock {
  std::uint32_t row = 0, rows = 0, column = 0, columns = 0;
  std::uint32_t rank = 0; ///< 0: dense
  /// Dense: rows x columns, row-major. Low rank, U V^T: U (rows x rank), then V (columns x rank), row-major.
  std::vector<float> values;

  bool diagonal() const { return row == column; }
};

/// Exchange areas G_ij = A_i F_ij = A_j F_ji in m^2 between patches, zero diagonal, exactly symmetric by construction:
/// a hierarchical matrix (Hackbusch 1999) of dense blocks, of low-rank blocks where the kernel is smooth and nothing
/// stands in between, and of nothing where two clusters cannot see each other. A small room is one dense block.
class ExchangeMatrix {
public:
  ExchangeMatrix() = default;
  ExchangeMatrix(std::vector<std::uint32_t> order, std::vector<ExchangeBlock> blocks);

  std::size_t size() const { return order_.size(); }
  /// Tree position -> patch. Vectors below are in tree order.
  const std::vector<std::uint32_t>& order() const { return order_; }
  const std::vector<ExchangeBlock>& blocks() const { return blocks_; }
  std::size_t bytes() const;

  /// y = G x; x, y: [tree position][column], row-major, `columns` wide. One thread; the bits depend on x only.
  void multiply(const float* x, std::size_t columns, float* y) const;

  /// Sum over j of G_ij per patch i (patch order), m^2.
  std::vector<double> row_sums() const;
  /// Those of S G S; `diagonal` S per patch.
  std::vector<double> scaled_row_sums(std::span<const double> diagonal) const;
  /// G becomes S G S.
  void scale(std::span<const double> diagonal);
  /// The whole matrix, [tree position][tree position], row-major.
  std::vector<float> dense_in_tree_order() const;

private:
  std::vector<std::uint32_t> order_;
  std::vector<ExchangeBlock> blocks_;
};

} // namespace daylit::radiosity
