// Patches cut into elements: nothing is lost, and from afar a patch counts as one.

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "bench/room_parts.h"
#include "precompute/detail/light_elements.h"
#include "precompute/detail/transport_problem.h"
#include "radiosity/gather.h"
#include "scene/room/room_formats.h"

namespace daylit::precompute::detail {
namespace {

const Progress kQuiet = [](const std::string&, double) { return true; };

struct Cut {
  Problem problem;
  LightElements elements;
};

Cut cut_room(const Room& room, std::size_t count) {
  BakeOptions options;
  options.target_facets = 400;
  options.spacing_m = 1.0;
  BakeReport report;
  StageClock clock(report);
  Cut cut{*set_up(room, options, report, clock), {}};
  cut.elements = *LightElements::make(cut.problem.mesh, cut.problem.patches, cut.problem.apertures.list,
                                      cut.problem.room_scene, cut.problem.field, count);
  return cut;
}

Cut cut_room(std::size_t count) {
  const auto room = read_room(DAYLIT_SOURCE_DIR "/tests/fixtures/truth/s1_daylit_cornell.obj");
  EXPECT_TRUE(room) << room.error().message();
  return cut_room(room->room, count);
}

TEST(LightElements, cover_their_patches_once) {
  const Cut cut = cut_room(1200);
  const auto& patches = cut.problem.patches.patches;
  EXPECT_NEAR(static_cast<double>(cut.elements.mesh.facets.size()), 1200, 4);
  std::vector<double> area(patches.size(), 0.0), share(patches.size(), 0.0);
  for (std::size_t i = 0; i < cut.elements.parent.size(); ++i) {
    const radiosity::Patch& element = cut.elements.patches.patches[i];
    area[cut.elements.parent[i]] += element.area_m2;
    share[cut.elements.parent[i]] += static_cast<double>(cut.elements.fraction[i]);
    EXPECT_EQ(element.normal, patches[cut.elements.parent[i]].normal);
    EXPECT_TRUE(i == 0 || cut.elements.parent[i] - cut.elements.parent[i - 1] <= 1);
  }
  for (std::size_t e = 0; e < patches.size(); ++e) {
    EXPECT_NEAR(area[e], patches[e].area_m2, 1e-9);
    EXPECT_NEAR(share[e], 1.0, 1e-5);
  }
}

TEST(LightElements, are_smaller_where_an_aperture_is_in_sight) {
  Room room = bench::room_with_window_hole(0.5f);
  bench::add_quad(room, {0, 2.5, 0}, {3.8, 2.5, 0}, {3.8, 2.5, 2.8}, {0, 2.5, 2.8}); // a wall, a passage in the east
  const Cut cut = cut_room(room, 1600);
  const double origin_y = cut.problem.mesh.origin.y;
  double area_m2[2] = {}, count[2] = {}; // of the floor, behind the wall and before it
  for (const radiosity::Patch& element : cut.elements.patches.patches) {
    const glm::dvec3 middle = (element.corner[0] + element.corner[1] + element.corner[2]) / 3.0;
    const bool before = middle.y + origin_y < 2.5;
    if (element.normal.z < 0.9 || (!before && middle.x + cut.problem.mesh.origin.x > 2.0))
      continue; // through the passage some of the window is seen
    area_m2[before] += element.area_m2;
    ++count[before];
  }
  ASSERT_GT(count[0], 5);
  EXPECT_LT(area_m2[1] / count[1], 0.5 * area_m2[0] / count[0]);
}

/// A pane 2 m wide that begins at the floor.
TEST(LightElements, are_smaller_on_a_floor_beside_a_pane) {
  Room room;
  room.materials.emplace_back();
  room.materials.back().reflectance = Rgb(0.5f);
  bench::add_box(room, {0, 0, 0}, {4, 4, 3}, 0b111011u, true);
  bench::add_quad(room, {0, 0, 0}, {1, 0, 0}, {1, 0, 3}, {0, 0, 3});
  bench::add_quad(room, {3, 0, 0}, {4, 0, 0}, {4, 0, 3}, {3, 0, 3});
  bench::add_quad(room, {1, 0, 2.5}, {3, 0, 2.5}, {3, 0, 3}, {1, 0, 3});
  const Cut cut = cut_room(room, 1600);
  double area_m2[2] = {}, count[2] = {}; // of the floor before the pane, further away and beside it
  for (const radiosity::Patch& element : cut.elements.patches.patches) {
    const glm::dvec3 at = cut.problem.mesh.origin + (element.corner[0] + element.corner[1] + element.corner[2]) / 3.0;
    if (element.normal.z < 0.9 || at.x < 1 || at.x > 3 || at.y > 1.5)
      continue;
    area_m2[at.y < 0.25] += element.area_m2;
    ++count[at.y < 0.25];
  }
  ASSERT_GT(count[0], 5);
  EXPECT_LT(area_m2[1] / count[1], 0.4 * area_m2[0] / count[0]);
}

/// A skylight above the middle of the floor, which has more of its light than the floor along the walls.
TEST(LightElements, are_smaller_on_a_floor_beside_a_wall) {
  Room room;
  room.materials.emplace_back();
  room.materials.back().reflectance = Rgb(0.5f);
  bench::add_box(room, {0, 0, 0}, {4, 4, 3}, 0b111101u, true);
  bench::add_quad(room, {0, 0, 3}, {4, 0, 3}, {4, 1.5, 3}, {0, 1.5, 3});
  bench::add_quad(room, {0, 2.5, 3}, {4, 2.5, 3}, {4, 4, 3}, {0, 4, 3});
  bench::add_quad(room, {0, 1.5, 3}, {1.5, 1.5, 3}, {1.5, 2.5, 3}, {0, 2.5, 3});
  bench::add_quad(room, {2.5, 1.5, 3}, {4, 1.5, 3}, {4, 2.5, 3}, {2.5, 2.5, 3});
  const Cut cut = cut_room(room, 1600);
  double area_m2[2] = {}, count[2] = {}; // of the floor in the middle, and along the walls
  for (const radiosity::Patch& element : cut.elements.patches.patches) {
    const glm::dvec3 at = cut.problem.mesh.origin + (element.corner[0] + element.corner[1] + element.corner[2]) / 3.0;
    const double wall_m = std::min({at.x, 4.0 - at.x, at.y, 4.0 - at.y});
    if (element.normal.z < 0.9 || (wall_m > 0.25 && wall_m < 1.2))
      continue;
    area_m2[wall_m <= 0.25] += element.area_m2;
    ++count[wall_m <= 0.25];
  }
  ASSERT_GT(count[0], 5);
  EXPECT_LT(area_m2[1] / count[1], 0.8 * area_m2[0] / count[0]);
}

TEST(LightElements, are_the_patches_where_none_are_asked_for) {
  const Cut cut = cut_room(0);
  ASSERT_EQ(cut.elements.patches.patches.size(), cut.problem.patches.patches.size());
  for (std::size_t e = 0; e < cut.elements.parent.size(); ++e)
    EXPECT_EQ(cut.elements.patches.patches[e].corner, cut.problem.patches.patches[e].corner);
}

TEST(LightElements, far_ones_are_weighed_by_their_areas_and_near_ones_by_their_rays) {
  const Cut cut = cut_room(1200);
  const std::vector<glm::dvec3> points{{0.3, 0.2, -1.2}};
  const auto hits = [&](std::span<const std::uint32_t> group) {
    return *radiosity::gather_hits(points, cut.elements.patches, cut.elements.mesh, cut.elements.rays,
                                   {.rays = 2048, .group = group}, kQuiet);
  };
  const radiosity::GatherHits plain = hits({}), grouped = hits(cut.elements.parent);
  const std::size_t elements = cut.elements.parent.size();
  std::vector<float> by_rays(9 * elements), shared(9 * elements);
  plain.weights(0, by_rays.data());
  grouped.weights(0, shared.data());
  std::vector<std::uint8_t> distinguished(cut.problem.patches.patches.size(), 0);
  grouped.mark_distinguished(0, distinguished);
  EXPECT_GT(std::accumulate(distinguished.begin(), distinguished.end(), 0), 10);
  EXPECT_LT(std::accumulate(distinguished.begin(), distinguished.end(), 0), static_cast<int>(distinguished.size()) / 2);
  std::vector<double> of_patch(distinguished.size(), 0.0);
  for (std::size_t i = 0; i < elements; ++i)
    of_patch[cut.elements.parent[i]] += static_cast<double>(by_rays[i]);
  // Of a patch that is told apart, each quarter (of two elements, each) has what its rays bring.
  int joined = 0;
  for (std::size_t first = 0, end = 0; first < elements; first = end) {
    const std::uint32_t parent = cut.elements.parent[first];
    while (end < elements && cut.elements.parent[end] == parent)
      ++end;
    const std::size_t run = distinguished[parent] != 0 ? std::max<std::size_t>(1, (end - first) / 4) : end - first;
    for (std::size_t i = first; i < end; i += run) {
      double rays = 0, kept = 0;
      for (std::size_t k = i; k < i + run; ++k) {
        rays += static_cast<double>(by_rays[k]);
        kept += static_cast<double>(shared[k]);
        joined += std::abs(shared[k] - by_rays[k]) > 1e-6f && distinguished[parent] != 0;
      }
      EXPECT_NEAR(kept, rays, 1e-5);
    }
    const std::size_t half = std::max<std::size_t>(1, (end - first) / 2);
    for (std::size_t i = first; i < end && distinguished[parent] == 0; ++i) {
      const auto per_area = [&](std::size_t k) { return static_cast<double>(shared[k] / cut.elements.fraction[k]); };
      EXPECT_NEAR(per_area(i), per_area(i < first + half ? first : first + half), 1e-5);
    }
  }
  EXPECT_GT(joined, 10) << "elements too small for their rays";
  // Weights of parts are sums of those of their elements.
  std::vector<std::uint32_t> end;
  for (std::size_t i = 0; i < elements; ++i)
    if (i + 1 == elements || cut.elements.parent[i + 1] != cut.elements.parent[i])
      end.push_back(static_cast<std::uint32_t>(i + 1));
  std::vector<float> parts(9 * end.size());
  grouped.weights(0, end, parts.data());
  for (std::size_t e = 0; e < end.size(); ++e)
    EXPECT_NEAR(static_cast<double>(parts[e]), of_patch[e], 1e-5);
}

TEST(LightElements, of_a_patch_close_below_one_of_its_ends_count_by_themselves) {
  const Cut cut = cut_room(1200);
  const auto& elements = cut.elements.patches.patches;
  std::vector<glm::dvec3> points;
  std::vector<std::uint32_t> patch;
  for (std::uint32_t e = 0; e < elements.size(); ++e)
    if (const radiosity::Patch& whole = cut.problem.patches.patches[cut.elements.parent[e]];
        elements[e].normal.z > 0.9 && 8.0 * elements[e].area_m2 < whole.area_m2 * 1.01 &&
        glm::distance(elements[e].middle(), whole.middle()) > 0.45 * std::sqrt(whole.area_m2)) {
      points.push_back(elements[e].middle() + glm::dvec3(0.0, 0.0, 0.02));
      patch.push_back(cut.elements.parent[e]);
    }
  ASSERT_GT(points.size(), 20u);
  const auto hits = radiosity::gather_hits(points, cut.elements.patches, cut.elements.mesh, cut.elements.rays,
                                           {.rays = 2048, .group = cut.elements.parent}, kQuiet);
  ASSERT_TRUE(hits);
  for (std::size_t p = 0; p < points.size(); ++p) {
    std::vector<std::uint8_t> distinguished(cut.problem.patches.patches.size(), 0);
    hits->mark_distinguished(p, distinguished);
    EXPECT_EQ(distinguished[patch[p]], 1) << p;
  }
}

double further_at(const Cut& cut, std::size_t element, const std::vector<double>& of_patch) {
  double sum = 0;
  for (const LinearLight::Share& s : cut.elements.further.of(element))
    sum += static_cast<double>(s.weight) * of_patch[s.patch];
  return sum;
}

TEST(LinearLight, has_the_patches_means_and_follows_an_even_slope) {
  const Cut cut = cut_room(1200);
  const auto& patches = cut.problem.patches.patches;
  const auto& elements = cut.elements.patches.patches;
  const auto slope = [](const glm::dvec3& x) { return 2.0 + x.x + 3.0 * x.y - 2.0 * x.z; };
  std::vector<double> even(patches.size()), uneven(patches.size()), mean(patches.size(), 0.0);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    even[p] = slope(patches[p].middle());
    uneven[p] = static_cast<double>(p * 7919 % 31);
  }
  std::size_t sloped = 0;
  for (std::size_t e = 0; e < elements.size(); ++e) {
    mean[cut.elements.parent[e]] += static_cast<double>(cut.elements.fraction[e]) * further_at(cut, e, uneven);
    if (cut.elements.further.of(e).size() > 1) {
      ++sloped;
      EXPECT_NEAR(further_at(cut, e, even), slope(elements[e].middle()), 1e-4);
    }
  }
  EXPECT_GT(sloped, 400u);
  for (std::size_t p = 0; p < patches.size(); ++p)
    EXPECT_NEAR(mean[p], uneven[p], 1e-4);
}

TEST(LinearLight, ends_at_a_wall_that_stands_on_the_surface) {
  Room room = bench::room_with_window_hole(0.5f);
  bench::add_quad(room, {0, 2.5, 0}, {3.8, 2.5, 0}, {3.8, 2.5, 2.8}, {0, 2.5, 2.8});
  const Cut cut = cut_room(room, 3000);
  const auto side = [&](const radiosity::Patch& p) { return (cut.problem.mesh.origin + p.middle()).y < 2.5; };
  std::size_t shares = 0;
  for (std::size_t e = 0; e < cut.elements.parent.size(); ++e) {
    const radiosity::Patch& own = cut.problem.patches.patches[cut.elements.parent[e]];
    if (own.normal.z < 0.9 || (cut.problem.mesh.origin + own.middle()).x > 3.3)
      continue;
    for (const LinearLight::Share& s : cut.elements.further.of(e)) {
      ++shares;
      EXPECT_EQ(side(own), side(cut.problem.patches.patches[s.patch]));
    }
  }
  EXPECT_GT(shares, 100u);
}

} // namespace
} // namespace daylit::precompute::detail
