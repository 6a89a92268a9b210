#pragma once

// Loops over sixteen lanes that the compiler turns into vector instructions, one version per instruction set, chosen
// when the program starts. `omp simd` (compiled with -fopenmp-simd, no OpenMP runtime) keeps it from unrolling them
// into scalars first.

#define DAYLIT_LANE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#define DAYLIT_EACH_LANE _Pragma("omp simd") for (int k = 0; k < kLanes; ++k)
