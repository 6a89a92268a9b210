// Lafortune lobes beside a model (docs/materials.md).

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "scene/image/image_formats.h"
#include "scene/model/object_mesh.h"
#include "scene/model/surface_look.h"

namespace daylit {
namespace {

constexpr const char* kSquare = "mtllib s.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                                "usemtl paint\nf 1/1 2/2 3/3\nusemtl trim\nf 1 3 4\n";
constexpr const char* kMaterials = "newmtl paint\nKd 0.5 0.4 0.3\nKs 0.5 0.5 0.5\nNs 100\nillum 7\nKe 2 2 2\n"
                                   "newmtl trim\nKd 0.2 0.2 0.2\n";

class LobeFile : public testing::Test {
protected:
  LobeFile() {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-lobes-XXXXXX").string();
    EXPECT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write("s.obj", kSquare);
    write("s.mtl", kMaterials);
  }
  ~LobeFile() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  void write_picture(const std::string& name, std::array<std::uint8_t, 3> colour) {
    ASSERT_TRUE(write_png(folder_ / name, Rgb8Image{1, 1, {colour[0], colour[1], colour[2]}}));
  }
  Result<ObjectMesh> read(const std::string& lobes) {
    write("s.lobes.toml", lobes);
    return read_object_mesh(folder_ / "s.obj");
  }
  std::filesystem::path folder_;
};

TEST_F(LobeFile, a_model_without_one_has_no_lobe) {
  const auto mesh = read_object_mesh(folder_ / "s.obj");
  ASSERT_TRUE(mesh);
  EXPECT_FALSE(mesh->materials[0].lobe);
}

TEST_F(LobeFile, one_without_a_lobe_is_said) {
  write("s.lobes.toml", "");
  std::vector<std::string> notes;
  ASSERT_TRUE(read_object_mesh(folder_ / "s.obj", Rgb(0.7f), &notes));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("s.lobes.toml has no [[lobe]]"), std::string::npos) << notes[0];
}

TEST_F(LobeFile, takes_the_place_of_what_mirrors_and_refracts) {
  const auto mesh = read("[[lobe]]\nmaterial = \"paint\"\nspecular = [0.3, 0.2, 0.1]\nc = [-1, -0.5, 0.8]\n"
                         "exponent = 200\ngrazing = 0.4\nfalloff = 3\nrotation = 90\n");
  ASSERT_TRUE(mesh) << mesh.error().message();
  const ObjectMaterial& paint = mesh->materials[0];
  ASSERT_TRUE(paint.lobe);
  EXPECT_EQ(*paint.lobe, (LafortuneLobe{Rgb(0.3f, 0.2f, 0.1f), {-1.0f, -0.5f, 0.8f}, 200.0f, 0.4f, 3.0f}));
  EXPECT_EQ(paint.transmission, 0.0f) << "illum 7 is glass";
  EXPECT_EQ(paint.emission, Rgb(2.0f)) << "kept";
  EXPECT_TRUE(paint.is_glossy());
  EXPECT_FALSE(mesh->materials[1].lobe) << "not named";
  const SurfaceLook look = surface_look(*mesh, 0, 0.3f, 0.3f, 0.001f);
  EXPECT_GT(look.tangent.y, 0.9999f) << "u grows along x; turned by 90 degrees";
  EXPECT_NEAR(look.material.alpha_u, 1.0f / std::sqrt(401.0f), 1e-6f);
}

TEST_F(LobeFile, without_a_name_is_for_all_materials_and_later_ones_win) {
  const auto mesh = read("[[lobe]]\nspecular = 0.1\n[[lobe]]\nmaterial = \"trim\"\nspecular = 0.2\n");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->materials[0].lobe->weight, Rgb(0.1f));
  EXPECT_EQ(mesh->materials[1].lobe->weight, Rgb(0.2f));
}

TEST_F(LobeFile, more_than_all_light_is_said) {
  write("s.lobes.toml", "[[lobe]]\nmaterial = \"paint\"\nspecular = 0.6\n");
  std::vector<std::string> notes;
  const auto mesh = read_object_mesh(folder_ / "s.obj", Rgb(0.7f), &notes);
  ASSERT_TRUE(mesh);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("\"paint\" exceed 1"), std::string::npos) << notes[0];
}

TEST_F(LobeFile, pictures_vary_weight_exponent_and_direction) {
  write_picture("w.png", {188, 255, 0});
  write_picture("half.png", {128, 128, 128});
  write_picture("quarter.png", {64, 64, 64});
  const auto mesh = read("[[lobe]]\nmaterial = \"paint\"\nspecular = 0.4\nspecular_texture = \"w.png\"\n"
                         "exponent = 100\nexponent_texture = \"half.png\"\nc = [-0.5, -1, 1]\n"
                         "rotation_texture = \"quarter.png\"\n");
  ASSERT_TRUE(mesh) << mesh.error().message();
  const SurfaceLook look = surface_look(*mesh, 0, 0.3f, 0.3f, 0.001f);
  const LafortuneLobe& lobe = *look.material.lobe;
  EXPECT_NEAR(lobe.weight.r, 0.4f * srgb_decode(188.0f / 255.0f), 1e-5f) << "a colour";
  EXPECT_NEAR(lobe.weight.g, 0.4f, 1e-6f);
  EXPECT_EQ(lobe.weight.b, 0.0f);
  EXPECT_NEAR(std::log(lobe.exponent) / std::log(100.0f), 128.0f / 255.0f, 1e-4f) << "a power, linear";
  EXPECT_GT(look.tangent.y, 0.999f) << "a quarter of a turn";
}

TEST_F(LobeFile, bad_input_is_named) {
  write("words.png", "no picture");
  write_picture("w.png", {128, 128, 128});
  const std::pair<const char*, std::string> cases[] = {
      {"[[lobe]]\nexponent = 20\n", "s.lobes.toml, line 1: [lobe]: lobe 1 of the file needs specular"},
      {"[[lobe]]\nspecular = 0.1\n[[lobe]]\nmaterial = \"trim\"\n", "lobe 2 of the file, for the material \"trim\","},
      {"[[lobe]]\nspecular = 1.5\n", "specular"},
      {"[[lobe]]\nspecular = -0.1\n", "specular"},
      {"[[lobe]]\nspecular = nan\n", "specular"},
      {"[[lobe]]\nspecular = 0.1\nexponent = 0.5\n", "exponent"},
      {"[[lobe]]\nspecular = 0.1\nexponent = 1e6\n", "exponent"},
      {"[[lobe]]\nspecular = 0.1\nc = [-1, -1, -1]\n", "below the surface"},
      {"[[lobe]]\nspecular = 0.1\nc = [0, 0, 0]\n", "below the surface"},
      {"[[lobe]]\nspecular = 0.1\nc = [1, 1]\n", "c"},
      {"[[lobe]]\nspecular = 0.1\ngrazing = 2\n", "grazing"},
      {"[[lobe]]\nspecular = 0.1\nexponnt = 2\n", "exponent"},
      {"[[lobes]]\nspecular = 0.1\n", "lobe"},
      {"[[lobe]]\nmaterial = \"pant\"\nspecular = 0.1\n", "\"paint\", \"trim\""},
      {"[[lobe]]\nspecular = 0.1\nspecular_texture = \"gone.png\"\nmaterial = \"paint\"\n",
       "s.lobes.toml, material \"paint\", " + (folder_ / "gone.png").string()},
      {"[[lobe]]\nspecular = 0.1\nspecular_texture = \"words.png\"\nmaterial = \"paint\"\n", "words.png"},
      {"[[lobe]]\nspecular = 0.1\nspecular_texture = \"w.png\"\nmaterial = \"trim\"\n", "texture coordinates"},
      {"[[lobe]\n", "s.lobes.toml, line 1"}};
  for (const auto& [text, said] : cases) {
    const auto mesh = read(text);
    ASSERT_FALSE(mesh) << text;
    EXPECT_NE(mesh.error().message().find(said), std::string::npos) << text << mesh.error().message();
  }
}

} // namespace
} // namespace daylit
