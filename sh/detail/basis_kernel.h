// Included by kernels_*.cpp inside an anonymous namespace, after vector.h. All harmonics of one vector of directions.

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
