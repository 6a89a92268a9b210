// The adaptive sampling grid over a floor whose visibility is a formula, and the arithmetic on sixteen lanes against
// its scalar twins.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <glm/geometric.hpp>

#include "runtime/shading/lane_kernels.h"
#include "runtime/shading/sampling_grid.h"
#include "scene/room/aperture.h"
#include "torus_scene.h"

namespace daylit {
namespace {

constexpr int kSide = SamplingGrid::kBlockSide, kColumns = 24, kRows = 20;
constexpr float kPixel_m = 0.01f;

/// A floor seen from above, one pixel per centimetre; `fraction` gives what of the sky is left at a position.
class Floor final : public Visibility {
public:
  /// `open`: past the room alone.
  explicit Floor(
      std::function<Rgb(const glm::vec3&)> fraction,
      std::function<float(const glm::vec3&)> open = [](const glm::vec3&) { return 1.0f; })
      : fraction_(std::move(fraction)), open_(std::move(open)) {}
  mutable std::atomic<int> evaluated{0};

  PixelSurface surface(Layer layer, int x, int y, bool) const override {
    if (layer == Layer::object)
      return {};
    const glm::vec3 p = position(x, y);
    return {true, true, p, {0.0f, 0.0f, 1.0f}, p, false};
  }
  std::uint64_t see_sky(Layer, PointSet& set) const override {
    set.blocked = {};
    set.blocked.verdicts.resize(3);
    for (int k = 0; k < kLanes; ++k)
      if (set.points.lanes >> k & 1u) {
        const glm::vec3 p(set.points.x[k], set.points.y[k], set.points.z[k]);
        set.sky[k] = {Rgb(open_(p)), fraction_(p)};
        ++evaluated;
      }
    return 0;
  }
  std::uint64_t see_sun(Layer, const PixelSurface&, std::span<KnownLights>, std::span<KnownLights>) const override {
    return 0;
  }
  static glm::vec3 position(int x, int y) {
    return {kPixel_m * static_cast<float>(x), kPixel_m * static_cast<float>(y), 0.0f};
  }
  Rgb fraction(int x, int y) const { return fraction_(position(x, y)); }

private:
  std::function<Rgb(const glm::vec3&)> fraction_;
  std::function<float(const glm::vec3&)> open_;
};

SampledPicture picture(float radius_px) {
  SampledPicture p;
  p.columns = kColumns;
  p.rows = kRows;
  p.box = {0, 0, kColumns * kSide, kRows * kSide};
  p.radius = 0.2f;
  p.radius_px = radius_px;
  p.sky_lights = 3;
  return p;
}

SamplingGrid::Interpolated at(const SamplingGrid& grid, int x, int y) {
  return grid.interpolate(Layer::room, x, y, Floor::position(x, y), {0.0f, 0.0f, 1.0f});
}

TEST(SamplingGrid, a_smooth_light_is_evaluated_at_coarse_points_and_interpolated_between) {
  // A ramp is interpolated exactly.
  const Floor floor([](const glm::vec3& p) { return Rgb(0.9f - 0.01f * p.x, 0.9f - 0.02f * p.y, 0.9f); },
                    [](const glm::vec3&) { return 0.9f; });
  SamplingGrid grid;
  grid.evaluate(floor, picture(100.0f));
  EXPECT_LT(floor.evaluated, kColumns * kRows / 4 + kColumns + kRows)
      << "one point in four, and those at the far sides";
  EXPECT_GE(floor.evaluated, kColumns * kRows / 4);
  for (int y = 0; y < (kRows - 1) * kSide; ++y)
    for (int x = 0; x < (kColumns - 1) * kSide; ++x) {
      const auto known = at(grid, x, y);
      ASSERT_TRUE(known.is_known && known.is_between) << x << ", " << y;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(known.sky.past_both[c], floor.fraction(x, y)[c], 1e-5f) << x << ", " << y;
    }
  const Floor again([](const glm::vec3&) { return Rgb(1.0f); });
  grid.evaluate(again, picture(50.0f));
  EXPECT_EQ(again.evaluated, kColumns * kRows) << "where the objects are small, every point";
  grid.evaluate(again, picture(20.0f));
  EXPECT_TRUE(grid.empty()) << "where they are tiny, none";
  const Floor shadow([](const glm::vec3&) { return Rgb(0.5f); });
  grid.evaluate(shadow, picture(100.0f));
  EXPECT_EQ(shadow.evaluated, kColumns * kRows) << "nor is anything interpolated coarsely in a shadow";
  grid.clear();
  EXPECT_FALSE(at(grid, 5, 5).is_known);
}

TEST(SamplingGrid, an_edge_in_any_one_channel_is_not_interpolated) {
  constexpr int kEdge = 42; // within the block of pixels 40 .. 43
  for (int channel = 0; channel < 3; ++channel) {
    const Floor floor([&](const glm::vec3& p) {
      Rgb f(1.0f);
      f[channel] = p.x < kPixel_m * static_cast<float>(kEdge) ? 1.0f : 0.5f;
      return f;
    });
    SamplingGrid grid;
    grid.evaluate(floor, picture(100.0f));
    for (int y = 0; y < (kRows - 1) * kSide; ++y)
      for (int x = 0; x < (kColumns - 1) * kSide; ++x) {
        const auto known = at(grid, x, y);
        const bool in_block = x / kSide == kEdge / kSide && x % kSide != 0;
        ASSERT_EQ(known.is_known, !in_block) << "channel " << channel << " at " << x << ", " << y;
        if (known.is_known) {
          ASSERT_NEAR(known.sky.past_both[channel], floor.fraction(x, y)[channel], 1e-6f);
        }
      }
    EXPECT_EQ(grid.plain_corners(kEdge / kSide, 3)[0], nullptr) << channel;
    EXPECT_NE(grid.plain_corners(kEdge / kSide + 1, 3)[0], nullptr) << channel;
  }
}

TEST(SamplingGrid, a_block_that_shows_the_outline_of_an_object_takes_nothing_of_the_room_from_its_corners) {
  const Floor floor([](const glm::vec3&) { return Rgb(0.8f); }, [](const glm::vec3&) { return 0.8f; });
  const std::array<glm::ivec2, 1> outline{{{42, 21}}};
  SampledPicture p = picture(100.0f);
  p.outline = outline;
  SamplingGrid grid;
  grid.evaluate(floor, p);
  EXPECT_FALSE(at(grid, 41, 22).is_known);
  EXPECT_TRUE(at(grid, 45, 22).is_known) << "the next block";
}

TEST(SamplingGrid, shadows_of_few_lights_are_joined_as_far_behind_the_objects_as_they_fall_apart) {
  // Stripes of 8 cm: what is in the shadow of the one light and not of the next.
  const auto stripes = [](const glm::vec3& p) {
    return Rgb(static_cast<int>(std::lround(100.0f * p.x)) / 8 % 2 ? 0.8f : 1.0f);
  };
  const Floor floor(stripes);
  const std::array<glm::ivec2, 1> outline{{{42, 41}}};
  SampledPicture p = picture(100.0f);
  p.outline = outline;
  p.light_spacing = 0.15f;
  p.low = p.high = {0.5f, 0.4f, 2.0f};
  SamplingGrid grid;
  grid.evaluate(floor, p);
  for (int y = 0; y < (kRows - 1) * kSide; ++y)
    for (int x = 16; x < (kColumns - 5) * kSide; ++x) {
      const auto known = at(grid, x, y);
      ASSERT_TRUE(known.is_known) << "where an object's outline shows before it, too: " << x << ", " << y;
      ASSERT_NEAR(known.sky.past_both.g, 0.9f, 0.02f) << x << ", " << y;
      ASSERT_EQ(known.sky.past_room.g, 1.0f);
    }
  p.low = {0.0f, 0.0f, 0.0f};
  p.high = {0.3f, 0.8f, 2.0f};
  grid.evaluate(floor, p);
  for (int x = 0; x < 28; x += kSide)
    EXPECT_EQ(at(grid, x, 20).sky.past_both, stripes(Floor::position(x, 20)))
        << "where they fall together nothing is changed";
}

TEST(SamplingGrid, beside_a_shadow_of_the_room_no_point_loses_more_than_it_has) {
  const auto open = [](const glm::vec3& p) { return p.x < 0.5f ? 1.0f : 0.1f; };
  const Floor floor([&](const glm::vec3& p) { return Rgb(p.x < 0.5f ? 0.5f : 0.1f); }, open);
  SampledPicture p = picture(100.0f);
  p.light_spacing = 0.15f;
  p.low = p.high = {0.5f, 0.4f, 2.0f};
  SamplingGrid grid;
  grid.evaluate(floor, p);
  for (int x = 0; x < (kColumns - 1) * kSide; x += kSide) {
    const SkyFractions sky = at(grid, x, 20).sky;
    EXPECT_EQ(sky.past_room.g, open(Floor::position(x, 20)));
    EXPECT_GT(sky.past_both.g, 0.0f) << x;
    EXPECT_LE(sky.past_both.g, sky.past_room.g) << x;
  }
}

TEST(SamplingGrid, a_shadow_far_behind_an_object_is_one_and_not_as_many_as_lights) {
  constexpr int kWide = 256, kHigh = 248;
  const auto lost = [](int samples, bool use_grid) {
    test::TorusScene scene;
    scene.samples = samples;
    scene.object = test::place(test::torus(0.15f, 0.07f, 160, 80), {1.7, 3.8, 1.3}, 1.2);
    scene.camera = test::look_at({2.7, 4.8, 1.5}, {1.6, 0.0, 0.9}, kWide, kHigh, 0.6);
    return *scene.trace(use_grid);
  };
  const RenderedFrame truth = lost(2048, false), each = lost(64, false), joined = lost(64, true);
  double of_each = 0.0, of_joined = 0.0, mean = 0.0;
  int count = 0;
  for (int y = 0; y < kHigh; ++y)
    for (int x = 0; x < kWide; ++x) {
      const DrawnPixel p = test::at(truth, x, y);
      if (p.object.w > 0.0f || p.lost_sky.y < 0.01f)
        continue;
      of_each += std::pow(static_cast<double>(test::at(each, x, y).lost_sky.y - p.lost_sky.y), 2);
      of_joined += std::pow(static_cast<double>(test::at(joined, x, y).lost_sky.y - p.lost_sky.y), 2);
      mean += static_cast<double>(p.lost_sky.y);
      ++count;
    }
  ASSERT_GT(count, 1000);
  mean /= count;
  EXPECT_GT(std::sqrt(of_each / count), 0.3 * mean) << "few lights";
  EXPECT_LT(std::sqrt(of_joined), 0.5 * std::sqrt(of_each));
}

/// Terraces 2 cm high, one block wide: all points of the grid face the same way.
class Terraces final : public Visibility {
public:
  PixelSurface surface(Layer layer, int x, int y, bool) const override {
    if (layer == Layer::room)
      return {};
    const glm::vec3 p = Floor::position(x, y) + glm::vec3(0.0f, 0.0f, 0.02f * static_cast<float>(x / kSide % 2));
    return {true, true, p, {0.0f, 0.0f, 1.0f}, p, false};
  }
  std::uint64_t see_sky(Layer, PointSet& set) const override {
    set.blocked = {};
    set.blocked.verdicts.resize(3);
    std::ranges::fill(set.sky, SkyFractions{});
    return 0;
  }
  std::uint64_t see_sun(Layer, const PixelSurface&, std::span<KnownLights>, std::span<KnownLights>) const override {
    return 0;
  }
};

TEST(SamplingGrid, nothing_is_interpolated_across_a_fold_between_points_that_face_the_same_way) {
  const Terraces terraces;
  SamplingGrid grid;
  grid.evaluate(terraces, picture(100.0f));
  const glm::vec3 up(0.0f, 0.0f, 1.0f);
  const int x = 4 * kSide + 2, y = 4 * kSide + 2;
  EXPECT_FALSE(grid.interpolate(Layer::object, x, y, Floor::position(x, y), up).is_known);
  EXPECT_TRUE(grid.interpolate(Layer::object, 4 * kSide, y, Floor::position(4 * kSide, y), up).is_known)
      << "on one step";
}

TEST(LightHints, two_neighbours_must_agree_and_none_may_differ) {
  const KnownLights both_clear{0b0011, 0b0100}, one_differs{0b0001, 0b0110}, silent{};
  const KnownLights* two[] = {&both_clear, &one_differs, &silent};
  LightHints hints;
  hints.reset(4);
  hints.believe_agreeing(5, two);
  EXPECT_EQ(hints.verdicts()[0].clear, 1u << 5) << "both say so";
  EXPECT_EQ(hints.verdicts()[1].clear | hints.verdicts()[1].blocked, 0u) << "they differ";
  EXPECT_EQ(hints.verdicts()[2].blocked, 1u << 5);
  EXPECT_EQ(hints.verdicts()[3].clear | hints.verdicts()[3].blocked, 0u) << "nobody knows";
  hints.reset(4);
  hints.believe_agreeing(5, std::span(two).first(1));
  EXPECT_EQ(hints.verdicts()[0].clear, 0u) << "one is not enough";
  hints.believe_corners(std::span(two).first(2));
  EXPECT_EQ(hints.verdicts()[0].clear, 0xFFFFu);
  EXPECT_EQ(hints.verdicts()[2].blocked, 0xFFFFu);
  hints.reset(4);
  hints.believe_corners(two);
  EXPECT_EQ(hints.verdicts()[0].clear, 0u) << "a corner that does not know is one that does not agree";
}

/// Sixteen points in the box room before all panes, their normals any way.
struct RandomPoints {
  std::mt19937 random{7};
  float uniform(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(random); }
  glm::vec3 direction() {
    return glm::normalize(glm::vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)) + glm::vec3(1e-4f));
  }
  PointBlock block() {
    PointBlock p;
    for (int k = 0; k < kLanes; ++k)
      p.set(k, {uniform(-2, 2), uniform(-2.5f, 2.35f), uniform(-1.4f, 1.4f)}, direction());
    p.close(kLanes);
    return p;
  }
};
glm::dvec3 point(const PointBlock& p, int k) { return {p.x[k], p.y[k], p.z[k]}; }
glm::dvec3 normal(const PointBlock& p, int k) { return {p.nx[k], p.ny[k], p.nz[k]}; }

TEST(PortalLights, clip_planes_agree_with_the_crossing_of_each_ray) {
  std::vector<Aperture> windows = test::box_window(Rgb(0.8f, 0.7f, 0.6f));
  windows.push_back({{{4, 1, 1}, {4, 3, 1}, {4, 2.5, 2}, {4, 1.2, 2.4}}, {-1, 0, 0}, Rgb(0.9f), 1.52f});
  windows.push_back({{{1, 4.9, 0.5}, {2, 4.9, 0.5}, {2, 4.9, 2.5}, {1, 4.9, 2.5}}, {0, -1, 0}, Rgb(0.5f)}); // in series
  const glm::dvec3 origin(2.0, 2.5, 1.4);
  RandomPoints random;
  std::vector<DirectionalLight> directions;
  for (int j = 0; j < 40; ++j)
    directions.push_back(
        {glm::normalize(glm::dvec3(random.uniform(-0.3f, 1), random.uniform(-0.2f, 1), 0.3)), Rgb(1.0f)});
  const PortalLights lights(directions, windows, origin);
  int lit = 0, differ = 0;
  for (int round = 0; round < 50; ++round) {
    const PointBlock p = random.block();
    for (std::size_t j = 0; j < lights.size(); ++j) {
      LaneRgb e;
      const LaneMask any = lights.received(j, p, e);
      for (int k = 0; k < kLanes; ++k) {
        int crossed = 0;
        const Rgb panes = aperture_transmittance(windows, origin + point(p, k), directions[j].direction,
                                                 std::numeric_limits<double>::infinity(), &crossed);
        const float cosine = static_cast<float>(std::max(glm::dot(normal(p, k), directions[j].direction), 0.0));
        const Rgb exact = crossed > 0 ? cosine * panes : Rgb(0.0f);
        lit += exact.g > 0.0f;
        bool same = (any >> k & 1u) == (exact.g > 0.0f);
        for (int c = 0; c < 3; ++c)
          same = same && std::fabs(e.channel[c][k] - exact[c]) < 1e-5f;
        differ += !same;
      }
    }
  }
  EXPECT_GT(lit, 1000);
  EXPECT_LE(differ, lit / 1000) << "rays that graze an edge may fall to either side";
}

TEST(LaneKernels, agree_with_one_lane_at_a_time) {
  RandomPoints random;
  int boxes = 0, spheres = 0;
  for (int round = 0; round < 300; ++round) {
    const PointBlock p = random.block();
    const glm::vec3 w = round % 10 == 0 ? glm::vec3(0.0f, 0.0f, 1.0f) : random.direction();
    const glm::vec3 low(-0.5f, -0.4f, -0.3f), high(0.6f, 0.5f, 0.4f);
    const LaneMask facing = lanes::facing(p, w), box = lanes::facing_through_box(p, w, low, high);
    DirectionBlock directions;
    for (int k = 0; k < kLanes; ++k) {
      const glm::vec3 d = random.direction();
      directions.x[k] = d.x;
      directions.y[k] = d.y;
      directions.z[k] = d.z;
    }
    const glm::vec3 n = random.direction(), to_centre(1.0f, -0.3f, 0.2f);
    const float radius = 0.5f;
    const lanes::FacedLights faced = lanes::faced_lights(directions, n, to_centre, radius);
    for (int k = 0; k < kLanes; ++k) {
      const bool faces = glm::dot(normal(p, k), glm::dvec3(w)) > 0.0;
      EXPECT_EQ(facing >> k & 1u, faces);
      double enter = 0.0, leave = 1e30;
      for (int a = 0; a < 3; ++a) {
        const double s = (static_cast<double>(low[a]) - point(p, k)[a]) / static_cast<double>(w[a]),
                     t = (static_cast<double>(high[a]) - point(p, k)[a]) / static_cast<double>(w[a]);
        enter = std::max(enter, std::min(s, t));
        leave = std::min(leave, std::max(s, t));
      }
      EXPECT_EQ(box >> k & 1u, faces && leave >= enter) << round << " " << k;
      boxes += faces && leave >= enter;
      const glm::vec3 d(directions.x[k], directions.y[k], directions.z[k]);
      const float along = glm::dot(d, to_centre);
      const bool meets = along > -radius && glm::length(to_centre - along * d) < radius;
      EXPECT_EQ(faced.facing >> k & 1u, glm::dot(n, d) > 0.0f);
      EXPECT_EQ(faced.through_sphere >> k & 1u, meets);
      spheres += meets;
    }
  }
  EXPECT_GT(boxes, 100);
  EXPECT_GT(spheres, 100);

  std::vector<LaneMask> masks;
  for (int j = 0; j < 50; ++j)
    masks.push_back(static_cast<LaneMask>(random.random()) & 0xFFFFu);
  std::uint64_t bits[kLanes];
  lanes::transpose(masks, bits);
  for (int k = 0; k < kLanes; ++k)
    for (std::size_t j = 0; j < 64; ++j)
      EXPECT_EQ(bits[k] >> j & 1u, j < masks.size() ? masks[j] >> k & 1u : 0u);

  lanes::LightSums sums;
  LaneRgb e;
  for (int k = 0; k < kLanes; ++k)
    e.channel[1][k] = 0.1f * static_cast<float>(k);
  lanes::add_light(sums, {1.0f, 2.0f, 3.0f}, e, 0x00F0u, 0x0FF0u);
  for (int k = 0; k < kLanes; ++k) {
    EXPECT_FLOAT_EQ(sums.unblocked.channel[1][k], 0.2f * static_cast<float>(k));
    EXPECT_FLOAT_EQ(sums.past_room.channel[1][k], k >= 4 && k < 8 ? 0.0f : 0.2f * static_cast<float>(k));
    EXPECT_FLOAT_EQ(sums.past_both.channel[1][k], k >= 4 && k < 12 ? 0.0f : 0.2f * static_cast<float>(k));
  }
}

} // namespace
} // namespace daylit
