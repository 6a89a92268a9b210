// Included by kernels.cpp inside an anonymous namespace, after vector.h. Bands 0..2 of many directions. The output is
// three times the input, so the loop lives on store bandwidth: whole vectors are written past the caches.

template <class T>
struct Wide;
template <>
struct Wide<float> {
  typedef float Type __attribute__((vector_size(kLanes * 8)));
};
template <>
struct Wide<double> {
  typedef double Type __attribute__((vector_size(kLanes * 8)));
};

template <class T>
inline void stream(T* p, typename Wide<T>::Type v) {
#if HWY_MAX_BYTES >= 32
  const hwy::HWY_NAMESPACE::ScalableTag<T> lanes;
  hwy::HWY_NAMESPACE::Stream(hwy::HWY_NAMESPACE::LoadU(lanes, reinterpret_cast<const T*>(&v)), lanes, p);
#else
  __builtin_memcpy(p, &v, sizeof v);
#endif
}

/// The nine values of one direction, or of one vector of directions, in index order.
template <class V, class T>
inline void nine(V x, V y, V z, V* out) {
  constexpr T c0 = T(0.28209479177387814347), c1 = T(0.48860251190291992159), c2 = T(1.09254843059207907054),
              c20 = T(0.31539156525252000603), c22 = T(0.54627421529603953527);
  out[0] = V{} + c0;
  out[1] = c1 * y;
  out[2] = c1 * z;
  out[3] = c1 * x;
  out[4] = c2 * x * y;
  out[5] = c2 * y * z;
  out[6] = c20 * (T(3) * z * z - T(1));
  out[7] = c2 * x * z;
  out[8] = c22 * (x * x - y * y);
}

template <class T>
void evaluate9(const DirectionArrays<T>& d, T* out, std::size_t plane_stride) {
  using V = typename Wide<T>::Type;
  constexpr std::size_t kWidth = sizeof(V) / sizeof(T);
  const auto scalar = [&](std::size_t i) {
    T y[9];
    nine<T, T>(d.x[i], d.y[i], d.z[i], y);
    for (std::size_t k = 0; k < 9; ++k)
      out[k * plane_stride + i] = y[k];
  };
  std::size_t i = 0;
  const bool planes_aligned = plane_stride * sizeof(T) % kAlignment == 0;
  while (planes_aligned && i < d.count && reinterpret_cast<std::size_t>(out + i) % kAlignment != 0)
    scalar(i++);
  for (; planes_aligned && i + kWidth <= d.count; i += kWidth) {
    V v[3], y[9];
    __builtin_memcpy(&v[0], d.x + i, sizeof(V));
    __builtin_memcpy(&v[1], d.y + i, sizeof(V));
    __builtin_memcpy(&v[2], d.z + i, sizeof(V));
    nine<V, T>(v[0], v[1], v[2], y);
    for (std::size_t k = 0; k < 9; ++k)
      stream(out + k * plane_stride + i, y[k]);
  }
  hwy::FlushStream();
  for (; i < d.count; ++i)
    scalar(i);
}
