#include "radiosity/matrix_kernels.h"

#include <gtest/gtest.h>

namespace daylit::radiosity {
namespace {

TEST(MatrixKernels, a_processor_that_openblas_does_not_know_gets_those_of_its_vector_instructions) {
  EXPECT_EQ(better_kernels("Prescott", {.avx2 = true, .avx512 = true}), "SkylakeX");
  EXPECT_EQ(better_kernels("Prescott", {.avx2 = true}), "Haswell");
}

TEST(MatrixKernels, avx512_is_used_where_openblas_chose_kernels_for_avx2) {
  EXPECT_EQ(better_kernels("Haswell", {.avx2 = true, .avx512 = true}), "SkylakeX");
  EXPECT_EQ(better_kernels("Zen", {.avx2 = true, .avx512 = true}), "SkylakeX");
}

TEST(MatrixKernels, one_that_it_knows_or_that_has_no_others_keeps_them) {
  EXPECT_FALSE(better_kernels("Prescott", {}));
  EXPECT_FALSE(better_kernels("Zen", {.avx2 = true}));
  EXPECT_FALSE(better_kernels("Haswell", {.avx2 = true}));
  EXPECT_FALSE(better_kernels("SkylakeX", {.avx2 = true, .avx512 = true}));
}

} // namespace
} // namespace daylit::radiosity
