#include "radiosity/matrix_kernels.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include <cblas.h>
#include <unistd.h>

namespace daylit::radiosity {

namespace {
constexpr const char* kVariable = "OPENBLAS_CORETYPE";
constexpr std::string_view kOfUnknownProcessors = "Prescott";
constexpr std::array<std::string_view, 2> kOfAvx2 = {"Haswell", "Zen"}; ///< AMD's with AVX-512 get these too
} // namespace

VectorInstructions VectorInstructions::of_this_processor() {
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return {avx2, avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
                    __builtin_cpu_supports("avx512cd")};
#else
  return {};
#endif
}

std::optional<std::string_view> better_kernels(std::string_view chosen, const VectorInstructions& instructions) {
  const bool unknown = chosen == kOfUnknownProcessors;
  if (instructions.avx512 && (unknown || std::ranges::find(kOfAvx2, chosen) != kOfAvx2.end()))
    return "SkylakeX";
  return unknown && instructions.avx2 ? std::optional<std::string_view>("Haswell") : std::nullopt;
}

void use_matrix_kernels_of_this_processor(char** argv) {
  if (std::getenv(kVariable))
    return;
  const auto kernels = better_kernels(openblas_get_corename(), VectorInstructions::of_this_processor());
  if (!kernels || setenv(kVariable, std::string(*kernels).c_str(), 0) != 0)
    return;
  execv("/proc/self/exe", argv); // returns only where it fails
}

} // namespace daylit::radiosity
