#include <limits>

#include <gtest/gtest.h>

#include "sh/algebra.h"
#include "sh/band_probe.h"
#include "sh/basis.h"
#include "sh/direction_transform.h"
#include "sh/irradiance.h"
#include "sh/rotation.h"
#include "sh/window.h"
#include "sh/zonal.h"
#include "support.h"

namespace daylit::sh {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <class R>
void expect_error(const R& result, ErrorCode code) {
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, code) << result.error().message();
  EXPECT_FALSE(result.error().what.empty());
  EXPECT_FALSE(result.error().where.empty());
}

TEST(BadInput, evaluation_says_what_is_wrong) {
  std::vector<double> out(9);
  expect_error(evaluate(-1, glm::dvec3(0, 0, 1), out), ErrorCode::degree_out_of_range);
  expect_error(evaluate(kMaxDegree + 1, glm::dvec3(0, 0, 1), out), ErrorCode::degree_out_of_range);
  expect_error(evaluate(3, glm::dvec3(0, 0, 1), out), ErrorCode::wrong_count);
  expect_error(evaluate(2, glm::dvec3(0, 0, 1.1), out), ErrorCode::not_a_unit_direction);
  expect_error(evaluate(2, glm::dvec3(0, 0, 0), out), ErrorCode::not_a_unit_direction);
  expect_error(evaluate(2, glm::dvec3(0, kNaN, 1), out), ErrorCode::not_a_unit_direction);
  expect_error(evaluate_order(3, 2, glm::dvec3(0, 0, 1), out, out), ErrorCode::parameter_out_of_range);
  const std::vector<double> a{0.0, 2.0}, b{0.0, 0.0}, c{1.0, 0.0};
  std::vector<double> two(18);
  expect_error(evaluate_batch(2, std::span<const double>(a), b, c, two), ErrorCode::not_a_unit_direction);
  expect_error(evaluate_batch(2, std::span<const double>(a), b, std::span(c).first(1), two), ErrorCode::wrong_count);
  expect_error(evaluate9_batch(std::span<const double>(a), b, c, std::span(two).first(17), 2), ErrorCode::wrong_count);
}

TEST(BadInput, grids_refuse_sizes_they_cannot_have) {
  expect_error(gauss_legendre(0), ErrorCode::parameter_out_of_range);
  expect_error(fejer(-4), ErrorCode::parameter_out_of_range);
  expect_error(clenshaw_curtis(1), ErrorCode::parameter_out_of_range);
  expect_error(gauss_legendre_grid(-1), ErrorCode::parameter_out_of_range);
  expect_error(equirectangular_grid(0, 4), ErrorCode::parameter_out_of_range);
  expect_error(equirectangular_grid(2000000000, 4), ErrorCode::parameter_out_of_range);
}

TEST(BadInput, ring_transform_refuses_broken_grids_and_data) {
  auto grid = *gauss_legendre_grid(4);
  expect_error(RingTransform::create(grid, -2), ErrorCode::degree_out_of_range);
  expect_error(RingTransform::create(RingGrid{}, 2), ErrorCode::parameter_out_of_range);
  auto broken = grid;
  broken.cos_theta[1] = 0.3;
  expect_error(RingTransform::create(broken, 2), ErrorCode::parameter_out_of_range);
  broken = grid;
  broken.weight_sr.pop_back();
  expect_error(RingTransform::create(broken, 2), ErrorCode::wrong_count);

  auto transform = *RingTransform::create(grid, 4);
  std::vector<double> c(25, 0.0), image(grid.samples(), 0.0);
  const auto view = interleaved(image.data(), grid.longitudes, 1);
  const auto input = interleaved<const double>(image.data(), grid.longitudes, 1);
  expect_error(transform.synthesise(std::span(c).first(24), view), ErrorCode::wrong_count);
  expect_error(transform.analyse(input, std::span(c).first(9)), ErrorCode::wrong_count);
  c[7] = kNaN;
  expect_error(transform.synthesise(c, view), ErrorCode::not_finite);
  image[11] = std::numeric_limits<double>::infinity();
  expect_error(transform.analyse(input, c), ErrorCode::not_finite);
  expect_error(transform.analyse(ImageView<const double>{image.data(), 1, 1, 1, 0}, c),
               ErrorCode::parameter_out_of_range);
}

TEST(BadInput, direction_transform_refuses_broken_directions_and_data) {
  const std::vector<double> x{1.0, 0.0}, y{0.0, 1.0}, z{0.0, 0.0}, bad{0.0, kNaN};
  expect_error(DirectionTransform::create(x, y, bad, 3), ErrorCode::not_a_unit_direction);
  expect_error(DirectionTransform::create({}, {}, {}, 3), ErrorCode::wrong_count);
  auto transform = *DirectionTransform::create(x, y, z, 1);
  std::vector<double> c(4, 0.0), values(2, 0.0);
  expect_error(transform.synthesise(c, 0, values), ErrorCode::parameter_out_of_range);
  expect_error(transform.synthesise(c, 1, std::span(values).first(1)), ErrorCode::wrong_count);
  expect_error(transform.analyse(bad, x, 1, c), ErrorCode::not_finite);
  expect_error(transform.analyse(values, bad, 1, c), ErrorCode::not_finite);
}

TEST(BadInput, the_algebra_refuses_wrong_counts_and_parameters) {
  std::vector<double> nine(9, 1.0), eight(8, 1.0), bands(3, 1.0);
  expect_error(phong_bands(0.5, 3), ErrorCode::parameter_out_of_range);
  expect_error(phong_bands(kNaN, 3), ErrorCode::parameter_out_of_range);
  expect_error(phong_bands(2.0, -1), ErrorCode::degree_out_of_range);
  expect_error(phong_degree(2.0, 0.0), ErrorCode::parameter_out_of_range);
  expect_error(convolve(bands, 1, eight), ErrorCode::wrong_count);
  expect_error(convolve(bands, 0, nine), ErrorCode::parameter_out_of_range);
  expect_error(rotate(glm::dmat3(2.0), 2, 1, nine), ErrorCode::parameter_out_of_range);
  expect_error(rotate(glm::dmat3(0.0), 2, 1, nine), ErrorCode::parameter_out_of_range);
  expect_error(rotate(glm::dmat3(1, 0, 0, 0, 1, 0, 0, 0, -1), 2, 1, nine), ErrorCode::parameter_out_of_range);
  expect_error(rotate(glm::dmat3(1.0), 3, 1, nine), ErrorCode::wrong_count);
  expect_error(product(eight, nine, 2), ErrorCode::wrong_count);
  expect_error(band_energies(nine, 2), ErrorCode::wrong_count);
  expect_error(choose_degree(bands, nine, 0.0, 0.1), ErrorCode::wrong_count);
  expect_error(order3_remainder(eight), ErrorCode::wrong_count);
  expect_error(order3_remainder(nine, -1.0), ErrorCode::parameter_out_of_range);
  expect_error(BandProbe::create(eight, 1, bands, bands, bands), ErrorCode::wrong_count);
  expect_error(BandProbe::create(nine, 0, bands, bands, bands), ErrorCode::degree_out_of_range);
  expect_error(hann_window(3, 0.0), ErrorCode::parameter_out_of_range);
  expect_error(lanczos_window(-3, 1.0), ErrorCode::degree_out_of_range);
  expect_error(window_bias(bands, eight), ErrorCode::wrong_count);
  expect_error(minimum_on_sphere(eight), ErrorCode::wrong_count);
  nine[0] = -1.0;
  expect_error(nonnegative_window(nine), ErrorCode::parameter_out_of_range);
  nine[3] = kNaN;
  expect_error(minimum_on_sphere(nine), ErrorCode::not_finite);
  expect_error(rotate(glm::dmat3(1.0), 2, 1, nine), ErrorCode::not_finite);
}

} // namespace
} // namespace daylit::sh
