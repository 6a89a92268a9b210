#include "sh/detail/kernels.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#define DAYLIT_SH_LANES 2

namespace daylit::sh::detail {
namespace {
#include "sh/detail/vector.h"

#include "sh/detail/azimuth_kernel.h"
#include "sh/detail/basis9_kernel.h"

#include "sh/detail/basis_kernel.h"
#include "sh/detail/fft_kernel.h"
#include "sh/detail/legendre_kernel.h"

#include "sh/detail/rotation_kernel.h"
} // namespace

extern const Kernels kKernelsBaseline;
const Kernels kKernelsBaseline = {"baseline",
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
} // namespace daylit::sh::detail
