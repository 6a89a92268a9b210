#include "sh/detail/kernels.h"

namespace daylit::sh::detail {

extern const Kernels kKernelsBaseline;
#if defined(__x86_64__)
extern const Kernels kKernelsAvx2;
extern const Kernels kKernelsAvx512;
#endif

const Kernels* const* all_kernels(int* count) {
  struct Available {
    const Kernels* sets[3] = {&kKernelsBaseline, nullptr, nullptr};
    int count = 1;
    Available() {
#if defined(__x86_64__)
      __builtin_cpu_init();
      const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
      if (avx2)
        sets[count++] = &kKernelsAvx2;
      if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
          __builtin_cpu_supports("avx512vl"))
        sets[count++] = &kKernelsAvx512;
#endif
    }
  };
  static const Available available;
  *count = available.count;
  return available.sets;
}

namespace {

const Kernels*& selected() {
  static const Kernels* set = [] {
    int count = 0;
    const Kernels* const* sets = all_kernels(&count);
    return sets[count - 1];
  }();
  return set;
}

} // namespace

const Kernels& kernels() { return *selected(); }
void select_kernels(const Kernels& set) { selected() = &set; }

} // namespace daylit::sh::detail
