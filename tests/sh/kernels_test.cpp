// Every instruction set this processor has must give the numbers of the narrowest one.

#include "sh/detail/kernels.h"

#include <gtest/gtest.h>

#include "sh/algebra.h"
#include "sh/band_probe.h"
#include "sh/basis.h"
#include "sh/detail/fft_plan.h"
#include "sh/detail/legendre_engine.h"
#include "sh/direction_transform.h"
#include "sh/rotation.h"
#include "support.h"

namespace daylit::sh::detail {
namespace {

std::vector<RingPair> some_pairs() {
  std::vector<RingPair> pairs;
  for (int i = 0; i < 37; ++i) {
    const double theta = (i + 0.3) / 37.0 * std::numbers::pi / 2.0;
    pairs.push_back({std::cos(theta), std::sin(theta), i, 100 + i, 1.0, 1.0});
  }
  return pairs;
}

/// Amplitude of (pair, hemisphere, channel, order, part) in an order that does not depend on the lanes.
std::vector<double> flat(LegendreEngine& engine, const Amplitudes& a, int channels) {
  std::vector<double> out;
  for (int v = 0; v < engine.block_vectors(0); ++v)
    for (int lane = 0; lane < engine.lanes(); ++lane)
      for (int south = 0; south < 2 && engine.pair(v, lane); ++south)
        for (int c = 0; c < channels; ++c)
          for (int m = 0; m <= engine.degree(); ++m)
            for (int part = 0; part < 2; ++part)
              out.push_back(
                  m > engine.last_order(v) ? 0.0 : engine.row(a, v, south, c)[(2 * m + part) * engine.lanes() + lane]);
  return out;
}

/// The padding of the last vector holds copies of the last ring; callers give it weight 0.
void clear_padding(LegendreEngine& engine, const Amplitudes& a, int channels) {
  for (int v = 0; v < engine.block_vectors(0); ++v)
    for (int lane = 0; lane < engine.lanes(); ++lane)
      for (int row = 0; row < 2 * channels && !engine.pair(v, lane); ++row)
        for (int k = 0; k <= 2 * engine.last_order(v) + 1; ++k)
          engine.row(a, v, row / channels, row % channels)[k * engine.lanes() + lane] = 0.0;
}

TEST(Kernels, all_instruction_sets_agree_on_legendre_sums) {
  const std::vector<const Kernels*> all = all_kernels();
  constexpr int kDegree = 150;
  for (const int channels : {1, 3}) {
    const auto c = test::random_numbers(151 * 151 * std::size_t(channels), 81);
    std::vector<double> first, first_sums;
    for (std::size_t i = 0; i < all.size(); ++i) {
      LegendreEngine engine(some_pairs(), kDegree, std::size_t(1) << 30, *all[i]);
      engine.set_coefficients(c.data(), channels, channels, 1.0);
      const auto a = engine.amplitudes(0, channels);
      engine.synthesise(0, a);
      const auto values = flat(engine, a, channels);
      clear_padding(engine, a, channels);
      engine.analyse(0, a);
      std::vector<double> sums(c.size());
      engine.get_coefficients(sums.data(), channels, channels, 1.0);
      if (i == 0) {
        first = values;
        first_sums = sums;
      }
      EXPECT_LT(test::max_difference(first, values), 1e-11) << all[i]->name;
      EXPECT_LT(test::max_difference(first_sums, sums), 1e-9) << all[i]->name;
    }
  }
}

TEST(Kernels, fourier_transforms_equal_the_direct_sum_in_every_instruction_set) {
  const std::vector<const Kernels*> all = all_kernels();
  for (std::size_t i = 0; i < all.size(); ++i)
    for (const int samples : {1, 2, 3, 4, 5, 6, 8, 9, 10, 14, 15, 16, 22, 32, 48, 49, 64, 77, 120, 128}) {
      const FftPlan plan(samples);
      const std::size_t n = std::size_t(plan.complex_length()), lanes = std::size_t(all[i]->lanes);
      const auto input = test::random_numbers(2 * n * lanes, 82);
      AlignedBuffer a(2 * n * lanes), b(2 * n * lanes);
      std::copy(input.begin(), input.end(), a.data());
      const double* out = all[i]->fft_forward(plan.passes(), a.data(), b.data());
      for (std::size_t k = 0; k < n; ++k) {
        double re = 0.0, im = 0.0;
        for (std::size_t j = 0; j < n; ++j) {
          const double angle = -2.0 * std::numbers::pi * double(j * k % n) / double(n);
          re += input[2 * j * lanes] * std::cos(angle) - input[(2 * j + 1) * lanes] * std::sin(angle);
          im += input[2 * j * lanes] * std::sin(angle) + input[(2 * j + 1) * lanes] * std::cos(angle);
        }
        ASSERT_NEAR(out[2 * k * lanes], re, 1e-13 * double(n + 1)) << all[i]->name << " " << samples;
        ASSERT_NEAR(out[(2 * k + 1) * lanes], im, 1e-13 * double(n + 1)) << all[i]->name << " " << samples;
      }
    }
}

/// Everything a public function computes with the set in use, one number after the other.
std::vector<double> public_results() {
  constexpr int kDegree = 33;
  constexpr std::size_t kCount = 34 * 34;
  std::mt19937_64 engine(83);
  std::vector<double> x, y, z, out, part(kCount * 21);
  std::vector<float> xf, yf, zf, part_f(kCount * 21);
  for (int k = 0; k < 21; ++k) {
    const glm::dvec3 n = test::random_direction(engine);
    x.push_back(n.x), y.push_back(n.y), z.push_back(n.z);
    xf.push_back(float(n.x)), yf.push_back(float(n.y)), zf.push_back(float(n.z));
  }
  const auto keep = [&out](const auto& v) { out.insert(out.end(), v.begin(), v.end()); };
  EXPECT_TRUE(evaluate_batch(kDegree, std::span<const double>(x), y, z, part));
  keep(part);
  EXPECT_TRUE(evaluate9_batch(std::span<const double>(x), y, z, part, 32));
  keep(std::span(part).first(21));
  auto c = test::random_numbers(kCount * 3, 84);
  keep(BandProbe::create(c, 3, x, y, z)->mean_relative_errors(std::vector<double>(34, 1.0), false));
  EXPECT_TRUE(rotate(test::turn(glm::normalize(glm::dvec3(1, 2, 3)), 0.7), kDegree, 3, c));
  keep(c);
  auto scattered = *DirectionTransform::create(x, y, z, kDegree);
  std::vector<double> values(63);
  EXPECT_TRUE(scattered.synthesise(c, 3, values));
  keep(values);
  EXPECT_TRUE(scattered.analyse(values, x, 3, c));
  keep(c);
  const auto grid = *equirectangular_grid(100, 50);
  auto rings = *RingTransform::create(grid, kDegree);
  std::vector<float> image(grid.samples() * 3);
  EXPECT_TRUE(rings.synthesise(c, interleaved(image.data(), 100, 3)));
  EXPECT_TRUE(rings.analyse(interleaved<const float>(image.data(), 100, 3), c));
  for (double& v : c)
    v *= 1e-6; // the image was float
  keep(c);
  EXPECT_TRUE(evaluate_batch(kDegree, std::span<const float>(xf), yf, zf, part_f));
  for (float& v : part_f)
    v *= 1e-6f;
  keep(part_f);
  return out;
}

TEST(Kernels, every_public_function_gives_the_same_numbers_with_every_instruction_set) {
  const std::vector<const Kernels*> all = all_kernels();
  select_kernels(*all[0]);
  const auto first = public_results();
  for (std::size_t i = 1; i < all.size(); ++i) {
    select_kernels(*all[i]);
    EXPECT_EQ(instruction_set(), all[i]->name);
    EXPECT_LT(test::max_difference(first, public_results()), 1e-10) << all[i]->name;
  }
  select_kernels(*all.back());
}

TEST(Kernels, largest_magnitude_sees_every_element_and_every_nan) {
  const std::vector<const Kernels*> all = all_kernels();
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t at = 0; at < 37; ++at) {
      std::vector<double> v(37, 0.5);
      v[at] = -3.0;
      EXPECT_EQ(all[i]->max_abs_f64(v.data(), v.size()), 3.0);
      v[at] = std::numeric_limits<double>::infinity();
      EXPECT_TRUE(std::isnan(all[i]->max_abs_f64(v.data(), v.size())));
      std::vector<float> f(37, 0.5f);
      f[at] = std::numeric_limits<float>::quiet_NaN();
      EXPECT_TRUE(std::isnan(all[i]->max_abs_f32(f.data(), f.size())));
    }
}

TEST(Kernels, skipped_orders_are_negligible) {
  // The last order kept on a ring leaves out less than 1e-22 of the row: checked against long double.
  constexpr int kDegree = 500;
  LegendreEngine engine(some_pairs(), kDegree, std::size_t(1) << 30, kernels());
  int skipped = 0;
  for (int v = 0; v < engine.block_vectors(0); ++v)
    for (int lane = 0; lane < engine.lanes(); ++lane)
      if (const RingPair* p = engine.pair(v, lane); p && engine.last_order(v) < kDegree) {
        const int m = engine.last_order(v) + 1;
        for (const long double value :
             test::legendre_reference(m, kDegree, static_cast<long double>(p->x), static_cast<long double>(p->sine)))
          ASSERT_LT(std::abs(double(value)), 1e-22) << v << " " << m;
        skipped += kDegree - m;
      }
  EXPECT_GT(skipped, 1000) << "nothing is skipped: the cut-off does not work";
}

} // namespace
} // namespace daylit::sh::detail
