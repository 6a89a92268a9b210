#include "sh/detail/kernels.h"

#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sh/detail/kernels.cpp"
#include <hwy/foreach_target.h>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::sh::detail::HWY_NAMESPACE {
namespace {
#include "sh/detail/vector.h"

#include "sh/detail/azimuth_kernel.h"
#include "sh/detail/basis9_kernel.h"

#include "sh/detail/basis_kernel.h"
#include "sh/detail/fft_kernel.h"
#include "sh/detail/legendre_kernel.h"

#include "sh/detail/rotation_kernel.h"
} // namespace

const Kernels* kernel_set() {
  static const Kernels set = {kLanes == 8 ? "avx512" : (kLanes == 4 ? "avx2" : "baseline"),
                              kLanes,
                              start_order,
                              synthesise_order,
                              analyse_order,
                              load_rows<double>,
                              load_rows<float>,
                              store_rows<double>,
                              store_rows<float>,
                              fft<true>,
                              fft<false>,
                              split_real,
                              merge_real,
                              turn_bins,
                              max_abs<double>,
                              max_abs<float>,
                              evaluate9<float>,
                              evaluate9<double>,
                              evaluate_order_batch<float>,
                              evaluate_order_batch<double>,
                              add_band_values,
                              rotate_columns,
                              sum_orders,
                              add_orders};
  return &set;
}

} // namespace daylit::sh::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::sh::detail {

HWY_EXPORT(kernel_set);

namespace {

const Kernels* set_of_processor() {
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  return HWY_DYNAMIC_DISPATCH(kernel_set)();
}

const Kernels*& selected() {
  static const Kernels* set = set_of_processor();
  return set;
}

} // namespace

const Kernels& kernels() { return *selected(); }
void select_kernels(const Kernels& set) { selected() = &set; }

std::vector<const Kernels*> all_kernels() {
  std::vector<const Kernels*> sets;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) { // best first
    hwy::SetSupportedTargetsForTest(target);
    sets.insert(sets.begin(), set_of_processor());
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  return sets;
}

} // namespace daylit::sh::detail
#endif
