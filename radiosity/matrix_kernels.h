#pragma once

// OpenBLAS chooses its matrix kernels by the model number of the processor when it is loaded. One that is younger than
// the library (0.3.21, Debian 12: Intel's Emerald Rapids) gets kernels for SSE3, with which a bake takes 1.3 to 2 times
// as long, and AMD's with AVX-512 get kernels for AVX2 (docs/notes/bake.md).

#include <optional>
#include <string_view>

namespace daylit::radiosity {

/// Vector instructions, as far as OpenBLAS's kernels differ by them.
struct VectorInstructions {
  bool avx2 = false;   ///< with FMA
  bool avx512 = false; ///< F, DQ, BW, VL, CD

  static VectorInstructions of_this_processor();
};

/// The kernels (OPENBLAS_CORETYPE) to use in the place of those that OpenBLAS chose (openblas_get_corename()); nothing
/// where it knows the processor, or has no better ones.
std::optional<std::string_view> better_kernels(std::string_view chosen, const VectorInstructions& instructions);

/// First of all in main(): starts the program again, with the same arguments, where OpenBLAS has better kernels than it
/// chose, since it reads their name only when it is loaded. Returns where there is nothing to do, where the user has
/// set OPENBLAS_CORETYPE, or where the program cannot be started again.
void use_matrix_kernels_of_this_processor(char** argv);

} // namespace daylit::radiosity
