// What a bake leaves out changes nothing, and its report says so.

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "precompute/room_frame.h"
#include "tests/radiosity/rooms.h"

namespace daylit::precompute {
namespace {

const Progress kSilent = [](const std::string&, double) { return true; };

/// Two rooms side by side without a door, each with its own hole to the south.
Room two_rooms() {
  Room both = testing::room_with_window_hole(0.6f);
  const Room other = testing::room_with_window_hole(0.6f);
  const auto first = static_cast<std::uint32_t>(both.vertices.size());
  for (const glm::dvec3& v : other.vertices)
    both.vertices.push_back(v + glm::dvec3(6, 0, 0));
  for (RoomTriangle t : other.triangles) {
    for (auto& v : t.vertex)
      v += first;
    both.triangles.push_back(t);
  }
  return both;
}

struct Baked {
  BasisVolume volume;
  BakeReport report;
  nlohmann::json json;
};

Baked bake_at(const std::vector<glm::dvec3>& points, const Room& room = two_rooms()) {
  BakeOptions options = *quality_options("draft");
  options.target_facets = 800;
  options.points = points;
  Baked b{.volume = {}, .report = {}, .json = {}};
  auto volume = bake_room({room, {}, ""}, *SkyPartition::parse("uniform:64"), options, kSilent, b.report);
  EXPECT_TRUE(volume);
  b.volume = std::move(*volume);
  b.json = nlohmann::json::parse(to_json(b.report));
  return b;
}

std::vector<float> values_at(const Baked& b, std::size_t probe) {
  std::vector<float> values;
  for (std::size_t r = 0; r < b.volume.stored_region.size(); ++r)
    for (std::size_t k = 0; k < 27; ++k)
      values.push_back(b.volume.basis[r * b.volume.row_floats() + probe * 27 + k]);
  return values;
}

std::size_t skipped(const Baked& b, const std::string& what) {
  for (const auto& s : b.json["skipped"])
    if (s["what"].get<std::string>().find(what) != std::string::npos) {
      EXPECT_EQ(s["bound"], 0);
      return s["count"];
    }
  ADD_FAILURE() << what;
  return 0;
}

TEST(Skips, a_room_without_a_given_point_is_left_out_and_the_light_in_the_other_stays) {
  const glm::dvec3 here(1.7, 2.2, 1.1), there(8.1, 2.2, 1.1);
  const Baked one = bake_at({here}), both = bake_at({here, there});
  EXPECT_GT(one.report.sides_without_path, one.report.patches * 9 / 10);
  EXPECT_EQ(both.report.sides_without_path, 0u);
  EXPECT_EQ(skipped(one, "way to any given point"), one.report.sides_without_path);
  EXPECT_NE(to_text(one.report).find("no way from them to any given point (bound 0)"), std::string::npos);
  ASSERT_EQ(one.volume.stored_region, both.volume.stored_region);
  const auto a = values_at(one, 0), b = values_at(both, 0);
  double difference = 0, size = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    difference += std::pow(static_cast<double>(a[k] - b[k]), 2);
    size += std::pow(static_cast<double>(b[k]), 2);
  }
  EXPECT_GT(size, 0.0);
  EXPECT_LT(std::sqrt(difference / size), 2e-2); // rays of other numbers
}

TEST(Skips, points_at_one_place_are_gathered_once_and_alike) {
  const glm::dvec3 a(1.7, 2.2, 1.1), b(2.4, 3.0, 0.6);
  const Baked once = bake_at({a, b}), often = bake_at({a, b, a, a});
  EXPECT_EQ(once.report.probes_repeated, 0u);
  EXPECT_EQ(often.report.probes_repeated, 2u);
  EXPECT_EQ(skipped(often, "position of another"), 2u);
  for (const std::size_t probe : {0u, 2u, 3u})
    EXPECT_EQ(values_at(often, probe), values_at(once, 0)) << probe;
  EXPECT_EQ(values_at(often, 1), values_at(once, 1));
}

TEST(Skips, the_report_counts_regions_dark_sides_black_pairs_and_equal_channels) {
  Room room = testing::room_with_window_hole(0.6f);
  room.materials.push_back({"black", Rgb(0.0f), Rgb(1.0f), false});
  testing::add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false, 1);
  testing::add_box(room, {2.6, 2.5, 0}, {3.1, 3.4, 1.7}, 0b111110u, false, 1);
  const Baked b = bake_at({{2.2, 3.2, 1.5}}, room);
  EXPECT_GT(skipped(b, "no opening shows"), 10u);
  EXPECT_GT(skipped(b, "no light reaches"), 100u);
  EXPECT_GT(skipped(b, "black surfaces"), 100u);
  EXPECT_EQ(skipped(b, "channels equal"), 2u);
}

} // namespace
} // namespace daylit::precompute
