// Included by kernels.cpp inside an anonymous namespace, after vector.h. Fourier transforms of `kLanes` rings side
// by side: every complex number is a pair of vectors, so no pass ever moves data between lanes.

struct Complex {
  Vec re, im;
};

inline Complex load_complex(const double* p, std::size_t i) {
  return {load(p + 2 * i * kLanes), load(p + (2 * i + 1) * kLanes)};
}
inline void store_complex(double* p, std::size_t i, Complex c) {
  store(p + 2 * i * kLanes, c.re);
  store(p + (2 * i + 1) * kLanes, c.im);
}
inline Complex operator+(Complex a, Complex b) { return {a.re + b.re, a.im + b.im}; }
inline Complex operator-(Complex a, Complex b) { return {a.re - b.re, a.im - b.im}; }

/// a times the table entry w, conjugated for the backward transform.
template <bool Forward>
inline Complex twiddle(Complex a, const double* w) {
  const double c = w[0], s = Forward ? w[1] : -w[1];
  return {a.re * c - a.im * s, a.im * c + a.re * s};
}
/// a times -i (forward) or i (backward).
template <bool Forward>
inline Complex quarter_turn(Complex a) {
  return Forward ? Complex{a.im, -a.re} : Complex{-a.im, a.re};
}

template <bool Forward, int Radix>
inline void butterfly(Complex* a, const double* root) {
  if constexpr (Radix == 2) {
    const Complex t = a[0] - a[1];
    a[0] = a[0] + a[1];
    a[1] = t;
  } else if constexpr (Radix == 4) {
    const Complex t0 = a[0] + a[2], t1 = a[0] - a[2], t2 = a[1] + a[3], t3 = quarter_turn<Forward>(a[1] - a[3]);
    a[0] = t0 + t2;
    a[1] = t1 + t3;
    a[2] = t0 - t2;
    a[3] = t1 - t3;
  } else if constexpr (Radix == 8) {
    Complex even[4] = {a[0], a[2], a[4], a[6]}, odd[4] = {a[1], a[3], a[5], a[7]};
    butterfly<Forward, 4>(even, nullptr);
    butterfly<Forward, 4>(odd, nullptr);
    constexpr double h = 0.70710678118654752440;
    const double w1[2] = {h, -h}, w3[2] = {-h, -h};
    odd[1] = twiddle<Forward>(odd[1], w1);
    odd[2] = quarter_turn<Forward>(odd[2]);
    odd[3] = twiddle<Forward>(odd[3], w3);
    for (int k = 0; k < 4; ++k) {
      a[k] = even[k] + odd[k];
      a[k + 4] = even[k] - odd[k];
    }
  } else {
    Complex out[Radix];
    for (int k = 0; k < Radix; ++k) {
      out[k] = a[0];
      for (int j = 1; j < Radix; ++j)
        out[k] = out[k] + twiddle<Forward>(a[j], root + 2 * ((j * k) % Radix));
    }
    for (int k = 0; k < Radix; ++k)
      a[k] = out[k];
  }
}

/// One Stockham pass: `groups` twiddle groups of `stride` contiguous columns.
template <bool Forward, int Radix>
void pass(const double* in, double* out, std::size_t groups, std::size_t stride, const double* w, const double* root) {
  for (std::size_t p = 0; p < groups; ++p, w += 2 * (Radix - 1))
    for (std::size_t q = 0; q < stride; ++q) {
      Complex a[Radix];
      for (std::size_t k = 0; k < Radix; ++k)
        a[k] = load_complex(in, q + stride * (p + k * groups));
      butterfly<Forward, Radix>(a, root);
      store_complex(out, q + stride * Radix * p, a[0]);
      for (std::size_t k = 1; k < Radix; ++k)
        store_complex(out, q + stride * (Radix * p + k), twiddle<Forward>(a[k], w + 2 * (k - 1)));
    }
}

/// The same for any prime radix, with radix^2 operations per column.
template <bool Forward>
void pass_any(const double* in, double* out, std::size_t groups, std::size_t stride, std::size_t radix, const double* w,
              const double* root) {
  for (std::size_t p = 0; p < groups; ++p, w += 2 * (radix - 1))
    for (std::size_t q = 0; q < stride; ++q)
      for (std::size_t k = 0; k < radix; ++k) {
        Complex sum = load_complex(in, q + stride * p);
        for (std::size_t j = 1, turn = k; j < radix; ++j, turn = turn + k < radix ? turn + k : turn + k - radix)
          sum = sum + twiddle<Forward>(load_complex(in, q + stride * (p + j * groups)), root + 2 * turn);
        store_complex(out, q + stride * (radix * p + k), k == 0 ? sum : twiddle<Forward>(sum, w + 2 * (k - 1)));
      }
}

template <bool Forward>
double* fft(const FftPasses& plan, double* a, double* b) {
  std::size_t length = plan.length, stride = 1;
  const double* w = plan.twiddle;
  for (int i = 0; i < plan.count; ++i) {
    const std::size_t radix = plan.radix[i], groups = length / radix;
    switch (radix) {
    case 2:
      pass<Forward, 2>(a, b, groups, stride, w, nullptr);
      break;
    case 3:
      pass<Forward, 3>(a, b, groups, stride, w, plan.root + plan.root_offset[i]);
      break;
    case 4:
      pass<Forward, 4>(a, b, groups, stride, w, nullptr);
      break;
    case 5:
      pass<Forward, 5>(a, b, groups, stride, w, plan.root + plan.root_offset[i]);
      break;
    case 8:
      pass<Forward, 8>(a, b, groups, stride, w, nullptr);
      break;
    default:
      pass_any<Forward>(a, b, groups, stride, radix, w, plan.root + plan.root_offset[i]);
    }
    w += 2 * groups * (radix - 1);
    length = groups;
    stride *= radix;
    double* const swap = a;
    a = b;
    b = swap;
  }
  return a;
}

/// Bins 0..count-1 of 2N real samples from the N-point transform of (even, odd) pairs, times a weight per lane.
void split_real(const FftPasses& plan, const double* half, const double* weight, int count, double* bins) {
  const std::size_t n = plan.length;
  const Vec scale = load(weight) * 0.5;
  for (std::size_t k = 0; k < std::size_t(count); ++k) {
    const Complex a = load_complex(half, k == n ? 0 : k), b = load_complex(half, k == 0 ? 0 : n - k);
    const double wr = plan.real_twiddle[2 * k], wi = plan.real_twiddle[2 * k + 1];
    const Vec er = a.re + b.re, ei = a.im - b.im, dr = a.re - b.re, di = a.im + b.im;
    store_complex(bins, k, {(er + (di * wr + dr * wi)) * scale, (ei - (dr * wr - di * wi)) * scale});
  }
}

/// The inverse for samples f_j = Re sum_{k=0..N} bin_k exp(2 pi i k j / 2N).
void merge_real(const FftPasses& plan, const double* bins, double* half) {
  const std::size_t n = plan.length;
  const Vec a0 = load(bins), b0 = load(bins + 2 * n * kLanes);
  store_complex(half, 0, {a0 + b0, a0 - b0});
  for (std::size_t k = 1; k < n; ++k) {
    const Complex a = load_complex(bins, k), b = load_complex(bins, n - k);
    const double wr = 0.5 * plan.real_twiddle[2 * k], wi = 0.5 * plan.real_twiddle[2 * k + 1];
    const Vec er = a.re + b.re, ei = a.im - b.im, dr = a.re - b.re, di = a.im + b.im;
    store_complex(half, k, {0.5 * er - (di * wr - dr * wi), 0.5 * ei + (dr * wr + di * wi)});
  }
}

template <class T>
void load_rows(const RowSet<const T>& rows, int pixels, double scale, double* out) {
  for (std::ptrdiff_t j = 0; j < pixels; ++j) {
    Vec v;
    for (int lane = 0; lane < kLanes; ++lane)
      v[lane] = double(rows.row[lane][j * rows.stride]);
    store(out + j * kLanes, v * scale);
  }
}

template <class T>
void store_rows(const RowSet<T>& rows, int pixels, double scale, const double* in) {
  for (int lane = 0; lane < kLanes; ++lane)
    if (T* row = rows.row[lane])
      for (std::ptrdiff_t j = 0; j < pixels; ++j)
        row[j * rows.stride] = T(in[j * kLanes + lane] * scale);
}

void turn_bins(const double* in, int count, const double* phase, bool conjugate_in, bool conjugate_out, double* out) {
  const double si = conjugate_in ? -1.0 : 1.0, so = conjugate_out ? -1.0 : 1.0;
  for (std::size_t k = 0; k < std::size_t(count); ++k) {
    Complex a = load_complex(in, k);
    a.im *= si;
    a = twiddle<true>(a, phase + 2 * k);
    store_complex(out, k, {a.re, a.im * so});
  }
}

template <class T>
double max_abs(const T* p, std::size_t count) {
  typedef T V __attribute__((vector_size(kLanes * 8)));
  constexpr std::size_t kWidth = sizeof(V) / sizeof(T);
  V most{}, bad{};
  std::size_t i = 0;
  for (; i + kWidth <= count; i += kWidth) {
    V v;
    __builtin_memcpy(&v, p + i, sizeof v);
    bad += v - v; // NaN for NaN and infinity, else 0
    v = v < 0 ? -v : v;
    most = v > most ? v : most;
  }
  T result = 0, sum = 0;
  for (std::size_t k = 0; k < kWidth; ++k) {
    result = most[k] > result ? most[k] : result;
    sum += bad[k];
  }
  for (; i < count; ++i) {
    sum += p[i] - p[i];
    result = p[i] > result ? p[i] : (-p[i] > result ? -p[i] : result);
  }
  return double(result + sum);
}
