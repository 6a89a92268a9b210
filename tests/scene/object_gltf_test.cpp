// Virtual objects from glTF and textured OBJ: frames, colours, textures as reflectance at vertices, damaged files.

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "gltf_builder.h"
#include "scene/image/image_formats.h"
#include "scene/model/object_mesh.h"

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

/// A square of one metre in the file's x-y plane (in the world: upright, facing -y), u to the right, v down.
test::GltfParts square(const std::string& material, const std::string& attributes = "") {
  test::GltfParts parts;
  const std::vector<float> p{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, uv{0, 1, 1, 1, 1, 0, 0, 0},
      normal{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  const std::vector<std::uint8_t> colour{255, 0, 0, 255, 255, 0, 0, 255, 0, 255, 0, 255, 0, 255, 0, 255};
  parts.add_accessor(parts.add_view(p), 5126, 4, "VEC3");
  parts.add_accessor(parts.add_view(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3}), 5123, 6, "SCALAR");
  parts.add_accessor(parts.add_view(uv), 5126, 4, "VEC2");
  parts.add_accessor(parts.add_view(normal), 5126, 4, "VEC3");
  parts.add_accessor(parts.add_view(colour), 5121, 4, "VEC4");
  parts.add_material(material);
  parts.meshes = "{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":3" + attributes +
                 "},\"indices\":1,\"material\":0}]}";
  parts.add_node("{\"mesh\":0}");
  return parts;
}

const char* const kPlain = R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1.0,1]}})";
const char* const kTextured = R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],)"
                              R"("baseColorTexture":{"index":0}}})";

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

TEST_F(ObjectGltf, vertex_colours_multiply_the_base_colour) {
  auto parts = square(kPlain, ",\"COLOR_0\":4");
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  for (std::size_t k = 0; k < mesh->positions.size(); ++k)
    EXPECT_EQ(mesh->reflectance[k], mesh->positions[k].z > 0.5f ? Rgb(0, 0.25f, 0) : Rgb(0.5f, 0, 0));
}

/// What the quarters say at a vertex of the square, or nothing near their borders.
std::optional<Rgb> expected_at(const glm::vec3& p, float factor) {
  if (std::abs(p.x - 0.5f) < 0.15f || std::abs(p.z - 0.5f) < 0.15f || std::min(p.x, p.z) < 0.1f ||
      std::max(p.x, p.z) > 0.9f) // beyond the edge the texture repeats
    return std::nullopt;
  const bool right = p.x > 0.5f, below = p.z < 0.5f;
  return factor * Rgb(right == below ? 1 : 0, right ? 1 : 0, below ? 1 : 0);
}

void expect_quarters(const ObjectMesh& mesh, float factor) {
  int compared = 0;
  double area = 0;
  for (std::size_t k = 0; k < mesh.positions.size(); ++k)
    if (const auto expected = expected_at(mesh.positions[k], factor)) {
      ++compared;
      EXPECT_LT(glm::length(mesh.reflectance[k] - *expected), 1e-5f)
          << mesh.positions[k].x << " " << mesh.positions[k].z;
    }
  for (const auto& t : mesh.triangles)
    area += 0.5 * glm::length(glm::cross(glm::dvec3(mesh.positions[t[1]] - mesh.positions[t[0]]),
                                         glm::dvec3(mesh.positions[t[2]] - mesh.positions[t[0]])));
  EXPECT_NEAR(area, 1.0, 1e-6);
  EXPECT_GE(compared, 8);
}

TEST_F(ObjectGltf, a_texture_becomes_reflectance_at_the_vertices_of_a_divided_mesh) {
  auto parts = square(kTextured, ",\"TEXCOORD_0\":2");
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"quarters.png"}])";
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.size(), 2u * 6 * 6) << "a diagonal of 45 texels, eight to an edge";
  EXPECT_EQ(mesh->positions.size(), 7u * 7) << "no vertex twice: the two halves meet without a crack";
  expect_quarters(*mesh, 0.5f);
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

TEST_F(ObjectGltf, fine_textures_keep_their_mean) {
  Rgb8Image checks{256, 256, std::vector<std::uint8_t>(3 * 256 * 256)};
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x)
      for (int c = 0; c < 3; ++c)
        checks.bytes[static_cast<std::size_t>(3 * (256 * y + x) + c)] = (x + y) % 2 ? 255 : 0;
  ASSERT_TRUE(write_png(folder_ / "checks.png", checks));
  auto parts = square(kTextured, ",\"TEXCOORD_0\":2");
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"checks.png"}])";
  const auto mesh = read_object_mesh(write("a.glb", parts.glb()));
  ASSERT_TRUE(mesh) << mesh.error().message();
  for (const Rgb& r : mesh->reflectance)
    EXPECT_NEAR(r.g, 0.25f, 1e-4f) << "half of the texels times 0.5";
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

TEST_F(ObjectGltf, more_texels_than_an_object_may_have_are_refused) {
  const Rgb8Image large{4096, 4096, std::vector<std::uint8_t>(std::size_t{3} * 4096 * 4096, 128)};
  ASSERT_TRUE(write_png(folder_ / "large.png", large));
  std::string materials = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nvt 0 0\nvt 1 0\nvt 1 1\n", library;
  for (const char* name : {"a", "b", "c"}) { // three names of one file: each is read
    fs::create_hard_link(folder_ / "large.png", folder_ / (std::string(name) + ".png"));
    library += std::string("newmtl ") + name + "\nKd 1 1 1\nmap_Kd " + name + ".png\n";
  }
  std::ofstream(folder_ / "a.mtl") << library;
  for (const char* name : {"a", "b", "c"})
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
