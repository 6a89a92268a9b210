#pragma once

// The inner loops of combining a volume (eq. 4 of Grosch et al. 2007, and the factors of compact_basis.h): sums of rows
// of numbers as they are stored, which become floats as they are read. Vector code by Highway, chosen when the program
// runs; the order of a sum depends on the instruction set, not on the number of threads.

#include <cstddef>
#include <cstdint>
#include <span>

#include "scene/image/rgb_image.h"

namespace daylit::detail {

/// Values [..., channel] and a factor for each channel. T: float, std::int16_t or std::int8_t.
template <class T>
struct WeightedRow {
  const T* value;
  Rgb weight;
};

/// sum[3 n + c] += sum over rows of weight[c] * value[3 n + c], for `count` values.
void add_rows(std::span<const WeightedRow<float>> rows, std::size_t count, float* sum);
void add_rows(std::span<const WeightedRow<std::int16_t>> rows, std::size_t count, float* sum);
void add_rows(std::span<const WeightedRow<std::int8_t>> rows, std::size_t count, float* sum);

/// product[r][c] = sum_i rows[r][i] * light[c][i]; rows are [product.size()][columns], light is [3][columns].
void multiply_rows(const std::int16_t* rows, std::size_t columns, const float* light, std::span<Rgb> product);
void multiply_rows(const std::int8_t* rows, std::size_t columns, const float* light, std::span<Rgb> product);

/// sum over blocks b and k < 8 of weight[8 b + k] * radiance[block[b]][c][k]; weights are half floats (IEEE 754
/// binary16).
Rgb multiply_blocks(const std::uint16_t* weight, std::span<const std::uint16_t> block, const float* radiance);

} // namespace daylit::detail
