#pragma once

// The inner loops, compiled once per instruction set by Highway (kernels.cpp) and chosen at run time by kernels().
// A vector holds `lanes` rings (or directions) side by side. Pointers to vectors are aligned to kAlignment bytes.

#include <cstddef>
#include <vector>

namespace daylit::sh::detail {

inline constexpr int kAlignment = 64;
inline constexpr int kMaxLanes = 8;
/// Degrees per pass over a block of rings: the per-degree sums of a pass stay in the first-level cache.
inline constexpr int kChunk = 64;
/// Degrees between two looks at the exponents; divides kChunk.
inline constexpr int kStep = 8;

/// Numbers below the range of double are kept as p * 2^(400 e), e <= 0 (as in libsharp, Reinecke & Seljebotn 2013,
/// sect. 3.3). A lane with e < 0 stands for less than 1e-40 (kBig, and kStep steps of growth between two looks) and
/// contributes nothing.
inline constexpr double kBig = 0x1p200, kSmall = 0x1p-200, kScaleDown = 0x1p-400, kScaleUp = 0x1p400;

/// One order m of the Legendre recurrence in the scaled form p_l = (alpha_l x) p_{l-1} - p_{l-2}.
struct OrderTable {
  const double* alpha; ///< alpha[i] belongs to degree m + i; `count` + 1 readable values
  int count;           ///< degrees, a multiple of kStep; those above the transform's degree carry zero coefficients
};

/// Rings at +-x side by side, with the state of the recurrence of the current order.
struct RingBlock {
  int vectors;
  const double* x;      ///< |cos theta|
  const double* sine;   ///< sin theta
  double* sectoral;     ///< mantissa of P_mm, advanced from order to order
  double* sectoral_exp; ///< its exponent e
  double* p0;           ///< P of the last even step
  double* p1;           ///< P of the last odd step
  double* exponent;     ///< e of p0, p1
  unsigned char* live;  ///< per vector: all lanes have e == 0
};

/// Fourier amplitudes of a block: complex vectors (re, im) at
/// data + (((vector * 2 + southern) * channels + channel) * order_stride + m) * 2 * lanes.
struct Amplitudes {
  double* data;
  int order_stride;
  int channels; ///< 1 or 3
};

/// Complex transform of length n over vectors: Stockham passes with the given radices.
struct FftPasses {
  int length;
  int count;
  const int* radix;
  const double* twiddle;      ///< per pass (length / stride / radix) * (radix - 1) pairs, in the order of use
  const double* real_twiddle; ///< exp(-2 pi i k / (2 length)), k = 0..length; null for a complex transform
  const double* root;         ///< radix-th roots of unity (pairs), used where radix is not 2, 4 or 8
  const int* root_offset;     ///< per pass, where its roots start
};

template <class T>
struct RowSet {
  T* row[kMaxLanes]; ///< null: no such ring
  std::ptrdiff_t stride;
};

/// Directions of evaluate_batch: unit vectors as separate arrays, `count` of them.
template <class T>
struct DirectionArrays {
  const T *x, *y, *z;
  std::size_t count;
};

/// Directions of a batch: mu, sine, hemisphere, cos phi, sin phi, then the state that moves from order to order
/// (sh/detail/difference_recurrence.h). Arrays are padded to kMaxBatchWidth.
inline constexpr std::size_t kMaxBatchWidth = 16;
template <class T>
struct BatchState {
  T* field[9];
  std::size_t count;
};

/// Difference recurrence of one order, index i for degree order + i.
template <class T>
struct OrderRow {
  const T *a, *b, *q;
  int order, count;
  T sectoral_factor;
};

/// One row n and one vector of columns m of the quarter-turn matrices of all degrees (sh/rotation.cpp).
/// All arrays start at degree n; those of columns hold one vector per degree.
struct RotationColumns {
  int row, degree;
  const double *start, *start_exp;      ///< d^n_{n,m}
  const double *first, *second;         ///< column factors of the recurrence, d_{l+1} = first row_first d_l - ...
  const double *row_first, *row_second; ///< row factors
  const double *row_sign, *column_sign; ///< per lane
  const double *row_cosine, *row_sine;  ///< input of row n
  const double* in[2];                  ///< even columns cosine and odd ones sine, and the other way round
  double* out[2];
  double* row_sums; ///< 2 vectors per degree
};

struct Kernels {
  const char* name;
  int lanes;

  /// Prepares the block for order m: `factor` takes P_{m-1,m-1} to P_mm / sin theta (or is P_00); vectors before
  /// `first` idle and must stay idle in all later orders.
  void (*start_order)(const RingBlock&, int first, int m, double factor);
  /// amplitudes(m) = sum over l of coefficient x P_lm, north and south. `coefficients`: count x channels x (re, im).
  void (*synthesise_order)(const RingBlock&, const OrderTable&, int first, int m, const double* coefficients,
                           double* accumulators, const Amplitudes&);
  /// sums (count x channels x (re, im)) = sum over rings of P_lm x amplitude(m).
  void (*analyse_order)(const RingBlock&, const OrderTable&, int first, int m, double* sums, double* accumulators,
                        const Amplitudes&);

  /// Pixels of `lanes` rows to vectors and back, times `scale`. Loading needs every row; storing skips null rows.
  void (*load_rows_f64)(const RowSet<const double>&, int pixels, double scale, double* out);
  void (*load_rows_f32)(const RowSet<const float>&, int pixels, double scale, double* out);
  void (*store_rows_f64)(const RowSet<double>&, int pixels, double scale, const double* in);
  void (*store_rows_f32)(const RowSet<float>&, int pixels, double scale, const double* in);
  /// Forward (e^-) transform of `length` complex vectors in a; b is scratch. Returns which of the two holds the result.
  double* (*fft_forward)(const FftPasses&, double* a, double* b);
  double* (*fft_backward)(const FftPasses&, double* a, double* b);
  /// Bins 0..count-1 of 2 length real samples from their half-length transform, times one weight per lane.
  void (*split_real)(const FftPasses&, const double* half, const double* weight, int count, double* bins);
  /// Inverse, unnormalised: samples f_j = Re sum_{k = 0..length} bin_k exp(2 pi i k j / (2 length)).
  void (*merge_real)(const FftPasses&, const double* bins, double* half);

  /// out = (conj?)((conj?)(in) * phase) over `count` complex vectors, one complex phase per vector.
  void (*turn_bins)(const double* in, int count, const double* phase, bool conjugate_in, bool conjugate_out,
                    double* out);
  /// Largest magnitude of `count` numbers; NaN when any of them is not finite.
  double (*max_abs_f64)(const double*, std::size_t count);
  double (*max_abs_f32)(const float*, std::size_t count);

  /// Closed form of bands 0..2, plane i of the output at out + i * plane_stride.
  void (*evaluate9_f32)(const DirectionArrays<float>&, float* out, std::size_t plane_stride);
  void (*evaluate9_f64)(const DirectionArrays<double>&, double* out, std::size_t plane_stride);
  /// All degrees of one order of a batch; orders are to be called in turn, from 0.
  void (*evaluate_order_f32)(BatchState<float>&, const OrderRow<float>&, float* out, std::size_t plane_stride);
  void (*evaluate_order_f64)(BatchState<double>&, const OrderRow<double>&, double* out, std::size_t plane_stride);

  /// Band values of a batch, one order at a time: values[vector][degree][channel][lane] += c Y (basis_kernel.h).
  void (*add_band_values)(BatchState<double>&, const OrderRow<double>&, const double* pairs, int channels,
                          double* values);

  void (*rotate_columns)(const RotationColumns&);

  /// One direction per lane, in the quadrant cosine, sine >= 0, and its mirror images: values[channel][image] = Re
  /// sum_m amplitude_m exp(i m phi), image 1 with -cosine, 2 with -sine, 3 with both; and its adjoint, which adds.
  /// `row_stride` doubles lie between channels.
  void (*sum_orders)(const double* row, std::size_t row_stride, int channels, int count, const double* cosine,
                     const double* sine, double* values);
  void (*add_orders)(double* row, std::size_t row_stride, int channels, int count, const double* cosine,
                     const double* sine, const double* values);
};

/// The set in use: the widest this processor runs, unless select_kernels() said otherwise.
const Kernels& kernels();

/// For tests and benchmarks: what kernels() returns from now on. Not while another thread is in this component, and
/// objects made before keep their set.
void select_kernels(const Kernels& set);

/// All sets that this processor runs, narrowest first; the tests compare them. Not while another thread is at work.
std::vector<const Kernels*> all_kernels();

} // namespace daylit::sh::detail
