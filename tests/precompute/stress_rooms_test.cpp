// The whole bake on rooms that break renderers. Everything ends, in numbers or in an error that says why.

#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "bench/stress_rooms.h"
#include "precompute/room_frame.h"
#include "scene/volume/volume_combiner.h"
#include "scene/volume/volume_file.h"
#include "tests/radiosity/rooms.h"
#include "tests/scene/gltf_builder.h"

namespace daylit::precompute {
namespace {

using bench::furnished_room;
using bench::moved;
using testing::add_box;
using testing::add_quad;
const Progress kSilent = [](const std::string&, double) { return true; };

BakeOptions small_bake() {
  BakeOptions options = *quality_options("draft");
  options.target_facets = 400;
  options.grid = glm::ivec3(4);
  return options;
}

Result<BasisVolume> run(const Room& room, const BakeOptions& options, BakeReport* report = nullptr) {
  BakeReport own;
  return bake_room({room, {}, ""}, *SkyPartition::parse("uniform:16"), options, kSilent, report ? *report : own);
}

/// [region][value], zero where no light comes from.
std::vector<float> dense(const BasisVolume& v) {
  std::vector<float> all(static_cast<std::size_t>(v.partition.size()) * v.row_floats(), 0.0f);
  for (std::size_t r = 0; r < v.stored_region.size(); ++r)
    std::copy_n(v.basis.begin() + static_cast<std::ptrdiff_t>(r * v.row_floats()), v.row_floats(),
                all.begin() + static_cast<std::ptrdiff_t>(v.stored_region[r] * v.row_floats()));
  return all;
}

/// Norm of the difference over the norm.
double difference(const BasisVolume& a, const BasisVolume& b) {
  EXPECT_EQ(a.probes.valid, b.probes.valid);
  const std::vector<float> p = dense(a), q = dense(b);
  double above = 0, below = 0;
  for (std::size_t i = 0; i < std::min(p.size(), q.size()); ++i) {
    const double x = static_cast<double>(p[i]), y = static_cast<double>(q[i]);
    above += (x - y) * (x - y);
    below += x * x;
  }
  return std::sqrt(above / below);
}

void expect_light(const BasisVolume& volume) {
  float largest = 0;
  for (const float x : volume.basis) {
    ASSERT_TRUE(std::isfinite(x));
    largest = std::max(largest, x);
  }
  EXPECT_GT(largest, 0.01f);
  EXPECT_LT(largest, 100.0f);
}

TEST(StressRooms, scale_and_place_change_the_light_by_less_than_1e_5) {
  const auto reference = run(furnished_room(), small_bake());
  ASSERT_TRUE(reference) << reference.error().message();
  expect_light(*reference);
  for (const double scale : {1e-3, 0.0254, 0.3048, 1e4}) {
    const auto scaled = run(moved(furnished_room(), scale, glm::dvec3(0.0)), small_bake());
    ASSERT_TRUE(scaled) << scaled.error().message();
    EXPECT_LT(difference(*reference, *scaled), 1e-5) << scale;
    EXPECT_NEAR(scaled->probes.spacing.x / reference->probes.spacing.x / scale, 1.0, 1e-6);
  }
  for (const glm::dvec3 shift : {glm::dvec3(1e6, 0, 0), glm::dvec3(-1e6, 777777.7, 1234.5)}) {
    const auto far = run(moved(furnished_room(), 1.0, shift), small_bake());
    ASSERT_TRUE(far) << far.error().message();
    EXPECT_LT(difference(*reference, *far), 1e-5) << shift.x;
    EXPECT_LT(glm::distance(far->probes.origin - shift, reference->probes.origin), 1e-6);
    EXPECT_LT(glm::distance(far->apertures[0].corners[0] - shift, reference->apertures[0].corners[0]), 1e-6);
  }
}

TEST(StressRooms, reversed_faces_give_the_same_light) {
  Room reversed = furnished_room();
  bench::reverse_half(reversed);
  BakeOptions fine = small_bake();
  fine.target_facets = 1500;
  const auto a = run(furnished_room(), fine), b = run(reversed, fine);
  ASSERT_TRUE(a && b);
  EXPECT_LT(difference(*a, *b), 0.1); // another mesh of the same room, regions seen through a small window
}

TEST(StressRooms, slivers_coincident_and_crossing_faces_change_little) {
  BakeOptions options = small_bake(); // at points: the shelf makes the room larger
  for (int i = 0; i < 27; ++i)
    options.points.emplace_back(0.7 + 1.3 * (i % 3), 0.8 + 1.6 * (i / 3 % 3), 1.3 + 0.5 * (i / 9));
  const auto clean = run(furnished_room(), options);
  Room room = furnished_room();
  bench::add_bad_faces(room);
  const auto dirty = run(room, options);
  ASSERT_TRUE(clean);
  ASSERT_TRUE(dirty) << dirty.error().message();
  expect_light(*dirty);
  EXPECT_LT(difference(*clean, *dirty), 0.2);
}

TEST(StressRooms, a_board_one_millimetre_thick_keeps_the_energy_balance) {
  Room room = furnished_room();
  add_box(room, {1.9, 3.0, 0}, {1.901, 4.5, 1.8}, 0b111110u, false);
  BakeReport report;
  const auto volume = run(room, small_bake(), &report);
  ASSERT_TRUE(volume) << volume.error().message();
  expect_light(*volume);
  EXPECT_LT(report.energy.imbalance, 1e-3);
}

TEST(StressRooms, a_second_skin_one_millimetre_outside_the_walls_keeps_the_energy_balance) {
  // Light also enters the gap, through a rim of 1 mm, and falls on the outside of the south wall.
  Room room = furnished_room();
  bench::add_outer_skin(room);
  BakeOptions options = *quality_options("normal");
  options.target_facets = 400;
  options.grid = glm::ivec3(4);
  BakeReport report;
  const auto volume = run(room, options, &report);
  ASSERT_TRUE(volume) << volume.error().message();
  expect_light(*volume);
  EXPECT_LT(report.solve.worst_residual, 1e-4);
  EXPECT_LT(report.energy.unclosed, 1e-4); // before the rows are closed
  EXPECT_LT(report.energy.imbalance, 1e-5);
  EXPECT_LT(report.closure.left, report.patches / 100); // in the corners of the gap
}

TEST(StressRooms, every_room_balances_its_energy_before_its_rows_are_closed) {
  BakeOptions options = *quality_options("normal");
  options.target_facets = 500;
  options.grid = glm::ivec3(2);
  for (const bench::StressRoom& stress : bench::stress_rooms()) {
    if (stress.room.triangles.size() > 1000) // the sphere: daylit-bench transport-rooms
      continue;
    BakeReport report;
    ASSERT_TRUE(run(stress.room, options, &report)) << stress.name;
    // White walls amplify what the rows miss in the mean.
    const double amplified = stress.name.starts_with("reflectance") ? 5.0 : 1.0;
    EXPECT_LT(report.energy.unclosed, amplified * 1e-4) << stress.name;
    EXPECT_LT(report.energy.imbalance, 1e-5) << stress.name;
    EXPECT_EQ(report.closure.left, 0u) << stress.name;
  }
}

TEST(StressRooms, gltf_and_obj_of_one_room_bake_alike) {
  Room room = furnished_room();
  std::vector<glm::vec3> stored; // glTF stores single precision
  for (const glm::dvec3& v : room.vertices)
    stored.emplace_back(v);
  room.vertices.assign(stored.begin(), stored.end());
  const auto glb = test::gltf_of(room).glb();
  const auto gltf = parse_gltf_room(glb, "room.glb", [](const std::string& name) {
    return Result<std::vector<std::uint8_t>>(Error{ErrorCode::file_missing, "no file", name, ""});
  });
  ASSERT_TRUE(gltf) << gltf.error().message();
  std::string obj = "mtllib room.mtl\nusemtl grey\n";
  for (const glm::dvec3& v : room.vertices)
    obj += fmt::format("v {:.17g} {:.17g} {:.17g}\n", v.x, v.y, v.z);
  for (const RoomTriangle& t : room.triangles)
    obj += fmt::format("f {} {} {}\n", t.vertex[0] + 1, t.vertex[1] + 1, t.vertex[2] + 1);
  const auto text = parse_obj_room(
      obj, "room.obj", [](const std::string&) { return Result<std::string>("newmtl grey\nKd 0.6 0.6 0.6\n"); });
  ASSERT_TRUE(text) << text.error().message();
  const auto a = run(gltf->room, small_bake()), b = run(text->room, small_bake());
  ASSERT_TRUE(a && b);
  EXPECT_LT(difference(*a, *b), 1e-5);
}

TEST(StressRooms, a_face_of_nothing_is_left_out_and_said) {
  Room room = furnished_room();
  add_quad(room, {1, 1, 1}, {2, 1, 1}, {2, 1 + 1e-9, 1}, {1, 1 + 1e-9, 1});
  BakeReport report;
  ASSERT_TRUE(run(room, small_bake(), &report));
  ASSERT_FALSE(report.room.notes.empty());
  EXPECT_NE(report.room.notes.back().find("2 faces thinner"), std::string::npos);
}

TEST(StressRooms, a_closed_room_is_refused_with_its_place_in_the_world) {
  Room room = testing::grey_room(0.5f);
  add_box(room, {100, 100, 100}, {104, 104, 103}, 0b111111u, true);
  const auto volume = run(room, small_bake());
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().code, ErrorCode::geometry_invalid);
}

/// Any sky gives no light: no surface sends any on.
TEST(StressRooms, a_black_room_bakes_to_a_volume_without_light) {
  for (const float reflectance : {0.0f, 1e-25f}) // the square of the second is no number of single precision
    for (const char* regions : {"fine:256", "uniform:16"}) {
      Room room = furnished_room();
      for (Material& m : room.materials)
        m.reflectance = Rgb(reflectance);
      BakeReport report;
      const auto baked = bake_room({room, {}, ""}, *SkyPartition::parse(regions), small_bake(), kSilent, report);
      ASSERT_TRUE(baked) << regions << ": " << baked.error().message();
      EXPECT_EQ(report.energy.entering, report.energy.absorbed) << regions;
      EXPECT_GT(report.energy.entering, 0.0) << regions;
      const auto bytes = volume_bytes(*baked);
      ASSERT_TRUE(bytes) << regions << ": " << bytes.error().message();
      const auto volume = parse_volume(*bytes, "black.volume");
      ASSERT_TRUE(volume) << regions << ": " << volume.error().message();
      VolumeCombiner combiner = VolumeCombiner::make(*volume);
      combiner.update(std::vector<Rgb>(static_cast<std::size_t>(volume->partition.size()), Rgb(1.0f)));
      ASSERT_FALSE(combiner.field().probe.empty());
      for (const Sh9Rgb& probe : combiner.field().probe)
        for (const Rgb& l : probe)
          EXPECT_LE(std::max({std::abs(l.r), std::abs(l.g), std::abs(l.b)}), 100.0f * reflectance);
    }
}

} // namespace
} // namespace daylit::precompute
