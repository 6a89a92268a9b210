#pragma once

// Intrinsics for functions that are compiled for wider vectors than the rest and chosen when the program runs.

// GCC 12 warns about its own header (its bug 105593).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif
#include <immintrin.h>

#define DAYLIT_AVX2 __attribute__((target("avx2,fma,f16c")))
#define DAYLIT_AVX512 __attribute__((target("avx512f,avx512bw,avx512vl,avx512dq,avx2,fma,f16c")))
#define DAYLIT_VNNI __attribute__((target("avx512f,avx512bw,avx512vl,avx512dq,avx512vnni,avx2,fma,f16c")))

#define DAYLIT_INLINE inline __attribute__((always_inline))

namespace daylit::detail {

// As _mm512_dpbusd_epi32 and _mm512_dpwssd_epi32, around which GCC 12 copies every sum twice.
DAYLIT_VNNI DAYLIT_INLINE void add_byte_products(__m512i& total, __m512i unsigned_bytes, __m512i bytes) {
  asm("vpdpbusd %2, %1, %0" : "+v"(total) : "v"(unsigned_bytes), "v"(bytes));
}
DAYLIT_VNNI DAYLIT_INLINE void add_word_products(__m512i& total, __m512i a, __m512i b) {
  asm("vpdpwssd %1, %2, %0" : "+v"(total) : "vm"(a), "v"(b));
}

} // namespace daylit::detail
