// Included by kernels.cpp inside an anonymous namespace, after vector.h. Direct Fourier sums for directions that do
// not lie on regular rings: lane k holds a direction of the ring in lane k.
//
// A direction at azimuth phi serves its mirror images at pi - phi, -phi and pi + phi as well: with the sums over even
// and odd m of re cos(m phi) and im sin(m phi), the four values are +-(even) +-(odd) of each.

template <int Channels>
void orders_to_values(const double* row, std::size_t row_stride, int count, const double* cosine, const double* sine,
                      double* values) {
  const Vec c1 = load(cosine), s1 = load(sine);
  Vec c = Vec{} + 1.0, s{}, re[Channels][2] = {}, im[Channels][2] = {};
  for (std::size_t m = 0; m < std::size_t(count); ++m) {
    for (std::size_t k = 0; k < Channels; ++k) {
      const double* z = row + k * row_stride + 2 * m * kLanes;
      re[k][0] += load(z) * c;
      im[k][0] += load(z + kLanes) * s;
    }
    const Vec next = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next;
    for (std::size_t k = 0; k < Channels; ++k) { // the next m belongs to the other half
      const Vec r = re[k][0], i = im[k][0];
      re[k][0] = re[k][1];
      im[k][0] = im[k][1];
      re[k][1] = r;
      im[k][1] = i;
    }
  }
  const int even = count & 1; // where the sums of even m ended up
  for (std::size_t k = 0; k < Channels; ++k) {
    double* v = values + 4 * k * kLanes;
    const Vec ce = re[k][even], co = re[k][1 - even], se = im[k][even], so = im[k][1 - even];
    store(v, (ce + co) - (se + so));
    store(v + kLanes, (ce - co) + (se - so));
    store(v + 2 * kLanes, (ce + co) + (se + so));
    store(v + 3 * kLanes, (ce - co) - (se - so));
  }
}

template <int Channels>
void values_to_orders(double* row, std::size_t row_stride, int count, const double* cosine, const double* sine,
                      const double* values) {
  const Vec c1 = load(cosine), s1 = load(sine);
  Vec c = Vec{} + 1.0, s{}, re[Channels][2], im[Channels][2]; // of even and odd m
  for (std::size_t k = 0; k < Channels; ++k) {
    const double* v = values + 4 * k * kLanes;
    const Vec pp = load(v), mp = load(v + kLanes), pm = load(v + 2 * kLanes), mm = load(v + 3 * kLanes);
    re[k][0] = (pp + mp) + (pm + mm);
    re[k][1] = (pp - mp) + (pm - mm);
    im[k][0] = (pp - mp) - (pm - mm);
    im[k][1] = (pp + mp) - (pm + mm);
  }
  for (std::size_t m = 0; m < std::size_t(count); ++m) {
    for (std::size_t k = 0; k < Channels; ++k) {
      double* z = row + k * row_stride + 2 * m * kLanes;
      store(z, load(z) + re[k][m & 1] * c);
      store(z + kLanes, load(z + kLanes) - im[k][m & 1] * s);
    }
    const Vec next = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next;
  }
}

void sum_orders(const double* row, std::size_t row_stride, int channels, int count, const double* cosine,
                const double* sine, double* values) {
  if (channels == 3)
    orders_to_values<3>(row, row_stride, count, cosine, sine, values);
  else
    orders_to_values<1>(row, row_stride, count, cosine, sine, values);
}

void add_orders(double* row, std::size_t row_stride, int channels, int count, const double* cosine, const double* sine,
                const double* values) {
  if (channels == 3)
    values_to_orders<3>(row, row_stride, count, cosine, sine, values);
  else
    values_to_orders<1>(row, row_stride, count, cosine, sine, values);
}
