// Included by kernels.cpp inside an anonymous namespace, after vector.h. Direct Fourier sums for directions that do
// not lie on regular rings: lane k holds a direction of the ring in lane k.

template <int Channels>
void orders_to_values(const double* row, std::size_t row_stride, int count, const double* cosine, const double* sine,
                      double* values) {
  const Vec c1 = load(cosine), s1 = load(sine);
  Vec c = Vec{} + 1.0, s{}, sum[Channels] = {};
  for (std::size_t m = 0; m < std::size_t(count); ++m) {
    for (std::size_t k = 0; k < Channels; ++k) {
      const double* z = row + k * row_stride + 2 * m * kLanes;
      sum[k] += load(z) * c - load(z + kLanes) * s;
    }
    const Vec next = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next;
  }
  for (std::size_t k = 0; k < Channels; ++k)
    store(values + k * kLanes, sum[k]);
}

template <int Channels>
void values_to_orders(double* row, std::size_t row_stride, int count, const double* cosine, const double* sine,
                      const double* values) {
  const Vec c1 = load(cosine), s1 = load(sine);
  Vec c = Vec{} + 1.0, s{};
  for (std::size_t m = 0; m < std::size_t(count); ++m) {
    for (std::size_t k = 0; k < Channels; ++k) {
      double* z = row + k * row_stride + 2 * m * kLanes;
      const Vec v = load(values + k * kLanes);
      store(z, load(z) + v * c);
      store(z + kLanes, load(z + kLanes) - v * s);
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
