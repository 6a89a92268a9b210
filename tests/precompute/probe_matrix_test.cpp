#include "precompute/probe_matrix.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "scene/room/aperture.h"
#include "scene/sky/direct_sky.h"
#include "tests/scene/parse_matrix.h"
#include "tests/scene/test_volumes.h"

namespace daylit::precompute {
namespace {

const Progress kQuiet = [](const std::string&, double) { return true; };

struct Case {
  BasisVolume volume;
  RayScene scene;
  LightFieldSampler sampler;
  std::vector<ProbePoint> points;

  static Case make(const std::string& partition_name) {
    const SkyPartition partition = *SkyPartition::parse(partition_name);
    BasisVolume volume = test::grid_volume(test::room_with_hole().room, {3, 4, 3}, partition.size());
    volume.partition = partition;
    RayScene scene = *RayScene::build(volume.room);
    volume.apertures = find_apertures(volume.room, scene)->list;
    LightFieldSampler sampler = *LightFieldSampler::make(volume);
    Case c{std::move(volume), std::move(scene), std::move(sampler), {}};
    for (int i = 0; i < 12; ++i) {
      const double a = 0.7 * i;
      c.points.push_back(
          {{0.5 + 0.25 * i, 0.6 + 0.33 * i, 0.4 + 0.17 * i}, {std::cos(a), std::sin(a) * 0.6, std::sin(a) * 0.8}});
    }
    return c;
  }
  Result<RadianceMatrix> matrix(const ReinhartPatches& patches, MatrixContent content) const {
    return daylight_matrix(volume, sampler, scene, points, patches, content, kQuiet);
  }
};

std::vector<Rgb> sky_vector(const ReinhartPatches& patches) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> ten(0.0f, 10.0f);
  std::vector<Rgb> s;
  for (int p = 0; p < patches.size(); ++p)
    s.emplace_back(ten(random), ten(random), ten(random));
  return s;
}

/// Row times vector, in double: what dctimestep computes.
glm::dvec3 product(const RadianceMatrix& m, int row, const std::vector<Rgb>& s) {
  glm::dvec3 sum(0.0);
  for (int p = 0; p < m.columns; ++p)
    sum += glm::dvec3(m.at(row, p)) * glm::dvec3(s[static_cast<std::size_t>(p)]);
  return sum;
}

/// The regions of a tregenza volume have the radiances of the patches above and of the ground below.
std::vector<Rgb> tregenza_regions(const SkyPartition& partition, const ReinhartPatches& patches,
                                  const std::vector<Rgb>& s) {
  std::vector<Rgb> radiance;
  for (int r = 0; r < partition.size(); ++r)
    radiance.push_back(s[static_cast<std::size_t>(patches.patch_of(partition.centre(r)))]);
  return radiance;
}

TEST(DaylightMatrix, times_a_sky_vector_is_our_combination) {
  const Case c = Case::make("tregenza");
  const ReinhartPatches patches = *ReinhartPatches::make(1);
  const std::vector<Rgb> s = sky_vector(patches);
  const LightField field = combine(c.volume, tregenza_regions(c.volume.partition, patches, s));
  const auto written = c.matrix(patches, {});
  ASSERT_TRUE(written) << written.error().message();
  for (const MatrixFormat format : {MatrixFormat::ascii, MatrixFormat::float32, MatrixFormat::float64}) {
    const auto m = test::parse_matrix(matrix_text(*written, format, "test"), "test.mtx");
    ASSERT_TRUE(m) << m.error().message();
    double largest = 0.0, error = 0.0;
    for (std::size_t i = 0; i < c.points.size(); ++i) {
      const glm::dvec3 ours(irradiance(*c.sampler.sample(field, c.points[i].position), glm::vec3(c.points[i].normal)));
      const glm::dvec3 d = product(*m, static_cast<int>(i), s) - ours;
      largest = std::max(largest, glm::length(ours));
      error = std::max(error, glm::length(d));
    }
    EXPECT_LE(error, 1e-6 * largest);
  }
}

TEST(DaylightMatrix, of_coefficients_has_nine_rows_per_point) {
  const Case c = Case::make("tregenza");
  const ReinhartPatches patches = *ReinhartPatches::make(1);
  const std::vector<Rgb> s = sky_vector(patches);
  const LightField field = combine(c.volume, tregenza_regions(c.volume.partition, patches, s));
  const auto m = c.matrix(patches, {.coefficients = true});
  ASSERT_TRUE(m) << m.error().message();
  ASSERT_EQ(m->rows, 9 * static_cast<int>(c.points.size()));
  for (std::size_t i = 0; i < c.points.size(); ++i) {
    const Sh9Rgb ours = *c.sampler.sample(field, c.points[i].position);
    for (std::size_t k = 0; k < 9; ++k)
      EXPECT_NEAR(product(*m, static_cast<int>(9 * i + k), s).g, static_cast<double>(ours[k].g), 2e-3) << i << " " << k;
  }
}

// A volume of nodes under the uniform sky, where no border matters.
TEST(DaylightMatrix, of_nodes_sums_to_the_uniform_sky) {
  const Case c = Case::make("fine:256");
  const ReinhartPatches patches = *ReinhartPatches::make(2);
  std::vector<Rgb> uniform;
  for (int r = 0; r < c.volume.partition.size(); ++r)
    uniform.emplace_back(static_cast<float>(c.volume.partition.hat_sr(r) / c.volume.partition.solid_angle_sr(r)));
  const LightField field = combine(c.volume, uniform);
  const auto m = c.matrix(patches, {});
  ASSERT_TRUE(m) << m.error().message();
  const std::vector<Rgb> ones(static_cast<std::size_t>(patches.size()), Rgb(1.0f));
  for (std::size_t i = 0; i < c.points.size(); ++i) {
    const Rgb ours = irradiance(*c.sampler.sample(field, c.points[i].position), glm::vec3(c.points[i].normal));
    EXPECT_NEAR(product(*m, static_cast<int>(i), ones).g, static_cast<double>(ours.g), 1e-3);
  }
}

TEST(DaylightMatrix, total_adds_the_light_through_the_windows) {
  const Case c = Case::make("tregenza");
  const ReinhartPatches patches = *ReinhartPatches::make(4);
  const auto indirect = c.matrix(patches, {}), total = c.matrix(patches, {.total = true});
  ASSERT_TRUE(indirect && total);
  SkyModel model;
  model.kind = SkyModel::Kind::uniform;
  model.ground_albedo = -1.0f;
  model.ground_radiance = Rgb(1.0f);
  const Sky sky(model);
  const DirectSky direct(c.volume.room, c.volume.apertures, c.scene, sky);
  const std::vector<Rgb> ones(static_cast<std::size_t>(patches.size()), Rgb(1.0f));
  for (std::size_t i = 0; i < c.points.size(); ++i) {
    const double added = product(*total, static_cast<int>(i), ones).g - product(*indirect, static_cast<int>(i), ones).g;
    EXPECT_NEAR(added, static_cast<double>(direct.irradiance(c.points[i].position, c.points[i].normal).g), 1e-4);
  }
}

TEST(DaylightMatrix, points_without_light_are_refused_with_their_line) {
  Case c = Case::make("tregenza");
  c.points.insert(c.points.begin() + 2, ProbePoint{{9, 9, 9}, {0, 0, 1}});
  const auto m = c.matrix(*ReinhartPatches::make(1), {});
  ASSERT_FALSE(m);
  EXPECT_NE(m.error().message().find("line 3"), std::string::npos) << m.error().message();
  c.points.clear();
  EXPECT_FALSE(c.matrix(*ReinhartPatches::make(1), {}));
}

} // namespace
} // namespace daylit::precompute
