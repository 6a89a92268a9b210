#include "scene/volume/row_kernels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/volume/row_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Vector = hn::Vec<Floats>;

constexpr std::size_t kLanes = hn::MaxLanes(Floats());
/// Rows that are read side by side: the sums are loaded and stored once for all of them.
constexpr std::size_t kRowsAtOnce = 4;
/// Numbers of the sums that stay in the first cache while all rows pass: 180 probes, 19 KB.
constexpr std::size_t kTile = 102 * 48;

/// Lanes of consecutive numbers; integers become floats exactly: 24 bits hold all of 16.
inline Vector load(const float* from) { return hn::LoadU(Floats(), from); }
template <class T>
Vector load(const T* from) {
  const hn::RebindToSigned<Floats> integers;
  return hn::ConvertTo(Floats(), hn::PromoteTo(integers, hn::LoadU(hn::Rebind<T, Floats>(), from)));
}

/// Numbers [first, end) of kRows rows. Three vectors hold whole colours: lane i of vector v has channel (v lanes + i)
/// % 3.
template <std::size_t kRows, class T>
void add_some_rows(const WeightedRow<T>* rows, std::size_t first, std::size_t end, float* sum) {
  HWY_ALIGN float weight[kRows][3 * kLanes];
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t k = 0; k < 3 * kLanes; ++k)
      weight[r][k] = rows[r].weight[static_cast<int>(k % 3)];
  std::size_t k = first;
  for (; k + 3 * kLanes <= end; k += 3 * kLanes)
    for (std::size_t v = 0; v < 3 * kLanes; v += kLanes) {
      Vector s = load(sum + k + v);
      for (std::size_t r = 0; r < kRows; ++r)
        s = hn::MulAdd(load(weight[r] + v), load(rows[r].value + k + v), s);
      hn::StoreU(s, Floats(), sum + k + v);
    }
  for (; k < end; ++k)
    for (std::size_t r = 0; r < kRows; ++r)
      sum[k] += weight[r][(k - first) % 3] * static_cast<float>(rows[r].value[k]);
}

/// sum[k] += sum_r weight_r[k % 3] value_r[k], tile by tile: each row is read once, the sums once per four rows.
template <class T>
void add_all_rows(std::span<const WeightedRow<T>> rows, std::size_t count, float* sum) {
  for (std::size_t first = 0; first < count; first += kTile) {
    const std::size_t end = std::min(first + kTile, count);
    std::size_t r = 0;
    for (; r + kRowsAtOnce <= rows.size(); r += kRowsAtOnce)
      add_some_rows<kRowsAtOnce>(&rows[r], first, end, sum);
    for (; r < rows.size(); ++r)
      add_some_rows<1>(&rows[r], first, end, sum);
  }
}

/// product[r, c] = sum_i rows[r, i] light[c, i]: twelve sums in registers, lane by lane, which are added up at the end.
/// What does not fill a vector is added number by number.
template <std::size_t kRows, class T>
void multiply_some_rows(const T* rows, std::size_t columns, const float* light, Rgb* product) {
  Vector sum[kRows][3];
  for (auto& of_row : sum)
    for (Vector& s : of_row)
      s = hn::Zero(Floats());
  std::size_t i = 0;
  for (; i + kLanes <= columns; i += kLanes) {
    const Vector red = load(light + i), green = load(light + columns + i), blue = load(light + 2 * columns + i);
    for (std::size_t r = 0; r < kRows; ++r) {
      const Vector x = load(rows + r * columns + i);
      sum[r][0] = hn::MulAdd(x, red, sum[r][0]);
      sum[r][1] = hn::MulAdd(x, green, sum[r][1]);
      sum[r][2] = hn::MulAdd(x, blue, sum[r][2]);
    }
  }
  for (std::size_t r = 0; r < kRows; ++r) {
    for (std::size_t c = 0; c < 3; ++c)
      product[r][static_cast<int>(c)] = hn::GetLane(hn::SumOfLanes(Floats(), sum[r][c]));
    for (std::size_t k = i; k < columns; ++k)
      product[r] +=
          static_cast<float>(rows[r * columns + k]) * Rgb(light[k], light[columns + k], light[2 * columns + k]);
  }
}

template <class T>
void multiply_all_rows(const T* rows, std::size_t columns, const float* light, std::span<Rgb> product) {
  std::size_t r = 0;
  for (; r + kRowsAtOnce <= product.size(); r += kRowsAtOnce)
    multiply_some_rows<kRowsAtOnce>(rows + r * columns, columns, light, &product[r]);
  for (; r < product.size(); ++r)
    multiply_some_rows<1>(rows + r * columns, columns, light, &product[r]);
}

using AddFloats = std::span<const WeightedRow<float>>;
using AddWords = std::span<const WeightedRow<std::int16_t>>;
using AddBytes = std::span<const WeightedRow<std::int8_t>>;

void add_float(AddFloats rows, std::size_t count, float* sum) { add_all_rows(rows, count, sum); }
void add_int16(AddWords rows, std::size_t count, float* sum) { add_all_rows(rows, count, sum); }
void add_int8(AddBytes rows, std::size_t count, float* sum) { add_all_rows(rows, count, sum); }

void multiply_int16(const std::int16_t* rows, std::size_t columns, const float* light, std::span<Rgb> product) {
  multiply_all_rows(rows, columns, light, product);
}
void multiply_int8(const std::int8_t* rows, std::size_t columns, const float* light, std::span<Rgb> product) {
  multiply_all_rows(rows, columns, light, product);
}

/// Eight weights of a block are eight lanes; the radiances of the block lie beside each other, channel by channel.
Rgb multiply_half_blocks(const std::uint16_t* weight, std::span<const std::uint16_t> block, const float* radiance) {
  constexpr std::size_t kBlock = 8;
  const hn::CappedTag<float, kBlock> d;
  const hn::Rebind<hwy::float16_t, decltype(d)> halves;
  using Part = hn::Vec<decltype(d)>;
  Part sum[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (std::size_t b = 0; b < block.size(); ++b)
    for (std::size_t k = 0; k < kBlock; k += hn::Lanes(d)) {
      const auto* from = reinterpret_cast<const hwy::float16_t*>(weight + kBlock * b + k);
      const Part w = hn::PromoteTo(d, hn::LoadU(halves, from));
      const float* l = radiance + 3 * kBlock * block[b] + k;
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] = hn::MulAdd(w, hn::LoadU(d, l + kBlock * c), sum[c]);
    }
  return {hn::GetLane(hn::SumOfLanes(d, sum[0])), hn::GetLane(hn::SumOfLanes(d, sum[1])),
          hn::GetLane(hn::SumOfLanes(d, sum[2]))};
}

} // namespace daylit::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace daylit::detail {

HWY_EXPORT(add_float);
HWY_EXPORT(add_int16);
HWY_EXPORT(add_int8);
HWY_EXPORT(multiply_int16);
HWY_EXPORT(multiply_int8);
HWY_EXPORT(multiply_half_blocks);

void add_rows(std::span<const WeightedRow<float>> rows, std::size_t count, float* sum) {
  HWY_DYNAMIC_DISPATCH(add_float)(rows, count, sum);
}
void add_rows(std::span<const WeightedRow<std::int16_t>> rows, std::size_t count, float* sum) {
  HWY_DYNAMIC_DISPATCH(add_int16)(rows, count, sum);
}
void add_rows(std::span<const WeightedRow<std::int8_t>> rows, std::size_t count, float* sum) {
  HWY_DYNAMIC_DISPATCH(add_int8)(rows, count, sum);
}
void multiply_rows(const std::int16_t* rows, std::size_t columns, const float* light, std::span<Rgb> product) {
  HWY_DYNAMIC_DISPATCH(multiply_int16)(rows, columns, light, product);
}
void multiply_rows(const std::int8_t* rows, std::size_t columns, const float* light, std::span<Rgb> product) {
  HWY_DYNAMIC_DISPATCH(multiply_int8)(rows, columns, light, product);
}
Rgb multiply_blocks(const std::uint16_t* weight, std::span<const std::uint16_t> block, const float* radiance) {
  return HWY_DYNAMIC_DISPATCH(multiply_half_blocks)(weight, block, radiance);
}

} // namespace daylit::detail

#endif // HWY_ONCE
