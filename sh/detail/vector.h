// Included by kernels.cpp inside a namespace of each instruction set: its vector type. Everything has internal
// linkage and calls no library function, so no code compiled for a wider instruction set can be picked by the linker
// for the rest of the program.

constexpr int kLanes = HWY_MAX_BYTES >= 16 ? HWY_MAX_BYTES / 8 : 2;
/// Ring vectors per loaded coefficient: two where 32 registers allow it.
constexpr int kGroup = kLanes == 8 ? 2 : 1;

typedef double Vec __attribute__((vector_size(kLanes * 8), may_alias));
typedef long long Mask __attribute__((vector_size(kLanes * 8)));

inline Vec load(const double* p) { return *reinterpret_cast<const Vec*>(p); }
inline void store(double* p, Vec v) { *reinterpret_cast<Vec*>(p) = v; }

/// True when any lane of a comparison holds.
template <class M>
inline bool any(M m) {
  long long set = 0;
  for (std::size_t i = 0; i < sizeof(M) / sizeof(m[0]); ++i)
    set |= m[i];
  return set != 0;
}

/// out[0] += sum of the lanes of a, out[1] += sum of the lanes of b.
inline void add_lane_sums(Vec a, Vec b, double* out) {
#if HWY_MAX_BYTES == 64
  const Vec s = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14) +
                __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
  typedef double Half __attribute__((vector_size(32)));
  const Half h = __builtin_shufflevector(s, s, 0, 1, 2, 3) + __builtin_shufflevector(s, s, 4, 5, 6, 7);
  out[0] += h[0] + h[2];
  out[1] += h[1] + h[3];
#elif HWY_MAX_BYTES == 32
  const Vec s = __builtin_shufflevector(a, b, 0, 4, 2, 6) + __builtin_shufflevector(a, b, 1, 5, 3, 7);
  out[0] += s[0] + s[2];
  out[1] += s[1] + s[3];
#else
  out[0] += a[0] + a[1];
  out[1] += b[0] + b[1];
#endif
}
