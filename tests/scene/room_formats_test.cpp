#include "scene/room/room_formats.h"

#include <cmath>
#include <filesystem>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/core/atomic_file.h"
#include "scene/room/declared_gloss.h"

namespace daylit {
namespace {

Result<std::string> grey_library(const std::string&) { return std::string("newmtl grey\nKd 0.5 0.4 0.3\n"); }
Result<RoomFile> parse(const std::string& text, UpAxis up = UpAxis::z) {
  return parse_obj_room(text, "test.obj", grey_library, up);
}
const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

double total_area(const Room& room) {
  double sum = 0.0;
  for (const RoomTriangle& t : room.triangles)
    sum += area_m2(room, t);
  return sum;
}

void expect_error(const std::string& text, ErrorCode code, const std::string& part) {
  const Result<RoomFile> file = parse(text);
  ASSERT_FALSE(file) << text;
  EXPECT_EQ(file.error().code, code) << file.error().message();
  EXPECT_NE(file.error().message().find(part), std::string::npos) << file.error().message();
}

TEST(RoomFormats, square_becomes_two_triangles_with_its_material) {
  const Result<RoomFile> file = parse("mtllib a.mtl\n" + kSquare + "usemtl grey\nf 1 2 3 4\n");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->room.triangles.size(), 2u);
  EXPECT_DOUBLE_EQ(total_area(file->room), 1.0);
  EXPECT_EQ(file->room.material(file->room.triangles[0]).reflectance, Rgb(0.5f, 0.4f, 0.3f));
  EXPECT_TRUE(file->report.notes.empty());
}

TEST(RoomFormats, all_corner_forms_and_negative_indices_mean_the_same_face) {
  const std::string reference = parse(kSquare + "f 1 2 3 4\n")->content_hash;
  for (const char* face : {"f 1/1 2/2 3/3 4/4", "f 1//1 2//1 3//1 4//1", "f 1/1/1 2/2/1 3/3/1 4/4/1", "f -4 -3 -2 -1",
                           "f 1 2 \\\n 3 4", "f 1 2 3 4 # floor", "\tf  1\t2 3 4 "})
    EXPECT_EQ(parse(kSquare + face + "\n")->content_hash, reference) << face;
}

TEST(RoomFormats, concave_polygon_keeps_its_area) {
  // An L of 3 unit squares, and a comb whose corners all lie on two lines.
  const auto ell = parse("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n");
  ASSERT_TRUE(ell) << ell.error().message();
  EXPECT_NEAR(total_area(ell->room), 3.0, 1e-12);
  const auto comb = parse("v 0 0 0\nv 5 0 0\nv 5 2 0\nv 4 2 0\nv 4 1 0\nv 3 1 0\nv 3 2 0\nv 2 2 0\nv 2 1 0\nv 1 1 0\nv "
                          "1 2 0\nv 0 2 0\nf 12 11 10 9 8 7 6 5 4 3 2 1\n");
  ASSERT_TRUE(comb) << comb.error().message();
  EXPECT_NEAR(total_area(comb->room), 8.0, 1e-12);
}

TEST(RoomFormats, wall_with_a_window_cut_by_a_bridge_keeps_its_area) {
  // One face: outline 4 x 3, then along a bridge around the hole 1 x 1 and back.
  const auto wall = parse("v 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nv 1 0 1\nv 2 0 1\nv 2 0 2\nv 1 0 2\n"
                          "f 1 2 3 4 1 5 8 7 6 5\n");
  ASSERT_TRUE(wall) << wall.error().message();
  EXPECT_NEAR(total_area(wall->room), 11.0, 1e-12);
}

TEST(RoomFormats, hole_at_a_seam_is_open_whichever_way_it_is_wound) {
  // Radiance fills by parity. The hole wound as the outline, the outline begun at the hole, and two such holes.
  const std::string wall = "v 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nv 1 0 1\nv 2 0 1\nv 2 0 2\nv 1 0 2\n"
                           "v 2.5 0 1\nv 3 0 1\nv 3 0 2\nv 2.5 0 2\n";
  const std::pair<const char*, double> faces[] = {{"f 1 2 3 4 1 5 6 7 8 5\n", 11.0},
                                                  {"f 5 6 7 8 5 1 2 3 4 1\n", 11.0},
                                                  {"f 4 3 2 1 5 8 7 6 5 1\n", 11.0},
                                                  {"f 1 5 6 7 8 5 1 2 9 10 11 12 9 2 3 4\n", 10.5},
                                                  {"f 1 5 8 7 6 5 1 2 9 10 11 12 9 2 3 4\n", 10.5}};
  for (const auto& [face, area] : faces) {
    const auto file = parse(wall + face);
    ASSERT_TRUE(file) << face << file.error().message();
    EXPECT_NEAR(total_area(file->room), area, 1e-12) << face;
  }
}

TEST(RoomFormats, corner_on_a_straight_edge_gives_no_flat_triangle) {
  const auto file = parse("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4 5 6\n");
  ASSERT_TRUE(file);
  EXPECT_NEAR(total_area(file->room), 2.0, 1e-12);
  for (const RoomTriangle& t : file->room.triangles)
    EXPECT_GT(area_m2(file->room, t), 0.1);
}

TEST(RoomFormats, room_far_from_the_origin_keeps_millimetres) {
  const auto file =
      parse("v 1000000.001 2000000.002 0\nv 1000000.003 2000000.002 0\nv 1000000.003 2000000.004 0\nf 1 2 3\n");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_NEAR(file->room.vertices[1].x - file->room.vertices[0].x, 0.002, 1e-9);
  EXPECT_NEAR(total_area(file->room), 2e-6, 1e-11);
}

TEST(RoomFormats, y_up_is_turned_to_z_up) {
  const auto file = parse("v 0 0 0\nv 1 0 0\nv 0 2 3\nf 1 2 3\n", UpAxis::y);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->room.vertices[2], glm::dvec3(0, -3, 2));
}

TEST(RoomFormats, flat_and_duplicate_faces_are_dropped_and_counted) {
  const auto file = parse(kSquare + "v 2 0 0\nf 1 2 3 4\nf 4 3 2 1\nf 2 3 4 1\nf 1 2 5\nf 1 1 2 2\n");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->report.faces_read, 5u);
  EXPECT_EQ(file->report.duplicate_faces, 2u);
  EXPECT_EQ(file->report.zero_area_faces, 2u);
  EXPECT_NEAR(total_area(file->room), 1.0, 1e-12);
  EXPECT_EQ(file->report.notes.size(), 3u); // both counts, and the missing material
}

TEST(RoomFormats, dropped_faces_are_named) {
  const auto file = parse(kSquare + "v 2 0 0\nf 1 2 3 4\nf 4 3 2 1\nf 1 2 5\n");
  ASSERT_TRUE(file) << file.error().message();
  const std::string all = file->report.notes.at(1) + file->report.notes.at(2);
  EXPECT_NE(all.find("line 8"), std::string::npos) << all;
  EXPECT_NE(all.find("line 7 (\"\", as line 6)"), std::string::npos) << all;
}

TEST(RoomFormats, the_same_face_of_two_materials_is_refused_unless_both_are_alike) {
  const auto read = [](const std::string& second) {
    const std::string text = "mtllib m\n" + kSquare + "usemtl red\nf 1 2 3 4\nusemtl " + second + "\nf 2 3 4 1\n";
    return parse_obj_room(text, "two.obj", [](const std::string&) {
      return Result<std::string>(
          "newmtl red\nKd 0.7 0.1 0.1\nnewmtl rouge\nKd 0.7 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.7\n");
    });
  };
  const auto refused = read("blue");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::geometry_invalid);
  EXPECT_NE(refused.error().message().find("line 7 and line 9"), std::string::npos) << refused.error().message();
  const auto alike = read("rouge");
  ASSERT_TRUE(alike) << alike.error().message();
  EXPECT_EQ(alike->report.duplicate_faces, 1u);
}

TEST(RoomFormats, names_of_materials_are_compared_without_regard_to_case) {
  const auto file = parse_obj_room("mtllib m\n" + kSquare + "usemtl Window_South\nf 1 2 3 4\nusemtl WALL\nf 1 2 3\n",
                                   "case.obj", [](const std::string&) {
                                     return Result<std::string>("newmtl WINDOW_SOUTH\nTf 0.5 0.6 0.7\nnewmtl Wall\nKd "
                                                                "0.1 0.2 0.3\n");
                                   });
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_TRUE(file->room.materials[0].is_window);
  EXPECT_EQ(file->room.materials[0].transmittance, Rgb(0.5f, 0.6f, 0.7f));
  EXPECT_EQ(file->room.materials[1].reflectance, Rgb(0.1f, 0.2f, 0.3f));
}

TEST(RoomFormats, only_flat_faces_is_an_error) {
  expect_error(kSquare + "f 1 1 2\n", ErrorCode::geometry_invalid, "no face with an area");
  expect_error(kSquare, ErrorCode::geometry_invalid, "no face with an area");
}

TEST(RoomFormats, damage_is_refused_with_the_line) {
  expect_error(kSquare + "f 1 2 5\n", ErrorCode::file_malformed, "line 5");
  expect_error(kSquare + "f 1 2 -5\n", ErrorCode::file_malformed, "line 5");
  expect_error(kSquare + "f 1 2 0\n", ErrorCode::file_malformed, "line 5");
  expect_error(kSquare + "f 1 2", ErrorCode::file_malformed, "line 5");
  expect_error(kSquare + "f 1 2 3x\n", ErrorCode::file_malformed, "line 5");
  expect_error(kSquare + "f 1/2/3/4 2 3\n", ErrorCode::file_malformed, "line 5");
  expect_error("v 0 0\n", ErrorCode::file_malformed, "line 1");
  expect_error("v 0 0 1.2.3\n", ErrorCode::file_malformed, "line 1");
  expect_error("v 0 0 0,5\n", ErrorCode::file_malformed, "line 1");
  expect_error(kSquare + "solid cube\n", ErrorCode::file_malformed, "line 5");
  expect_error(kSquare + "surf 0 1 0 1 1 2 3 4\n", ErrorCode::file_malformed, "polygons");
}

TEST(RoomFormats, non_finite_vertex_is_refused) {
  for (const char* number : {"nan", "inf", "-inf", "1e999", "1e10"})
    expect_error("v 0 0 " + std::string(number) + "\n", ErrorCode::value_invalid, "line 1");
}

TEST(RoomFormats, outline_that_crosses_itself_is_refused) {
  expect_error("v 0 0 0\nv 3 0 0\nv 0 1 0\nv 2 1 0\nf 1 2 3 4\n", ErrorCode::geometry_invalid, "line 5");
}

TEST(RoomFormats, reflectance_outside_0_to_1_is_refused) {
  for (const char* kd : {"1.01 0 0", "0 -0.1 0", "0 0 nan", "1e300 0 0"}) {
    const auto file =
        parse_obj_room("mtllib a\n" + kSquare + "usemtl m\nf 1 2 3 4\n", "t.obj", [&](const std::string&) {
          return Result<std::string>("newmtl m\nKd " + std::string(kd) + "\n");
        });
    ASSERT_FALSE(file) << kd;
    EXPECT_EQ(file.error().code, ErrorCode::value_invalid);
    EXPECT_NE(file.error().message().find("\"m\""), std::string::npos) << file.error().message();
  }
}

TEST(RoomFormats, undefined_material_is_refused_but_a_window_needs_no_definition) {
  expect_error(kSquare + "usemtl brick\nf 1 2 3 4\n", ErrorCode::value_invalid, "brick");
  const auto window = parse(kSquare + "usemtl window.north\nf 1 2 3 4\n");
  ASSERT_TRUE(window) << window.error().message();
  EXPECT_TRUE(window->room.is_window(window->room.triangles[0]));
  EXPECT_EQ(window->room.materials[0].transmittance, Rgb(1.0f));
}

TEST(RoomFormats, window_transmittance_comes_from_Tf) {
  const auto file =
      parse_obj_room("mtllib a\n" + kSquare + "usemtl window_low_e\nf 1 2 3 4\n", "t.obj", [](const std::string&) {
        return Result<std::string>("newmtl window_low_e\nTf 0.7 0.8 0.9\nd 0.1\n");
      });
  ASSERT_TRUE(file);
  EXPECT_EQ(file->room.materials[0].transmittance, Rgb(0.7f, 0.8f, 0.9f));
}

TEST(RoomFormats, window_of_illum_7_is_clear_glass_of_index_Ni_and_any_other_is_constant) {
  const auto read = [](const std::string& body) {
    return parse_obj_room("mtllib a\n" + kSquare + "usemtl window\nf 1 2 3 4\n", "t.obj",
                          [&](const std::string&) { return Result<std::string>("newmtl window\n" + body); });
  };
  EXPECT_EQ(read("Ni 1.45\nillum 2\nTf 0.8 0.8 0.8\n")->room.materials[0].refractive_index, 0.0f);
  EXPECT_EQ(read("illum 7\n")->room.materials[0].refractive_index, 1.52f);
  const auto tinted = read("Ni 1.6\nillum 7\nTf 0.9 0.8 0.7\n");
  ASSERT_TRUE(tinted) << tinted.error().message();
  EXPECT_EQ(tinted->room.materials[0].refractive_index, 1.6f);
  EXPECT_EQ(tinted->room.materials[0].transmittance, Rgb(0.9f, 0.8f, 0.7f));
  ASSERT_FALSE(tinted->report.notes.empty()); // says which model is used
  EXPECT_NE(tinted->report.notes[0].find("clear glass, index 1.6"), std::string::npos) << tinted->report.notes[0];
  EXPECT_NE(tinted->content_hash, read("Tf 0.9 0.8 0.7\n")->content_hash);
  for (const char* bad : {"Ni 0.5\nillum 7\n", "Ni 1e9\nillum 7\n", "Ni nan\nillum 7\n", "illum\n", "Ni x\nillum 7\n"})
    EXPECT_FALSE(read(bad)) << bad;
}

TEST(RoomFormats, a_declared_gloss_is_found_in_any_case_and_a_wrong_name_lists_the_surfaces) {
  const auto file =
      parse_obj_room("mtllib m\n" + kSquare + "usemtl window\nf 1 2 3 4\nusemtl Floor\nf 1 2 3\n", "a.obj",
                     [](const std::string&) { return Result<std::string>("newmtl Floor\nKd 1 1 1\n"); });
  ASSERT_TRUE(file) << file.error().message();
  const auto found = declared_gloss(file->room, {{"floor", 0.1}});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(*found, (std::vector<float>{0.0f, 0.0f, 0.1f}));
  for (const char* name : {"flor", "window"}) {
    const auto wrong = declared_gloss(file->room, {{name, 0.1}});
    ASSERT_FALSE(wrong) << name;
    EXPECT_NE(wrong.error().message().find("its materials are \"Floor\""), std::string::npos)
        << wrong.error().message();
  }
}

TEST(RoomFormats, missing_files_are_named) {
  const auto missing = read_room("no/such/room.obj");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::file_missing);
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "without_mtl.obj";
  ASSERT_TRUE(write_file_atomically(path, "mtllib gone.mtl\n" + kSquare + "f 1 2 3 4\n"));
  const auto library = read_room(path);
  ASSERT_FALSE(library);
  EXPECT_NE(library.error().message().find("gone.mtl"), std::string::npos) << library.error().message();
}

TEST(RoomFormats, an_empty_file_and_a_mesh_without_materials_are_called_what_they_are) {
  for (const auto& [name, text, what] : {std::tuple{"empty.glb", "", "the file is empty"},
                                         {"empty.obj", "", "the file is empty"},
                                         {"room.ply", "ply\n", "a room is not read from .ply"}}) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / name;
    ASSERT_TRUE(write_file_atomically(path, text));
    const auto file = read_room(path);
    ASSERT_FALSE(file) << name;
    EXPECT_NE(file.error().message().find(what), std::string::npos) << file.error().message();
  }
}

TEST(RoomFormats, a_format_that_is_not_read_is_no_bad_obj) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "room.stl";
  ASSERT_TRUE(write_file_atomically(path, "solid room\n"));
  const auto file = read_room(path);
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message().find("room.stl: .stl files are not read; export it as OBJ, glTF"), std::string::npos)
      << file.error().message();
}

TEST(RoomFormats, file_cut_anywhere_is_refused_or_smaller) {
  const std::string text = "mtllib a.mtl\n" + kSquare + "v 0 0 1\nv 1 0 1\nusemtl grey\nf 1 2 3 4\nf 1 2 6 5\n";
  for (std::size_t size = 0; size < text.size(); ++size) {
    const auto file = parse(text.substr(0, size));
    EXPECT_TRUE(!file || file->room.triangles.size() <= 4u) << size;
  }
}

TEST(RoomFormats, hash_changes_with_geometry_and_material) {
  const std::string square = parse(kSquare + "f 1 2 3 4\n")->content_hash;
  EXPECT_EQ(square.size(), 16u);
  EXPECT_NE(parse("v 0 0 1e-9\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")->content_hash, square);
  EXPECT_NE(parse("mtllib a\n" + kSquare + "usemtl grey\nf 1 2 3 4\n")->content_hash, square);
}

TEST(RoomFormats, many_cornered_face_ends_in_time) {
  // A spiral of 1024 corners is the worst case of ear clipping; 1025 corners are refused.
  std::string text;
  const int n = 512;
  for (int side = 0; side < 2; ++side)
    for (int k = 0; k < n; ++k) {
      const int i = side == 0 ? k : n - 1 - k;
      const double angle = 0.1 * i, radius = 1.0 + 0.02 * i + 0.05 * side;
      text.append("v ").append(std::to_string(radius * std::cos(angle))).append(" ");
      text.append(std::to_string(radius * std::sin(angle))).append(" 0\n");
    }
  std::string face = "f";
  for (int k = 1; k <= 2 * n; ++k)
    face.append(" ").append(std::to_string(k));
  const auto spiral = parse(text + face + "\n");
  ASSERT_TRUE(spiral) << spiral.error().message();
  EXPECT_EQ(spiral->room.triangles.size(), 2u * n - 2u);
  expect_error(text + face + " 1\n", ErrorCode::limit_exceeded, "1024");
}

TEST(RoomFormats, reference_room_is_read) {
  const std::filesystem::path path = DAYLIT_SOURCE_DIR "/../shared/truth/scenes/s1_daylit_cornell.obj";
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "reference scenes not present";
  const auto file = read_room(path);
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_TRUE(file->report.notes.empty());
  EXPECT_EQ(file->room.materials.size(), 3u);
  // Walls 2 (20 + 14 + 11.2) less the hole 1.6 x 1.2, and the boxes without bottoms.
  const double boxes = 4 * 0.9 * 1.6 + 0.9 * 0.9 + 4 * 0.9 * 0.8 + 0.9 * 0.9;
  EXPECT_NEAR(total_area(file->room), 2 * (20 + 14 + 11.2) - 1.6 * 1.2 + boxes, 1e-6);
}

} // namespace
} // namespace daylit
