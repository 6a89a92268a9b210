// Room models from measured lengths: closed, baked as they are, and what is said of lengths that contradict each other.

#include <map>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "calibration/room_plan.h"
#include "scene/room/aperture.h"
#include "scene/room/room_formats.h"
#include "scene/room/room_write.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit::calibration {
namespace {

namespace fs = std::filesystem;

const char* const kBox = R"(size = [4.0, 5.0, 2.6]
diagonal = 6.40
floor = [0.3, 0.22, 0.15]
[[window]]
wall = "x0"
left = 1.3
sill = 0.9
width = 2.4
height = 1.4
[[block]]
name = "table"
corner = [1.0, 1.5]
size = [1.6, 0.8, 0.04]
below = 0.7
[[block]]
name = "cupboard"
corner = [3.4, 0.0]
size = [0.6, 1.2, 2.0]
)";
const char* const kAngle = R"(size = [6.0, 5.0, 2.5]
cut = [3.0, 2.5]
[[window]]
wall = "cut_y"
left = 0.4
sill = 0.8
width = 1.5
height = 1.2
[[window]]
wall = "x1"
left = 0.2
sill = 0.0
width = 0.9
height = 2.1
[[window]]
wall = "x1"
left = 1.3
sill = 0.9
width = 1.0
height = 1.2
)";

Result<RoomPlan> plan_of(const std::string& text) {
  const fs::path folder = test::fresh_folder("room-plan");
  std::ofstream(folder / "lengths.toml") << text;
  return read_room_plan(folder / "lengths.toml");
}

TEST(RoomPlan, rooms_are_closed_and_their_windows_have_the_measured_area) {
  for (const auto& [text, windows, area] :
       {std::tuple{kBox, 1, 2.4 * 1.4}, {kAngle, 3, 1.5 * 1.2 + 0.9 * 2.1 + 1.0 * 1.2}}) {
    const auto plan = plan_of(text);
    ASSERT_TRUE(plan) << plan.error().message();
    EXPECT_TRUE(contradictions(*plan).empty());
    const Room room = room_of(*plan);
    const auto rays = RayScene::build(room);
    ASSERT_TRUE(rays);
    const auto apertures = find_apertures(room, *rays);
    ASSERT_TRUE(apertures) << apertures.error().message();
    EXPECT_EQ(apertures->report.window_polygons, windows);
    EXPECT_EQ(apertures->report.hole_polygons, 0);
    EXPECT_NEAR(apertures->report.window_area_m2, area, 1e-9);
    EXPECT_EQ(apertures->report.unexplained_escape, 0.0);
  }
}

TEST(RoomPlan, areas_of_floor_and_walls_are_those_of_the_lengths) {
  const auto plan = plan_of(kAngle);
  ASSERT_TRUE(plan);
  const Room room = room_of(*plan);
  std::map<std::string, double> area;
  for (const RoomTriangle& t : room.triangles)
    area[room.material(t).name] += area_m2(room, t);
  EXPECT_NEAR(area["floor"], 6 * 5 - 3 * 2.5, 1e-9);
  EXPECT_NEAR(area["ceiling"], area["floor"], 1e-9);
  EXPECT_NEAR(area["wall_y0"], 6 * 2.5, 1e-9);
  EXPECT_NEAR(area["wall_cut_y"], 3 * 2.5 - 1.5 * 1.2, 1e-9);
  EXPECT_NEAR(area["wall_cut_x"], 2.5 * 2.5, 1e-9);
}

TEST(RoomPlan, a_window_is_measured_from_the_left_as_seen_from_inside) {
  // Who looks at the wall y = 0 from inside looks along -y and has +x on the left.
  const auto plan =
      plan_of("size = [4, 3, 2.5]\n[[window]]\nwall = \"y0\"\nleft = 0.5\nsill = 1\nwidth = 1\nheight = 1\n");
  ASSERT_TRUE(plan) << plan.error().message();
  const Room room = room_of(*plan);
  Bounds window;
  for (const RoomTriangle& t : room.triangles)
    if (room.is_window(t))
      for (int k = 0; k < 3; ++k)
        window.include(room.corner(t, k));
  EXPECT_NEAR(window.max.x, 3.5, 1e-12);
  EXPECT_NEAR(window.min.x, 2.5, 1e-12);
  EXPECT_EQ(window.max.y, 0.0);
}

TEST(RoomPlan, what_contradicts_itself_is_said) {
  const auto says = [](std::string text, const std::string& from, const std::string& to, const std::string& what) {
    text.replace(text.find(from), from.size(), to);
    const auto plan = plan_of(text);
    ASSERT_TRUE(plan) << plan.error().message();
    std::string all;
    for (const std::string& fault : contradictions(*plan))
      all += fault + "\n";
    EXPECT_NE(all.find(what), std::string::npos) << what << ": " << all;
  };
  says(kBox, "6.40", "6.61", "6.61 m, the lengths give 6.40 m");
  says(kBox, "left = 1.3", "left = 3.3", "measure left and width again");
  says(kBox, "height = 1.4", "height = 1.9", "measure sill and height again");
  says(kBox, "[4.0, 5.0, 2.6]", "[400, 500, 260]", "give metres");
  says(kBox, "\"x0\"", "\"cut_x\"", "no such wall");
  says(kBox, "corner = [3.4, 0.0]", "corner = [3.6, 0.0]", "'cupboard': reaches out of the room");
  says(kAngle, "left = 1.3", "left = 1.0", "overlaps window 2");
}

TEST(RoomPlan, problems_of_the_file_are_named_with_their_line) {
  const auto plan = plan_of("size = [4, 3, 2.5]\n[[window]]\nwal = \"y0\"\n");
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message().find("wal"), std::string::npos) << plan.error().message();
  EXPECT_FALSE(plan_of("cut = [1, 1]\n"));
  EXPECT_FALSE(plan_of("size = [4, 3, 2.5]\ncut = [5, 1]\n"));
}

TEST(RoomProgram, the_written_room_passes_the_check_of_the_bake) {
  const fs::path folder = test::fresh_folder("room");
  for (const char* text : {kBox, kAngle}) {
    std::ofstream(folder / "lengths.toml") << text;
    const auto made = test::calibrate(folder, "room lengths.toml -o room.obj --report out --force");
    EXPECT_EQ(made.exit_code, 0) << made.json;
    EXPECT_EQ(made.json.value("verdict", ""), "pass") << made.json;
    const std::string check =
        "cd '" + folder.string() + "' && " DAYLIT_BINARY_DIR "/bin/daylit-precompute check room.obj > check.txt 2>&1";
    EXPECT_EQ(std::system(check.c_str()), 0);
  }
  std::ofstream(folder / "lengths.toml") << "size = [4, 3, 2.5]\n";
  const auto dark = test::calibrate(folder, "room lengths.toml -o dark.obj");
  EXPECT_EQ(dark.exit_code, 1);
  EXPECT_TRUE(test::says(dark, "no [[window]]")) << dark.json;
  EXPECT_FALSE(fs::exists(folder / "dark.obj"));
}

TEST(RoomWrite, a_room_is_read_back_as_it_was) {
  const fs::path folder = test::fresh_folder("room-write");
  Room room;
  room.vertices = {{0.1, 1e6, 0}, {1.0 / 3, 1e6, 0}, {1, 1e6 + 1, 0}, {0, 1e6 + 1, 2}};
  room.materials = {
      {.name = "wall", .reflectance = Rgb(0.25f, 1.0f / 3, 0.5f)},
      {.name = "window_a", .transmittance = Rgb(0.9f, 0.8f, 0.7f), .is_window = true, .refractive_index = 1.52f}};
  room.triangles = {{{0, 1, 2}, 0}, {{0, 2, 3}, 1}};
  ASSERT_TRUE(write_room(folder / "r.obj", room));
  const auto back = read_room(folder / "r.obj");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->room.vertices, room.vertices);
  EXPECT_EQ(back->room.materials[0].reflectance, room.materials[0].reflectance);
  EXPECT_EQ(back->room.materials[1].transmittance, room.materials[1].transmittance);
  EXPECT_EQ(back->room.materials[1].refractive_index, room.materials[1].refractive_index);
  for (std::size_t t = 0; t < 2; ++t)
    EXPECT_LT(glm::distance(area_normal(back->room, back->room.triangles[t]), area_normal(room, room.triangles[t])),
              1e-9); // read from another corner of the triangle on
}

} // namespace
} // namespace daylit::calibration
