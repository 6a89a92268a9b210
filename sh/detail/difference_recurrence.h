// Included inside a namespace. Legendre functions of one order in Reinsch's difference form, for a number type V that
// is a scalar or a vector of T: D_l = P_l - P_{l-1} = b_l D_{l-1} + (q_l - A_l mu) P_{l-1}, with mu = 1 - |cos theta|.
// Near the poles P changes by ~mu per degree; carrying the difference keeps the error at l epsilon where the plain
// recurrence has l^2 epsilon. A_l and b_l as in build_order; q_l = A_l - 1 - b_l is formed without cancellation.
// Table rows: a, b, q with index i for degree m + i (difference_table()).

/// Range handling: numbers are p * kUp^e, e <= 0; lanes with e < 0 count as 0.
template <class T>
struct Range;
template <>
struct Range<double> {
  static constexpr double kBig = 0x1p200, kSmall = 0x1p-200, kDown = 0x1p-400, kUp = 0x1p400;
};
template <>
struct Range<float> {
  static constexpr float kBig = 0x1p30f, kSmall = 0x1p-60f, kDown = 0x1p-90f, kUp = 0x1p90f;
};

template <class V>
struct Directions {
  V mu;             ///< 1 - |z|
  V sine;           ///< sqrt(x^2 + y^2)
  V hemisphere;     ///< +1 north, -1 south
  V cosine1, sine1; ///< cos phi, sin phi
  V sectoral, sectoral_exp, cosine_m, sine_m;
};

/// Advances P_mm and cos, sin m phi from order m - 1; factor = sectoral_factor(m).
template <class T, class V>
inline void advance_order(Directions<V>& d, int m, T factor) {
  if (m == 0) {
    d.sectoral = V{} + factor;
    d.sectoral_exp = V{};
    d.cosine_m = V{} + T(1);
    d.sine_m = V{};
    return;
  }
  d.sectoral = d.sectoral * d.sine * factor;
  const auto small = d.sectoral < Range<T>::kSmall;
  d.sectoral = small ? d.sectoral * Range<T>::kUp : d.sectoral;
  d.sectoral_exp = small ? d.sectoral_exp - T(1) : d.sectoral_exp;
  const V c = d.cosine_m * d.cosine1 - d.sine_m * d.sine1;
  d.sine_m = d.sine_m * d.cosine1 + d.cosine_m * d.sine1;
  d.cosine_m = c;
}

/// emit(i, cosine part, sine part) for degrees m + i, i < count.
template <class T, class V, class Emit>
inline void evaluate_order(const Directions<V>& d, int m, const T* a, const T* b, const T* q, int count, Emit&& emit) {
  const T root2 = m == 0 ? T(1) : T(1.41421356237309504880);
  const V even_c = d.cosine_m * root2, even_s = d.sine_m * root2;
  const V odd_c = even_c * d.hemisphere, odd_s = even_s * d.hemisphere;
  V p = d.sectoral, difference = V{}, exponent = d.sectoral_exp;
  V weight = exponent < T(0) ? V{} : V{} + T(1);
  bool live = !any(exponent < T(0));
  for (int i = 0;; ++i) {
    const V value = live ? p : p * weight;
    emit(i, value * (i % 2 ? odd_c : even_c), value * (i % 2 ? odd_s : even_s));
    if (i + 1 >= count)
      return;
    difference = difference * b[i + 1] + (q[i + 1] - d.mu * a[i + 1]) * p;
    p = p + difference;
    if (!live) {
      const auto grown = ((p > Range<T>::kBig) | (p < -Range<T>::kBig)) & (exponent < T(0));
      p = grown ? p * Range<T>::kDown : p;
      difference = grown ? difference * Range<T>::kDown : difference;
      exponent = grown ? exponent + T(1) : exponent;
      weight = exponent < T(0) ? V{} : V{} + T(1);
      live = !any(exponent < T(0));
    }
  }
}
