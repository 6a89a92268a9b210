// The vector loops of combining against their scalar twins, with every instruction set that this processor has.

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <Imath/half.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "scene/volume/row_kernels.h"

namespace daylit::detail {
namespace {

/// Runs with the widest vectors, then with ever fewer of the processor's instruction sets.
template <class Check>
void with_every_instruction_set(const Check& check) {
  const std::int64_t all = hwy::SupportedTargets();
  for (std::int64_t left = all; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    check();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

template <class T>
std::vector<T> random_numbers(std::size_t count) {
  std::mt19937 random(12);
  std::vector<T> list(count);
  for (T& x : list)
    if constexpr (std::is_integral_v<T>)
      x = static_cast<T>(
          std::uniform_int_distribution<int>(std::numeric_limits<T>::min(), std::numeric_limits<T>::max())(random));
    else
      x = std::uniform_real_distribution<T>(-1, 1)(random);
  return list;
}

std::vector<Rgb> random_weights(std::size_t count) {
  const std::vector<float> x = random_numbers<float>(3 * count);
  std::vector<Rgb> list(count);
  for (std::size_t k = 0; k < count; ++k)
    list[k] = {x[3 * k], x[3 * k + 1], x[3 * k + 2]};
  return list;
}

template <class T>
class RowsOf : public testing::Test {};
using StoredTypes = testing::Types<float, std::int16_t, std::int8_t>;
TYPED_TEST_SUITE(RowsOf, StoredTypes);

TYPED_TEST(RowsOf, weighted_sums_are_those_of_the_scalar_twin) {
  for (const std::size_t count : {0u, 3u, 27u, 96u, 150u, 4896u, 5100u})
    for (const std::size_t rows : {0u, 1u, 4u, 11u}) {
      const std::vector<TypeParam> number = random_numbers<TypeParam>(rows * count);
      const std::vector<Rgb> weight = random_weights(rows);
      std::vector<WeightedRow<TypeParam>> list;
      for (std::size_t r = 0; r < rows; ++r)
        list.push_back({number.data() + r * count, weight[r]});
      with_every_instruction_set([&] {
        std::vector<float> sum(count + 1, 0.5f);
        add_rows(list, count, sum.data());
        for (std::size_t k = 0; k < count; ++k) {
          double exact = 0.5, size = 0.5;
          for (std::size_t r = 0; r < rows; ++r) {
            const double x = double(weight[r][static_cast<int>(k % 3)]) * double(number[r * count + k]);
            exact += x;
            size += std::abs(x);
          }
          ASSERT_NEAR(double(sum[k]), exact, 2e-7 * size * double(rows + 1)) << count << " " << rows << " " << k;
        }
        ASSERT_EQ(sum[count], 0.5f);
      });
    }
}

template <class T>
class ProductsOf : public testing::Test {};
using FactorTypes = testing::Types<std::int16_t, std::int8_t>;
TYPED_TEST_SUITE(ProductsOf, FactorTypes);

TYPED_TEST(ProductsOf, rows_times_light_are_those_of_the_scalar_twin) {
  for (const std::size_t columns : {0u, 1u, 15u, 16u, 33u, 700u})
    for (const std::size_t rows : {1u, 4u, 10u}) {
      const std::vector<TypeParam> number = random_numbers<TypeParam>(rows * columns);
      const std::vector<float> light = random_numbers<float>(3 * columns);
      with_every_instruction_set([&] {
        std::vector<Rgb> product(rows, Rgb(7.0f));
        multiply_rows(number.data(), columns, light.data(), product);
        for (std::size_t r = 0; r < rows; ++r)
          for (std::size_t c = 0; c < 3; ++c) {
            double exact = 0, size = 0;
            for (std::size_t i = 0; i < columns; ++i) {
              const double x = double(number[r * columns + i]) * double(light[c * columns + i]);
              exact += x;
              size += std::abs(x);
            }
            ASSERT_NEAR(double(product[r][static_cast<int>(c)]), exact, 2e-6 * size) << columns << " " << rows;
          }
      });
    }
}

TEST(BlockRow, product_with_the_sky_is_that_of_the_scalar_twin) {
  const std::vector<float> radiance = random_numbers<float>(3 * 8 * 40);
  std::vector<std::uint16_t> block, weight;
  for (std::uint16_t b = 0; b < 40; b = static_cast<std::uint16_t>(b + 1 + b % 3))
    block.push_back(b);
  for (const float x : random_numbers<float>(8 * block.size()))
    weight.push_back(imath_float_to_half(x));
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{5}, block.size()})
    with_every_instruction_set([&] {
      const Rgb product = multiply_blocks(weight.data(), std::span(block).first(count), radiance.data());
      for (std::size_t c = 0; c < 3; ++c) {
        double exact = 0, size = 0;
        for (std::size_t k = 0; k < 8 * count; ++k) {
          const double x =
              double(imath_half_to_float(weight[k])) * double(radiance[24u * block[k / 8] + 8 * c + k % 8]);
          exact += x;
          size += std::abs(x);
        }
        ASSERT_NEAR(double(product[static_cast<int>(c)]), exact, 1e-6 * size) << count;
      }
    });
}

} // namespace
} // namespace daylit::detail
