#include "scene/model/object_mesh.h"

#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/model/glass_check.h"

namespace daylit {
namespace {

class ObjectMeshFile : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-mesh-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  std::filesystem::path folder_;
};

const char* const kCube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                          "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

TEST_F(ObjectMeshFile, sharp_edges_split_vertices) {
  const auto mesh = read_object_mesh(write("cube.obj", kCube), Rgb(0.3f));
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.size(), 12u);
  EXPECT_EQ(mesh->positions.size(), 24u); // three normals at each of the eight corners
  for (const glm::vec3& n : mesh->normals)
    EXPECT_NEAR(std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)}), 1.0f, 1e-6f);
  for (const Rgb& r : mesh->reflectance)
    EXPECT_EQ(r, Rgb(0.3f));
}

TEST_F(ObjectMeshFile, of_faces_written_for_both_sides_one_is_kept_and_it_is_said) {
  std::string both = kCube;
  for (const char* back : {"f 3 4 1 2", "f 8 7 6 5", "f 6 2 1 5", "f 2 6 7 3", "f 4 3 7 8", "f 8 5 1 4"})
    both += std::string(back) + "\n"; // begun elsewhere: the diagonals are the same
  std::vector<std::string> notes;
  const auto mesh = read_object_mesh(write("both.obj", both), Rgb(0.3f), &notes);
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.size(), 12u);
  EXPECT_EQ(mesh->positions.size(), 24u);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0], "12 of the triangles are there twice: one of each is left out");
}

TEST_F(ObjectMeshFile, a_tessellated_sphere_gets_radial_normals_and_shared_vertices) {
  std::string obj;
  const int rings = 12, sectors = 24;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < sectors; ++j) {
      const double t = 3.14159265358979 * i / rings, p = 6.28318530717959 * j / sectors;
      const double across = i == 0 || i == rings ? 0.0 : std::sin(t);
      obj += "v " + std::to_string(across * std::cos(p)) + " " + std::to_string(across * std::sin(p)) + " " +
             std::to_string(std::cos(t)) + "\n";
    }
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sectors; ++j) {
      const int a = i * sectors + j + 1, b = i * sectors + (j + 1) % sectors + 1;
      obj += "f " + std::to_string(a) + " " + std::to_string(a + sectors) + " " + std::to_string(b + sectors) + " " +
             std::to_string(b) + "\n";
    }
  const auto mesh = read_object_mesh(write("sphere.obj", obj));
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->positions.size(), std::size_t((rings - 1) * sectors + 2)); // the poles are welded
  for (std::size_t i = 0; i < mesh->positions.size(); ++i)
    EXPECT_GT(glm::dot(mesh->normals[i], glm::normalize(mesh->positions[i])), 0.995f);
}

TEST_F(ObjectMeshFile, material_and_file_normals_are_used) {
  write("m.mtl", "newmtl red\nKd 0.6 0.1 0.1\n");
  const auto mesh = read_object_mesh(
      write("t.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0.6 0.8\nusemtl red\nf 1//1 2//1 3//1\n"));
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_NEAR(mesh->normals[0].y, 0.6f, 1e-6f);
  EXPECT_NEAR(mesh->reflectance[0].r, 0.6f, 1e-6f);
  write("m.mtl", "newmtl red\nKd 1.6 0.1 0.1\n");
  const auto bright = read_object_mesh(folder_ / "t.obj");
  ASSERT_FALSE(bright);
  EXPECT_NE(bright.error().message().find("red"), std::string::npos);
}

TEST_F(ObjectMeshFile, the_mark_that_editors_write_before_utf_8_is_no_part_of_the_first_line) {
  const std::string mark = "\xEF\xBB\xBF";
  write("m.mtl", mark + "newmtl red\nKd 0.6 0.1 0.1\n");
  std::vector<std::string> notes;
  const auto mesh = read_object_mesh(
      write("t.obj", mark + "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"), Rgb(0.7f), &notes);
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_NEAR(mesh->reflectance[0].r, 0.6f, 1e-6f);
  EXPECT_TRUE(notes.empty()) << notes[0];
}

TEST_F(ObjectMeshFile, a_missing_library_is_said_and_its_materials_are_diffuse) {
  std::vector<std::string> notes;
  const auto mesh = read_object_mesh(
      write("t.obj", "mtllib lost.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"), Rgb(0.7f), &notes);
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_FALSE(mesh->materials[0].is_glossy());
  EXPECT_EQ(mesh->reflectance[0], Rgb(0.7f));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("lost.mtl is not there"), std::string::npos) << notes[0];
}

TEST_F(ObjectMeshFile, a_file_that_may_have_been_cut_is_told_of) {
  std::string cut = kCube;
  cut.pop_back();
  std::vector<std::string> notes;
  ASSERT_TRUE(read_object_mesh(write("whole.obj", kCube), Rgb(0.7f), &notes));
  EXPECT_TRUE(notes.empty());
  ASSERT_TRUE(read_object_mesh(write("cut.obj", cut), Rgb(0.7f), &notes));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("cut.obj: the file does not end with a line break"), std::string::npos) << notes[0];
}

TEST_F(ObjectMeshFile, materials_that_no_library_has_are_said_and_diffuse) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\n";
  write("empty.mtl", "");
  for (const char* library : {"mtllib empty.mtl\n", ""}) {
    std::vector<std::string> notes;
    const auto mesh = read_object_mesh(
        write("t.obj", library + corners + "f 1 2 3\nusemtl red\nf 2 4 3\nusemtl blue\nf 2 5 4\n"), Rgb(0.7f), &notes);
    ASSERT_TRUE(mesh) << mesh.error().message();
    ASSERT_EQ(notes.size(), 1u) << notes.back();
    EXPECT_NE(notes[0].find("\"red\", \"blue\""), std::string::npos) << notes[0];
  }
}

std::string binary_ply(bool big) {
  std::string out = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                    "_endian 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n"
                    "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto value) {
    auto bytes = std::bit_cast<std::array<char, sizeof(value)>>(value);
    if (big)
      std::reverse(bytes.begin(), bytes.end());
    out.append(bytes.begin(), bytes.end());
  };
  const float xy[4][2] = {{0, 0}, {2, 0}, {2, 1}, {0, 1}};
  for (const auto& p : xy) {
    put(p[0]), put(p[1]), put(3.0);
    out += "\x33\x66\xff";
  }
  out += '\x04';
  for (std::int32_t i = 0; i < 4; ++i)
    put(i);
  return out;
}

TEST_F(ObjectMeshFile, ply_ascii_and_both_binary_orders_agree) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
      "property list uchar int vertex_index\nend_header\n0 0 3 51 102 255\n2 0 3 51 102 255\n"
      "2 1 3 51 102 255\n0 1 3 51 102 255\n4 0 1 2 3\n";
  for (const auto& path : {write("a.ply", text), write("l.ply", binary_ply(false)), write("b.ply", binary_ply(true))}) {
    const auto mesh = read_object_mesh(path);
    ASSERT_TRUE(mesh) << mesh.error().message();
    ASSERT_EQ(mesh->positions.size(), 4u);
    EXPECT_EQ(mesh->triangles.size(), 2u);
    EXPECT_EQ(mesh->positions[2], glm::vec3(2, 1, 3));
    EXPECT_EQ(mesh->normals[0], glm::vec3(0, 0, 1));
    EXPECT_NEAR(mesh->reflectance[0].g, 0.4f, 1e-6f);
  }
}

TEST_F(ObjectMeshFile, bad_files_are_errors) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_index\nend_header\n";
  const std::string cases[] = {
      "",
      "v 0 0 0\n",
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
      "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
      "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n",
      "f 1 2 3\n",
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -9\n",
      "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.1 0\nv 0.9 0.1 0\nv 0 2 0\nv 0.1 1 0\nv 1.9 1 0\nf 1 2 3 8 7 6\n",
      ply,
      ply + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
      ply + "0 0 0\n1 0 0\n0 1 0\n3 0 1\n",
      ply + "0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n",
      "ply\nformat ascii 1.0\nelement vertex 99999999999\nend_header\n",
      "ply\nformat ascii 1.0\nelement vertex 200000000\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n",
      "ply\nformat binary_little_endian 1.0\nelement face 250000000\nend_header\n",
      "ply\nformat ebcdic 1.0\nend_header\n"};
  int i = 0;
  for (const std::string& text : cases) {
    const auto mesh = read_object_mesh(write("bad" + std::to_string(i), text));
    EXPECT_FALSE(mesh) << "case " << i << ": " << text;
    if (!mesh) {
      EXPECT_FALSE(mesh.error().where.empty());
    }
    ++i;
  }
  EXPECT_EQ(read_object_mesh(folder_ / "missing.obj").error().code, ErrorCode::file_missing);
}

TEST_F(ObjectMeshFile, a_model_of_a_format_that_is_not_read_is_no_bad_obj) {
  for (const char* name : {"cube.stl", "cube.FBX"}) {
    const auto mesh = read_object_mesh(write(name, "solid cube\n"));
    ASSERT_FALSE(mesh) << name;
    const std::string said = mesh.error().message();
    EXPECT_NE(said.find(std::string(name) + ": ."), std::string::npos) << said;
    EXPECT_NE(said.find("files are not read; export it as glTF (.glb or .gltf), OBJ or PLY"), std::string::npos)
        << said;
  }
}

TEST_F(ObjectMeshFile, a_missing_picture_is_named_with_the_material_that_asks_for_it) {
  write("m.mtl", "newmtl red\nmap_Kd gone.png\n");
  const auto mesh =
      read_object_mesh(write("t.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1\n"));
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().where.find("t.obj, material red, " + (folder_ / "gone.png").string()), std::string::npos)
      << mesh.error().message();
}

TEST_F(ObjectMeshFile, solid_glass_that_is_open_or_inside_out_is_said) {
  write("m.mtl", "newmtl glass\nNi 1.5\nillum 7\nnewmtl veil\nNi 1\nd 0.5\nnewmtl cork\nKd 0.5 0.4 0.3\n");
  const std::string cube(kCube), corners = cube.substr(0, cube.find('f'));
  const auto notes = [&](const std::string& faces) {
    const auto mesh = read_object_mesh(write("t.obj", "mtllib m.mtl\n" + corners + faces));
    EXPECT_TRUE(mesh) << mesh.error().message();
    return mesh ? glass_notes(*mesh, "t.obj") : std::vector<std::string>{};
  };
  const std::string lid = "f 4 3 2 1\n", rest = cube.substr(cube.find(lid) + lid.size()),
                    turned = "f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
  EXPECT_TRUE(notes("usemtl glass\n" + lid + rest).empty());
  EXPECT_TRUE(notes("v 1e-7 0 0\nusemtl glass\nf 5 6 7 8\nf 9 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n" + lid).empty())
      << "a seam";
  EXPECT_TRUE(notes("usemtl veil\n" + rest).empty()) << "thin";
  EXPECT_TRUE(notes("usemtl cork\n" + turned).empty()) << "opaque";
  EXPECT_TRUE(notes("usemtl glass\n" + rest + "usemtl cork\n" + lid).empty()) << "another material closes it";
  const auto open = notes("usemtl glass\n" + rest), inside_out = notes("usemtl glass\n" + turned);
  ASSERT_EQ(open.size(), 1u);
  EXPECT_EQ(open[0].find("t.obj, material \"glass\": the glass is open"), 0u) << open[0];
  ASSERT_EQ(inside_out.size(), 1u);
  EXPECT_EQ(inside_out[0].find("t.obj, material \"glass\": the glass is inside out"), 0u) << inside_out[0];
}

TEST_F(ObjectMeshFile, a_damaged_obj_is_refused_with_the_line) {
  const std::string start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
  for (const char* line : {"f 1/2 2/1 3/1", "f 1/0 2/1 3/1", "f 1/-2 2/1 3/1", "f 1//1 2//2 3//1", "f 1 2 3x", "f 1 2",
                           "vn 0 nan 0", "vt inf", "v 0 0", "solid cube"}) {
    const auto mesh = read_object_mesh(write("bad.obj", start + line + "\nf 1/1/1 2/1/1 3/1/1\n"));
    ASSERT_FALSE(mesh) << line;
    EXPECT_NE(mesh.error().message().find("line 6"), std::string::npos) << mesh.error().message();
  }
  write("bad.mtl", "newmtl red\nKd 0.5 x 0.5\n");
  const auto mesh = read_object_mesh(write("bad.obj", "mtllib bad.mtl\n" + start + "usemtl red\nf 1 2 3\n"));
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().message().find("bad.mtl, line 2"), std::string::npos) << mesh.error().message();
}

TEST_F(ObjectMeshFile, damaged_files_never_crash) {
  std::mt19937 random(6);
  for (const std::string& good : {std::string(kCube), binary_ply(false), binary_ply(true)})
    for (int i = 0; i < 300; ++i) {
      std::string bad = good.substr(0, i % 3 ? good.size() : random() % good.size());
      for (int k = 0; k < 1 + i % 4 && !bad.empty(); ++k)
        bad[random() % bad.size()] = static_cast<char>(random());
      (void)read_object_mesh(write("bad", bad));
    }
}

TEST(ObjectMesh, the_shared_objects_are_read) {
  const std::filesystem::path data = std::filesystem::path(DAYLIT_SOURCE_DIR) / "../shared/data/objects";
  if (!std::filesystem::exists(data))
    GTEST_SKIP() << "the shared objects are not here";
  const auto bunny = read_object_mesh(data / "bun_zipper_res2.ply");
  ASSERT_TRUE(bunny) << bunny.error().message();
  EXPECT_EQ(bunny->triangles.size(), 16301u - 87u) << "87 are there twice";
  const auto teapot = read_object_mesh(data / "teapot.obj");
  ASSERT_TRUE(teapot) << teapot.error().message();
  EXPECT_GT(teapot->triangles.size(), 6000u);
  for (const glm::vec3& n : teapot->normals)
    ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f);
}

} // namespace
} // namespace daylit
