// How the components of a fine sky are stored: bytes against error, and what rounding does to neighbours.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "precompute/detail/storage.h"

namespace daylit::precompute::detail {
namespace {

double bytes_of(const Component& c, Stored s) { return static_cast<double>(s) * static_cast<double>(c.size); }
double error2_of(const Component& c, Stored s) {
  return s == Stored::nothing ? c.power : s == Stored::weak ? c.weak_error2 : 0.0;
}

TEST(Storage, choice_keeps_the_error_and_costs_at_most_one_step_more_than_the_best) {
  const std::vector<Component> list{{9.0, 0.4, 100}, {4.0, 0.3, 130},  {2.0, 0.01, 100},
                                    {0.7, 0.05, 90}, {0.2, 0.15, 100}, {0.05, 0.001, 100}};
  for (const double allowed : {0.0, 0.04, 0.3, 1.0, 3.0, 20.0}) {
    double least = 1e9; // of all 3^6 choices
    for (int code = 0; code < 729; ++code) {
      double bytes = 0, error2 = 0;
      for (int k = 0, rest = code; k < 6; ++k, rest /= 3) {
        bytes += bytes_of(list[static_cast<std::size_t>(k)], static_cast<Stored>(rest % 3));
        error2 += error2_of(list[static_cast<std::size_t>(k)], static_cast<Stored>(rest % 3));
      }
      if (error2 <= allowed)
        least = std::min(least, bytes);
    }
    double per_byte = -1;
    const std::vector<Stored> choice = cheapest(list, allowed, &per_byte);
    EXPECT_EQ(cheapest_at(list, per_byte), choice) << "further components are treated alike";
    double bytes = 0, error2 = 0;
    for (std::size_t k = 0; k < list.size(); ++k) {
      bytes += bytes_of(list[k], choice[k]);
      error2 += error2_of(list[k], choice[k]);
    }
    EXPECT_LE(error2, allowed + 1e-12);
    EXPECT_LE(bytes, least + 200.0) << "allowed " << allowed;
  }
}

TEST(Storage, sum_over_any_run_of_sources_is_off_by_less_than_two_halves_of_a_step) {
  std::vector<float> numbers;
  for (int k = 0; k < 500; ++k)
    numbers.push_back(k % 50 == 7 ? 0.0f : 0.3f + 0.2f * std::sin(0.05f * static_cast<float>(k)));
  numbers[0] = 1.0f;
  const Rounded r = Rounded::source_factor(numbers, Stored::weak);
  const std::vector<float> kept = r.values();
  for (std::size_t first = 0; first < numbers.size(); first += 13) {
    double off = 0;
    for (std::size_t k = first; k < numbers.size(); ++k) {
      off += static_cast<double>(kept[k]) - static_cast<double>(numbers[k]);
      EXPECT_LE(std::abs(off), 1.001 * static_cast<double>(r.step)) << first << " to " << k;
    }
  }
  EXPECT_EQ(kept[7], 0.0f); // nothing stays nothing
}

TEST(Storage, rounding_of_rows_is_what_was_expected_of_it) {
  std::vector<float> numbers;
  for (int k = 0; k < 4000; ++k)
    numbers.push_back(std::sin(0.7f * static_cast<float>(k)) / (1.0f + 0.01f * static_cast<float>(k % 97)));
  const std::vector<float> kept = Rounded::row_factor(numbers, Stored::weak).values();
  double error2 = 0, power2 = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    error2 += std::pow(static_cast<double>(kept[k] - numbers[k]), 2.0);
    power2 += std::pow(static_cast<double>(numbers[k]), 2.0);
  }
  EXPECT_NEAR(error2 / power2 / row_rounding2(numbers), 1.0, 0.15);
}

} // namespace
} // namespace daylit::precompute::detail
