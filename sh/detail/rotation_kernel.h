// Included by kernels.cpp inside an anonymous namespace, after vector.h and legendre_kernel.h.

/// d^l_{n,m}(pi/2), l = n .. degree, for one row n and a vector of columns m <= n, applied to both sides of the
/// symmetric pair of rows (see sh/rotation.cpp for the arrays).
void rotate_columns(const RotationColumns& r) {
  const Vec row_sign = load(r.row_sign), column_sign = load(r.column_sign);
  Mask even_lane{};
  for (int k = 0; k < kLanes; k += 2)
    even_lane[k] = -1;
  Vec p = load(r.start), before{}, exponent = load(r.start_exp), weight;
  rescale(p, before, exponent, weight);
  bool live = !any(exponent < 0.0);
  double* sums = r.row_sums;
  for (int l = r.row; l <= r.degree; ++l, sums += 2 * kLanes) {
    const std::size_t i = std::size_t(l - r.row), at = i * kLanes;
    const int q = (l + r.row) & 1;
    if (live || any(weight > 0.0)) {
      const Vec d = p * weight;
      store(sums + q * kLanes, load(sums + q * kLanes) + d * row_sign * load(r.in[q] + at));
      const Vec c = Vec{} + r.row_cosine[i], s = Vec{} + r.row_sine[i];
      const Vec spread = q == 0 ? (even_lane ? c : s) : (even_lane ? s : c);
      store(r.out[q] + at, load(r.out[q] + at) + d * column_sign * spread);
    }
    const Vec next = p * load(r.first + at) * r.row_first[i] - before * load(r.second + at) * r.row_second[i];
    before = p;
    p = next;
    if (!live) {
      rescale(p, before, exponent, weight);
      live = !any(exponent < 0.0);
    }
  }
}
