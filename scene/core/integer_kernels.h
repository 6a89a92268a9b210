#pragma once

// The inner loops of combining a volume in integers: numbers stay as they are stored, the few weights are rounded
// instead, and the products are summed exactly. What an instruction set computes has the bits of any other up to the
// last multiplication by the step.

#include "scene/core/tile_kernels.h"

namespace daylit::detail {

void add_fixed_baseline(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                        std::size_t count, float* sum);
void add_fixed_avx2(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                    std::size_t count, float* sum);
void add_fixed_avx512(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                      std::size_t count, float* sum);
void add_fixed_vnni(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                    std::size_t count, float* sum);

} // namespace daylit::detail
