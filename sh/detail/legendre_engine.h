#pragma once

// The Legendre half of every transform: rings at +-x packed into vectors, blocks of vectors, and the loop over orders.
// What happens in longitude (FFT for regular rings, direct sums for scattered directions) is the caller's.

#include <vector>

#include "sh/detail/aligned_buffer.h"
#include "sh/detail/kernels.h"

namespace daylit::sh::detail {

/// Recurrence of order m in scaled form, degrees m .. m + count + 1: p_i = alpha_i x p_{i-1} - p_{i-2},
/// P_{m+i,m} = gamma_i p_i, p_0 = P_mm. From P_l = A_l x P_{l-1} - (A_l / A_{l-1}) P_{l-2},
/// A_l = sqrt((4 l^2 - 1) / (l^2 - m^2)): gamma_i = gamma_{i-2} A_i / A_{i-1}, alpha_i = A_i gamma_{i-1} / gamma_i.
/// Orthonormal, no Condon-Shortley phase, without the factor sqrt 2 of the real harmonics.
void build_order(int m, int count, double* alpha, double* gamma);

/// P_00 and the factors sqrt((2m + 1) / 2m) that lead from P_{m-1,m-1} to P_mm / sin theta.
double sectoral_factor(int m);

/// A ring pair at cos(theta) = +-x. Row numbers are the caller's; -1: this half does not exist.
struct RingPair {
  double x, sine;
  int north, south;
  double north_weight, south_weight;
};

class LegendreEngine {
public:
  /// `pairs` in order of falling x (pole first). `block_bytes`: limit of the amplitudes of three channels.
  LegendreEngine(std::vector<RingPair> pairs, int degree, std::size_t block_bytes, const Kernels& kernels);

  int degree() const { return degree_; }
  int lanes() const { return kernels_->lanes; }
  const Kernels& kernels() const { return *kernels_; }
  int blocks() const;
  int block_vectors(int block) const;
  int first_vector(int block) const { return block * vectors_per_block_; }
  const std::vector<RingPair>& pairs() const { return pairs_; }
  /// Pair in a lane of a vector, or null in the padding of the last one.
  const RingPair* pair(int vector, int lane) const;
  /// Orders above this one vanish (relative 1e-25) on every ring of the vector at every degree of the transform.
  int last_order(int vector) const { return last_order_[std::size_t(vector)]; }

  /// Amplitudes of a block for `channels` (1 or 3) interleaved channels.
  Amplitudes amplitudes(int block, int channels);
  /// Complex vectors of one ring vector, hemisphere and channel, orders 0 .. last_order.
  double* row(const Amplitudes& a, int vector_in_block, int south, int channel) const;

  /// Takes over coefficients[index * stride + c], c < channels, times `scale`, for synthesise().
  void set_coefficients(const double* coefficients, int stride, int channels, double scale);
  /// Amplitudes of the block from the coefficients.
  void synthesise(int block, const Amplitudes&);
  /// Adjoint of synthesise, summed over the calls for block 0, 1, ...
  void analyse(int block, const Amplitudes&);
  /// Hands out what analyse() has summed, times `scale`.
  void get_coefficients(double* coefficients, int stride, int channels, double scale) const;

private:
  RingBlock begin_block(int block);
  OrderTable order_table(int m, const double** gamma);
  template <class PerOrder>
  void for_each_order(int block, PerOrder&& body);
  template <class Body>
  void for_each_index(Body&& body) const;

  std::vector<RingPair> pairs_;
  int degree_, vectors_, vectors_per_block_;
  const Kernels* kernels_;
  std::vector<int> last_order_;
  std::size_t order_offset(int m) const;

  AlignedBuffer x_, sine_, state_, accumulators_, amplitudes_, order_values_;
  AlignedBuffer by_order_; ///< coefficients order by order: (degree, channel, re or im of c_{l,m} - i c_{l,-m})
  std::vector<unsigned char> live_;
  std::vector<double> alpha_, gamma_; ///< all orders when the degree is small, else the current one
  std::vector<std::size_t> offset_;
};

} // namespace daylit::sh::detail
