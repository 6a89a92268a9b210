// Virtual objects from glTF and textured OBJ: frames, colours, textures per pixel, damaged files.

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "gltf_builder.h"
#include "scene/image/image_formats.h"
#include "scene/model/object_mesh.h"
#include "scene/model/surface_look.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;

/// Four quarters of a square: red, green above blue, white.
Rgb8Image quarters(int side) {
  Rgb8Image image{side, side, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * side * side))};
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const bool right = x >= side / 2, below = y >= side / 2;
      const std::uint8_t rgb[3] = {static_cast<std::uint8_t>(right == below ? 255 : 0),
                                   static_cast<std::uint8_t>(right ? 255 : 0),
                                   static_cast<std::uint8_t>(below ? 255 : 0)};
      std::copy(rgb, rgb + 3, &image.bytes[static_cast<std::size_t>(3 * (y * side + x))]);
    }
  return image;
}

class ObjectGltf : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "daylit-object-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    ASSERT_TRUE(write_png(folder_ / "quarters.png", quarters(32)));
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const std::string& name, const std::vector<std::uint8_t>& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return folder_ / name;
  }
  fs::path folder_;
};

using test::square;

const char* const kPlain = R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1.0,1],"metallicFactor":0}})";
const char* const kTextured = R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],)"
                              R"("metallicFactor":0,"baseColorTexture":{"index":0}}})";

TEST_F(ObjectGltf, y_up_is_turned_to_z_up_with_normals) {
  auto parts = square(kPlain);
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  ASSERT_EQ(mesh->positions.size(), 4u);
  EXPECT_EQ(mesh->triangles.size(), 2u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(mesh->normals[k], glm::vec3(0, -1, 0));
    EXPECT_EQ(mesh->positions[k].y, 0.0f);
    EXPECT_EQ(mesh->reflectance[k], Rgb(0.5f, 0.25f, 1.0f));
  }
}

TEST_F(ObjectGltf, nodes_move_scale_and_repeat_a_mesh) {
  auto parts = square(kPlain);
  parts.add_node(R"({"mesh":0,"translation":[0,2,0],"scale":[3,3,3]})");
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.size(), 4u);
  glm::vec3 most(0.0f);
  for (const glm::vec3& p : mesh->positions)
    most = glm::max(most, p);
  EXPECT_EQ(most, glm::vec3(3, 0, 5)) << "two metres up and three wide";
}

TEST_F(ObjectGltf, a_mirrored_node_turns_its_triangles_over_so_that_what_is_outside_stays_so) {
  auto parts = square(kPlain);
  parts.add_node(R"({"mesh":0,"translation":[0,2,0],"scale":[-1,1,1]})");
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  ASSERT_EQ(mesh->triangles.size(), 4u);
  for (const auto& t : mesh->triangles) {
    const glm::vec3 &a = mesh->positions[t[0]], &b = mesh->positions[t[1]], &c = mesh->positions[t[2]];
    EXPECT_LT(glm::cross(b - a, c - a).y, 0.0f) << "it faces -y, as the square that is not mirrored";
  }
}

TEST_F(ObjectGltf, vertex_colours_multiply_the_base_colour) {
  auto parts = square(kPlain, ",\"COLOR_0\":4");
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  for (std::size_t k = 0; k < mesh->positions.size(); ++k)
    EXPECT_EQ(mesh->reflectance[k], mesh->positions[k].z > 0.5f ? Rgb(0, 0.25f, 0) : Rgb(0.5f, 0, 0));
}

/// A square of one metre, upright, whose texture shows the quarters: at every point the colour of its quarter.
void expect_quarters(const ObjectMesh& mesh, float factor) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::vec3 a = mesh.positions[mesh.triangles[t][0]], b = mesh.positions[mesh.triangles[t][1]],
                    c = mesh.positions[mesh.triangles[t][2]];
    area += 0.5 * static_cast<double>(glm::length(glm::cross(b - a, c - a)));
    for (const auto& [u, v] : {std::pair(0.1f, 0.1f), std::pair(0.7f, 0.2f), std::pair(0.2f, 0.7f)}) {
      const glm::vec3 p = a + u * (b - a) + v * (c - a);
      const bool right = p.x > 0.5f, below = p.z < 0.5f;
      const Rgb expected = factor * Rgb(right == below ? 1 : 0, right ? 1 : 0, below ? 1 : 0);
      EXPECT_LT(glm::length(base_colour(mesh, t, u, v, 0.0f) - expected), 1e-5f) << p.x << " " << p.z;
    }
  }
  EXPECT_NEAR(area, 1.0, 1e-6);
}

/// Black and white texels in turn.
Rgb8Image checks(int side) {
  Rgb8Image image{side, side, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * side * side))};
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (int c = 0; c < 3; ++c)
        image.bytes[static_cast<std::size_t>(3 * (side * y + x) + c)] = (x + y) % 2 ? 255 : 0;
  return image;
}

TEST_F(ObjectGltf, a_fine_pattern_is_kept_per_pixel_and_its_mean_from_far) {
  ASSERT_TRUE(write_png(folder_ / "checks.png", checks(256)));
  auto parts = square(kTextured, ",\"TEXCOORD_0\":2");
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"checks.png"}])";
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.size(), 2u) << "the mesh is not divided for its texture";
  ASSERT_EQ(mesh->uv.size(), mesh->positions.size());
  for (int x = 1; x < 100; ++x) { // middles of texels along the lower edge, triangle (0, 0), (1, 0), (1, 1)
    const float u = (static_cast<float>(x) + 0.5f) / 256.0f;
    EXPECT_NEAR(base_colour(*mesh, 0, u - 0.5f / 256.0f, 0.5f / 256.0f, 1e-4f).r, x % 2 ? 0.0f : 0.5f, 1e-3f) << x;
  }
  for (const Rgb& r : mesh->reflectance)
    EXPECT_NEAR(r.g, 0.25f, 2e-3f) << "what a vertex sends on: half of the texels times 0.5";
  EXPECT_NEAR(base_colour(*mesh, 0, 0.3f, 0.3f, 0.1f).r, 0.25f, 2e-3f) << "seen from far";
}

TEST_F(ObjectGltf, vertex_colours_survive_beside_a_texture) {
  auto parts = square(kTextured, ",\"TEXCOORD_0\":2,\"COLOR_0\":4");
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"quarters.png"}])";
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  // Lower left: blue in the picture, red in the vertices: nothing. Lower right: white times red.
  EXPECT_EQ(base_colour(*mesh, 0, 0.2f, 0.05f, 0.0f), Rgb(0.0f));
  EXPECT_LT(glm::length(base_colour(*mesh, 0, 0.8f, 0.05f, 0.0f) - 0.5f * Rgb(0.95f, 0.05f, 0.0f)), 1e-5f);
}

TEST_F(ObjectGltf, an_image_inside_the_file_is_the_same_as_one_beside_it) {
  std::ifstream file(folder_ / "quarters.png", std::ios::binary);
  const std::vector<std::uint8_t> png((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  auto parts = square(kTextured, ",\"TEXCOORD_0\":2");
  const int view = parts.add_view(png);
  parts.more =
      fmt::format(R"(,"textures":[{{"source":0}}],"images":[{{"bufferView":{},"mimeType":"image/png"}}])", view);
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  expect_quarters(*mesh, 0.5f);
}

TEST_F(ObjectGltf, obj_with_a_texture_shows_the_same_picture) {
  std::ofstream(folder_ / "a.mtl") << "newmtl paper\nKd 0.5 0.5 0.5\nmap_Kd -s 1 1 1 -clamp off quarters.png\n";
  std::ofstream(folder_ / "a.obj") << "mtllib a.mtl\nusemtl paper\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nvt 0 0\nvt 1 0\n"
                                      "vt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
  const auto mesh = read_object_mesh(folder_ / "a.obj");
  ASSERT_TRUE(mesh) << mesh.error().message();
  expect_quarters(*mesh, 0.5f);
}

TEST_F(ObjectGltf, errors_name_what_is_wrong) {
  auto parts = square(kTextured, ",\"TEXCOORD_0\":2");
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"not-there.png"}])";
  EXPECT_FALSE(read_object_mesh(write("missing.glb", parts.glb())));
  parts.more = R"(,"textures":[{"source":7}],"images":[{"uri":"quarters.png"}])";
  const auto no_image = read_object_mesh(write("image.glb", parts.glb()));
  ASSERT_FALSE(no_image);
  EXPECT_NE(no_image.error().message().find("image"), std::string::npos);
  const auto bright =
      read_object_mesh(write("bright.glb", square(R"({"pbrMetallicRoughness":{"baseColorFactor":[2,0,0,1]}})").glb()));
  ASSERT_FALSE(bright);
  EXPECT_EQ(bright.error().code, ErrorCode::value_invalid);
  auto short_uv = square(kPlain, ",\"TEXCOORD_0\":1");
  EXPECT_FALSE(read_object_mesh(write("uv.glb", short_uv.glb())));
}

TEST_F(ObjectGltf, an_empty_or_cut_file_is_called_what_it_is) {
  const auto what_of = [&](const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name) << bytes;
    const auto mesh = read_object_mesh(folder_ / name);
    return mesh ? std::string() : mesh.error().message();
  };
  for (const char* name : {"a.glb", "a.GLB", "a.gltf", "a.obj", "a.ply"})
    EXPECT_NE(what_of(name, "").find("the file is empty"), std::string::npos) << name;
  for (const char* bytes : {"\x89PNG\r\n", "{\"asset\":", "glTF", "gl"})
    EXPECT_NE(what_of("a.glb", bytes).find("no valid glTF 2.0"), std::string::npos) << what_of("a.glb", bytes);
  const std::string renamed = what_of("a.glb", "# a box\nv 0 0 0\n"), damaged = what_of("a.gltf", "{\"asset\" {}}");
  EXPECT_NE(renamed.find("neither a glTF binary, which begins with \"glTF\", nor JSON"), std::string::npos) << renamed;
  EXPECT_NE(damaged.find("its JSON is damaged at line 1, column 10;"), std::string::npos) << damaged;
  const std::string nan = what_of("a.gltf", R"({"asset": {"version": "2.0"}, "roughnessFactor": NaN})"),
                    large = what_of("a.gltf", R"({"asset": {"version": "2.0"}, "roughnessFactor": 1e999})");
  EXPECT_NE(nan.find("\"roughnessFactor\": N"), std::string::npos) << nan;
  EXPECT_NE(large.find("1e999"), std::string::npos) << large;
}

TEST_F(ObjectGltf, an_attribute_that_is_not_finite_is_named_with_its_model) {
  auto parts = square(kPlain);
  const float nan = NAN;
  std::memcpy(parts.buffer.data() + 48 + 12 + 32, &nan, sizeof(nan)); // after positions, indices and coordinates
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().message().find("a.glb, node 0, NORMAL, accessor 3, element 0: an attribute is not finite"),
            std::string::npos)
      << mesh.error().message();
}

TEST_F(ObjectGltf, more_texels_than_an_object_may_have_are_refused) {
  const Rgb8Image large{4096, 4096, std::vector<std::uint8_t>(std::size_t{3} * 4096 * 4096, 128)};
  ASSERT_TRUE(write_png(folder_ / "large.png", large));
  std::string materials = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nvt 0 0\nvt 1 0\nvt 1 1\n", library;
  for (const char* name : {"a", "b", "c", "d", "e"}) { // five names of one file: each is read
    fs::create_hard_link(folder_ / "large.png", folder_ / (std::string(name) + ".png"));
    library += std::string("newmtl ") + name + "\nKd 1 1 1\nmap_Kd " + name + ".png\n";
  }
  std::ofstream(folder_ / "a.mtl") << library;
  for (const char* name : {"a", "b", "c", "d", "e"})
    materials += std::string("usemtl ") + name + "\nf 1/1 2/2 3/3\n";
  std::ofstream(folder_ / "a.obj") << materials;
  const auto mesh = read_object_mesh(folder_ / "a.obj");
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::limit_exceeded);
}

TEST_F(ObjectGltf, damaged_files_are_refused_or_read_whole) {
  auto parts = square(kTextured, ",\"TEXCOORD_0\":2,\"COLOR_0\":4");
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"quarters.png"}])";
  const std::vector<std::uint8_t> good = parts.glb();
  std::mt19937 random(7);
  int read = 0;
  for (int k = 0; k < 400; ++k) {
    std::vector<std::uint8_t> bad = good;
    if (k % 3 == 0)
      bad.resize(random() % good.size());
    else
      for (int n = 0; n < 1 + k % 4; ++n)
        bad[random() % bad.size()] ^= static_cast<std::uint8_t>(1u << (random() % 8));
    const auto mesh = read_object_mesh(write("bad.glb", bad));
    if (!mesh)
      continue;
    ++read;
    for (const auto& t : mesh->triangles)
      for (const std::uint32_t v : t)
        ASSERT_LT(v, mesh->positions.size());
    for (std::size_t v = 0; v < mesh->positions.size(); ++v) {
      ASSERT_TRUE(std::isfinite(mesh->positions[v].x + mesh->positions[v].y + mesh->positions[v].z));
      ASSERT_NEAR(glm::length(mesh->normals[v]), 1.0f, 1e-3f);
      ASSERT_GE(mesh->reflectance[v].r, 0.0f);
      ASSERT_LE(mesh->reflectance[v].r, 1.0f);
    }
  }
  EXPECT_GT(read, 3) << "some damage is harmless";
}

} // namespace
} // namespace daylit
