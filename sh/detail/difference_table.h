#pragma once

// Scalar use of the difference recurrence, and its tables.

#include <cmath>
#include <vector>

#include "sh/basis.h"

namespace daylit::sh::detail {

inline bool any(bool b) { return b; }
#include "sh/detail/difference_recurrence.h"

/// a, b, q of one order, each count + 1 long, index i for degree m + i; index 0 is unused.
template <class T>
struct DifferenceTable {
  std::vector<T> a, b, q;

  void build(int m, int count) {
    for (auto* v : {&a, &b, &q})
      v->assign(std::size_t(count) + 1, T(0));
    const double m2 = 4.0 * double(m) * m - 1.0;
    double before = 0.0, d_before = 0.0;
    for (int i = 1; i < count; ++i) {
      const double d = double(i) * (2.0 * m + i), now = std::sqrt(4.0 + m2 / d);
      const std::size_t k = std::size_t(i);
      a[k] = T(now);
      if (i == 1) {
        q[k] = T(now - 1.0);
      } else {
        const double b_less_1 = -m2 * (2.0 * (m + i) - 1.0) / (d * d_before) / (before * (now + before));
        b[k] = T(1.0 + b_less_1);
        q[k] = T(m2 / d / (now + 2.0) - b_less_1);
      }
      before = now;
      d_before = d;
    }
  }
};

template <class T>
constexpr double unit_tolerance() {
  return sizeof(T) == sizeof(float) ? double(kUnitToleranceFloat) : kUnitTolerance;
}

/// Polar coordinates without cancellation at the poles; false when the direction is not of unit length.
template <class T>
bool polar(double x, double y, double z, Directions<T>& out) {
  const double length = std::sqrt(x * x + y * y + z * z);
  if (!(std::abs(length - 1.0) <= unit_tolerance<T>()))
    return false;
  const double s = std::hypot(x, y) / length, h = std::abs(z) / length;
  out.mu = T(s * s / (1.0 + h));
  out.sine = T(s);
  out.hemisphere = z < 0.0 ? T(-1) : T(1);
  out.cosine1 = s > 0.0 ? T(x / (s * length)) : T(1);
  out.sine1 = s > 0.0 ? T(y / (s * length)) : T(0);
  return true;
}

} // namespace daylit::sh::detail
