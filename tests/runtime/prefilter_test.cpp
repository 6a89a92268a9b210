#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <tbb/global_control.h>

#include "runtime/maps/prefilter.h"
#include "runtime/maps/progressive_maps.h"

namespace daylit {
namespace {

constexpr PrefilterMethod kMethods[] = {PrefilterMethod::exact, PrefilterMethod::mip_chain, PrefilterMethod::harmonics};

RadianceMap blurred(const RadianceMap& map, double exponent, int side, PrefilterMethod method,
                    double tolerance = 1e-5) {
  const Lobe lobe{exponent, side};
  auto maps = prefilter(map, std::span(&lobe, 1), method, {tolerance, {}, {}});
  EXPECT_TRUE(maps);
  return std::move((*maps)[0]);
}

/// A sky with a sun of 1e5 through a window, over a dark room.
RadianceMap lit_room(int side) {
  const glm::dvec3 sun = glm::normalize(glm::dvec3(0.8, 0.2, 0.25));
  return sampled_map(side, 1, [&](const glm::dvec3& w) {
    const bool window = w.x > 0.5 && std::abs(w.y) < 0.4 && std::abs(w.z - 0.2) < 0.3;
    const double room = 0.5 + 0.3 * w.z + 0.1 * std::sin(7.0 * w.y);
    const double light = !window ? room : glm::dot(w, sun) > 0.9993 ? 1e5 : 40.0 + 20.0 * w.z;
    return Rgb(glm::dvec3(light, 0.9 * light, light * (window ? 1.2 : 0.6)));
  });
}

/// Largest relative error of the texels, every `step`-th of them, against the slow twin.
double largest_error(const RadianceMap& source, double exponent, const RadianceMap& map, std::size_t step) {
  std::vector<glm::dvec3> directions;
  for (std::size_t i = 0; i < map.radiance.size(); i += step)
    directions.push_back(map.direction(i));
  const auto truth = plain_prefilter(source, exponent, directions);
  double most = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    for (int c = 0; c < 3; ++c)
      most = std::max(most, std::abs(static_cast<double>(map.radiance[k * step][c]) / truth[k][c] - 1.0));
  return most;
}

TEST(Prefilter, a_constant_map_stays_constant_by_every_method) {
  const RadianceMap map(64, Rgb(0.25f, 1.0f, 3.0f));
  for (const PrefilterMethod method : kMethods)
    for (const double exponent : {1.0, 2.5, 40.0, 3000.0})
      for (const Rgb& c : blurred(map, exponent, 32, method).radiance)
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(c[k] / map.radiance[0][k], 1.0f,
                      method == PrefilterMethod::mip_chain ? 2e-5f : 2e-6f) // 1024 floats
              << exponent;
}

TEST(Prefilter, a_single_texel_becomes_the_lobe) {
  RadianceMap map(64);
  const std::size_t lit = 64 * 20 + 37;
  map.radiance[lit] = Rgb(1.0f);
  for (const double exponent : {1.0, 10.0, 40.0}) {
    const RadianceMap exact = blurred(map, exponent, 64, PrefilterMethod::exact);
    const RadianceMap harmonic = blurred(map, exponent, 64, PrefilterMethod::harmonics);
    const double peak = 2.0 * (exponent + 1.0) / static_cast<double>(map.radiance.size());
    for (std::size_t i = 0; i < map.radiance.size(); i += 7) {
      const auto lobe = [&](std::size_t k) {
        return std::pow(std::max(0.0, glm::dot(map.direction(i), map.direction(k))), exponent);
      };
      double weights = 0.0; // 1 / peak, but for the quadrature
      for (std::size_t k = 0; k < map.radiance.size(); ++k)
        weights += lobe(k);
      // a cosine in float: 1e-7 of the peak
      EXPECT_NEAR(exact.radiance[i].r, lobe(lit) / weights, 1e-5 * lobe(lit) / weights + 2e-7 * peak);
      EXPECT_NEAR(harmonic.radiance[i].r, lobe(lit) / weights, 5e-3 * peak);
    }
  }
}

TEST(Prefilter, irradiance_of_a_linear_map_has_its_first_band_times_two_thirds) {
  // L = 1 + a . w: E / pi = 1 + (A_1 / A_0) a . n = 1 + 2/3 a . n (Ramamoorthi & Hanrahan 2001)
  const glm::dvec3 a(0.3, -0.4, 0.5);
  const RadianceMap map =
      sampled_map(128, 1, [&](const glm::dvec3& w) { return Rgb(static_cast<float>(1.0 + glm::dot(a, w))); });
  for (const PrefilterMethod method : kMethods) {
    const RadianceMap e = blurred(map, 1.0, 32, method);
    const double bar = method == PrefilterMethod::mip_chain ? 0.03 : 2e-4; // the map's own quadrature: 1e-4
    for (std::size_t i = 0; i < e.radiance.size(); ++i)
      EXPECT_NEAR(e.radiance[i].g, 1.0 + 2.0 / 3.0 * glm::dot(a, e.direction(i)), bar);
  }
}

TEST(Prefilter, a_uniform_hemisphere_gives_the_view_factor_of_a_tilted_plane) {
  // E / pi = (1 + cos(tilt)) / 2 for the sky above the horizon
  const RadianceMap map = sampled_map(128, 1, [](const glm::dvec3& w) {
    return Rgb(w.z > 1e-9 ? 1.0f : w.z < -1e-9 ? 0.0f : 0.5f);
  });
  for (const PrefilterMethod method : {PrefilterMethod::exact, PrefilterMethod::harmonics}) {
    const RadianceMap e = blurred(map, 1.0, 64, method);
    for (std::size_t i = 0; i < e.radiance.size(); ++i)
      EXPECT_NEAR(e.radiance[i].r, 0.5 + 0.5 * e.direction(i).z, 1e-3); // the equator's texels are half lit
  }
}

TEST(Prefilter, the_exact_method_equals_the_plain_sum_within_its_tolerance_beside_a_sun) {
  const RadianceMap map = lit_room(128);
  for (const double exponent : {1.0, 1.7, 2.0, 10.0, 35.5, 80.0, 640.0, 5000.0})
    for (const double tolerance : {1e-5, 1e-3}) {
      const RadianceMap exact = blurred(map, exponent, 128, PrefilterMethod::exact, tolerance);
      EXPECT_LT(largest_error(map, exponent, exact, 101), tolerance) << exponent;
    }
}

TEST(Prefilter, the_exact_method_serves_maps_of_any_side_from_any_other) {
  for (const int from : {4, 8, 64})
    for (const int to : {4, 16, 128}) {
      const RadianceMap map = lit_room(from);
      EXPECT_LT(largest_error(map, 12.0, blurred(map, 12.0, to, PrefilterMethod::exact), 7), 1e-5) << from << ' ' << to;
    }
}

TEST(Prefilter, harmonics_meet_their_mean_tolerance_beside_a_sun) {
  const RadianceMap map = lit_room(128);
  for (const double exponent : {2.0, 10.0, 80.0, 640.0}) {
    const RadianceMap h = blurred(map, exponent, 128, PrefilterMethod::harmonics, 1e-3);
    const RadianceMap exact = blurred(map, exponent, 128, PrefilterMethod::exact);
    double sum = 0.0;
    for (std::size_t i = 0; i < h.radiance.size(); ++i)
      sum += static_cast<double>(std::abs(h.radiance[i].g / exact.radiance[i].g - 1.0f));
    EXPECT_LT(sum / static_cast<double>(h.radiance.size()), 1e-3) << exponent;
  }
}

TEST(Prefilter, the_mip_chain_is_right_in_the_mean_of_a_room) {
  const RadianceMap map = sampled_map(128, 1, [](const glm::dvec3& w) {
    return Rgb(w.x > 0.6 && std::abs(w.z) < 0.5 ? 20.0f : static_cast<float>(1.0 + 0.5 * w.z));
  });
  for (const double exponent : {1.0, 10.0, 80.0, 640.0}) {
    const RadianceMap mip = blurred(map, exponent, 128, PrefilterMethod::mip_chain);
    const RadianceMap exact = blurred(map, exponent, 128, PrefilterMethod::exact);
    double sum = 0.0;
    for (std::size_t i = 0; i < mip.radiance.size(); ++i)
      sum += static_cast<double>(std::abs(mip.radiance[i].g / exact.radiance[i].g - 1.0f));
    EXPECT_LT(sum / static_cast<double>(mip.radiance.size()), 0.03) << exponent;
  }
}

TEST(Prefilter, nothing_is_negative_or_not_finite_beside_a_sun) {
  const RadianceMap map = lit_room(64);
  for (const PrefilterMethod method : kMethods)
    for (const double exponent : {1.0, 300.0, 1e5})
      for (const Rgb& c : blurred(map, exponent, 64, method).radiance)
        for (int k = 0; k < 3; ++k)
          EXPECT_TRUE(std::isfinite(c[k]) && c[k] >= 0.0f);
}

TEST(Prefilter, a_black_map_stays_black) {
  for (const PrefilterMethod method : kMethods)
    for (const Rgb& c : blurred(RadianceMap(32), 20.0, 32, method).radiance)
      EXPECT_EQ(c, Rgb(0.0f));
}

TEST(Prefilter, results_have_the_same_bits_for_any_number_of_threads) {
  const RadianceMap map = lit_room(64);
  const Lobe lobes[] = {{1.0, 64}, {30.0, 64}, {500.0, 32}};
  for (const PrefilterMethod method : kMethods) {
    const auto many = prefilter(map, lobes, method);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto single = prefilter(map, lobes, method);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ((*many)[k].radiance, (*single)[k].radiance);
  }
}

TEST(Prefilter, every_texel_is_handed_out_once) {
  const RadianceMap map = lit_room(64);
  const Lobe lobes[] = {{1.0, 32}, {300.0, 64}};
  for (const PrefilterMethod method : kMethods) {
    std::vector<std::atomic<int>> seen[2] = {std::vector<std::atomic<int>>(32 * 32),
                                             std::vector<std::atomic<int>>(64 * 64)};
    ASSERT_TRUE(prefilter(map, lobes, method, {1e-4, {}, [&](const MapTile& tile, const RadianceMap&) {
                                                 for (const std::uint32_t t : tile.texels)
                                                   ++seen[tile.lobe][t];
                                               }}));
    for (const auto& lobe : seen)
      EXPECT_TRUE(std::all_of(lobe.begin(), lobe.end(), [](const auto& n) { return n == 1; }));
  }
}

TEST(Prefilter, a_stop_request_ends_it_with_an_error) {
  const RadianceMap map = lit_room(64);
  const Lobe lobe{2.0, 64};
  for (const PrefilterMethod method : kMethods) {
    std::stop_source stop;
    std::atomic<int> tiles{0};
    const auto maps =
        prefilter(map, std::span(&lobe, 1), method, {1e-5, stop.get_token(), [&](const MapTile&, const RadianceMap&) {
                                                       ++tiles;
                                                       stop.request_stop();
                                                     }});
    ASSERT_FALSE(maps);
    EXPECT_EQ(maps.error().code, ErrorCode::interrupted);
    EXPECT_LT(tiles, 40); // of 64 or 256: each thread ends the tile it is at
  }
}

TEST(Prefilter, bad_input_is_refused) {
  const RadianceMap map(16, Rgb(1.0f));
  const auto refused = [&](const RadianceMap& m, Lobe lobe, double tolerance) {
    return !prefilter(m, std::span(&lobe, 1), PrefilterMethod::exact, {tolerance, {}, {}});
  };
  EXPECT_TRUE(refused(map, {0.5, 16}, 1e-5));
  EXPECT_TRUE(refused(map, {std::numeric_limits<double>::quiet_NaN(), 16}, 1e-5));
  EXPECT_TRUE(refused(map, {1e9, 16}, 1e-5));
  EXPECT_TRUE(refused(map, {2.0, 17}, 1e-5));
  EXPECT_TRUE(refused(map, {2.0, 1 << 20}, 1e-5));
  EXPECT_TRUE(refused(map, {2.0, 16}, 0.0));
  EXPECT_TRUE(refused(RadianceMap(16, Rgb(-1.0f)), {2.0, 16}, 1e-5));
  EXPECT_FALSE(refused(map, {2.0, 16}, 1e-5));
  EXPECT_TRUE(prefilter(map, {}, PrefilterMethod::harmonics)->empty());
}

TEST(ProgressiveMaps, the_approximation_is_there_at_once_and_the_exact_map_in_the_end) {
  const RadianceMap map = lit_room(64);
  const std::vector<Lobe> lobes{{5.0, 32}, {200.0, 64}};
  ProgressiveMaps progressive;
  ASSERT_TRUE(progressive.start(map, lobes));
  EXPECT_EQ(progressive.snapshot().maps.size(), 2u);
  EXPECT_GT(progressive.snapshot().maps[1].radiance[0].r, 0.0f);
  progressive.wait();
  const auto last = progressive.snapshot();
  EXPECT_TRUE(last.finished);
  EXPECT_EQ(last.exact_texels, std::size_t(32 * 32 + 64 * 64));
  const auto exact = prefilter(map, lobes, PrefilterMethod::exact);
  EXPECT_EQ(last.maps[1].radiance, (*exact)[1].radiance);
}

TEST(ProgressiveMaps, a_new_source_cancels_the_old_one) {
  ProgressiveMaps progressive;
  ASSERT_TRUE(progressive.start(lit_room(256), {{1.0, 256}, {10.0, 256}, {40.0, 256}}));
  ASSERT_TRUE(progressive.start(RadianceMap(16, Rgb(2.0f)), {{10.0, 16}}));
  progressive.wait();
  const auto now = progressive.snapshot();
  EXPECT_TRUE(now.finished);
  EXPECT_NEAR(now.maps[0].radiance[3].r, 2.0f, 1e-5f);
  ASSERT_FALSE(progressive.start(RadianceMap(3), {}));
  EXPECT_EQ(progressive.snapshot().maps.size(), 1u);
}

} // namespace
} // namespace daylit
