#pragma once

#include <cstddef>
#include <vector>

namespace daylit::detail {

/// Eigenvalues of a symmetric matrix [n][n], in no order; row k of the result is eigenvector k. Cyclic Jacobi rotations
/// until the rest is below 1e-12 of the diagonal (Golub, Van Loan, Matrix Computations, 8.5): for a few dozen rows.
std::vector<double> symmetric_eigen(std::vector<double> a, std::size_t n, std::vector<double>& values);

} // namespace daylit::detail
