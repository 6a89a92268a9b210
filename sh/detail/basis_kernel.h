// Included by kernels.cpp inside an anonymous namespace, after vector.h. All harmonics of one vector of directions.

#include "sh/detail/difference_recurrence.h"

/// One order for `vectors` vectors of directions: planes l*l + l +- m of the output, `valid` directions.
template <class T>
void evaluate_order_batch(BatchState<T>& state, const OrderRow<T>& row, T* out, std::size_t plane_stride) {
  using V = typename Wide<T>::Type;
  constexpr std::size_t kWidth = sizeof(V) / sizeof(T);
  for (std::size_t start = 0; start < state.count; start += kWidth) {
    V field[9];
    for (int k = 0; k < 9; ++k)
      __builtin_memcpy(&field[k], state.field[k] + start, sizeof(V));
    Directions<V> d{field[0], field[1], field[2], field[3], field[4], field[5], field[6], field[7], field[8]};
    advance_order<T>(d, row.order, row.sectoral_factor);
    const V moved[4] = {d.sectoral, d.sectoral_exp, d.cosine_m, d.sine_m};
    for (int k = 0; k < 4; ++k)
      __builtin_memcpy(state.field[5 + k] + start, &moved[k], sizeof(V));
    const std::size_t valid = state.count - start < kWidth ? state.count - start : kWidth;
    const std::size_t m = std::size_t(row.order);
    evaluate_order<T, V>(d, row.order, row.a, row.b, row.q, row.count, [&](int i, V c, V s) {
      const std::size_t l = m + std::size_t(i), centre = l * l + l;
      __builtin_memcpy(out + (centre + m) * plane_stride + start, &c, valid * sizeof(T));
      if (m > 0)
        __builtin_memcpy(out + (centre - m) * plane_stride + start, &s, valid * sizeof(T));
    });
  }
}

/// Adds one order of coefficients to the band values of every direction: values[vector][degree][channel][lane] +=
/// c_{l,m} Y_lm + c_{l,-m} Y_l,-m. `pairs`: (c_{l,m}, c_{l,-m}) per degree from m and channel.
void add_band_values(BatchState<double>& state, const OrderRow<double>& row, const double* pairs, int channels,
                     double* values) {
  const std::size_t degrees = std::size_t(row.order + row.count), c_count = std::size_t(channels);
  for (std::size_t start = 0; start < state.count; start += kLanes) {
    using V = Wide<double>::Type;
    Directions<V> d{};
    V* const fields[9] = {&d.mu,       &d.sine,         &d.hemisphere, &d.cosine1, &d.sine1,
                          &d.sectoral, &d.sectoral_exp, &d.cosine_m,   &d.sine_m};
    for (int k = 0; k < 9; ++k)
      __builtin_memcpy(fields[k], state.field[k] + start, sizeof(V));
    advance_order<double>(d, row.order, row.sectoral_factor);
    for (int k = 5; k < 9; ++k)
      __builtin_memcpy(state.field[k] + start, fields[k], sizeof(V));
    double* out = values + (start * degrees + std::size_t(row.order) * kLanes) * c_count;
    evaluate_order<double, V>(d, row.order, row.a, row.b, row.q, row.count, [&](int i, V c, V s) {
      for (std::size_t k = 0; k < c_count; ++k) {
        const double* pair = pairs + (std::size_t(i) * c_count + k) * 2;
        double* to = out + (std::size_t(i) * c_count + k) * kLanes;
        store(to, load(to) + c * pair[0] + s * pair[1]);
      }
    });
  }
}
