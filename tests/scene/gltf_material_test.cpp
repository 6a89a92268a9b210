// Materials of glTF: what is read, and what happens with what cannot be.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "gltf_builder.h"
#include "scene/image/image_formats.h"
#include "scene/model/object_mesh.h"
#include "scene/model/surface_look.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;

class GltfMaterial : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "daylit-material-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    ASSERT_TRUE(write_png(folder_ / "flat.png", {2,
                                                 3,
                                                 {128, 128, 255, 128, 128, 255, 128, 128, 255, //
                                                  128, 128, 255, 128, 128, 255, 128, 128, 255}}));
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// `more`: top-level members; `attributes`: beside position, normal.
  Result<ObjectMesh> read(const std::string& material, const std::string& more = kTexture,
                          const std::string& attributes = ",\"TEXCOORD_0\":2") {
    auto parts = test::square(material, attributes);
    parts.more = more;
    const std::vector<std::uint8_t> bytes = parts.glb();
    std::ofstream(folder_ / "a.glb", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    notes_.clear();
    return read_object_mesh(folder_ / "a.glb", Rgb(0.7f), &notes_);
  }
  void expect_error(const std::string& material, const std::string& in_message, const std::string& more = kTexture) {
    const auto mesh = read(material, more);
    ASSERT_FALSE(mesh) << material;
    EXPECT_NE(mesh.error().message().find(in_message), std::string::npos) << mesh.error().message();
    EXPECT_FALSE(mesh.error().where.empty());
  }
  bool noted(const std::string& text) const {
    for (const std::string& note : notes_)
      if (note.find(text) != std::string::npos)
        return true;
    return false;
  }

  static inline const std::string kTexture = R"(,"textures":[{"source":0}],"images":[{"uri":"flat.png"}])";
  fs::path folder_;
  std::vector<std::string> notes_;
};

std::string with_extension(const std::string& name, const std::string& body) {
  return fmt::format(R"({{"name":"cup","extensions":{{"{}":{}}}}})", name, body);
}

TEST_F(GltfMaterial, all_numbers_of_core_and_extensions_are_read) {
  const auto mesh = read(R"({"name":"cup","pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,1],
    "metallicFactor":0.25,"roughnessFactor":0.5},"emissiveFactor":[1,0.5,0],"extensions":{
    "KHR_materials_ior":{"ior":1.4},"KHR_materials_transmission":{"transmissionFactor":0.75},
    "KHR_materials_volume":{"thicknessFactor":0.01,"attenuationDistance":0.5,"attenuationColor":[0.5,0.25,1]},
    "KHR_materials_dispersion":{"dispersion":0.3},
    "KHR_materials_clearcoat":{"clearcoatFactor":0.6,"clearcoatRoughnessFactor":0.1},
    "KHR_materials_anisotropy":{"anisotropyStrength":0.7,"anisotropyRotation":0.4},
    "KHR_materials_emissive_strength":{"emissiveStrength":4}}})");
  ASSERT_TRUE(mesh) << mesh.error().message();
  ASSERT_EQ(mesh->materials.size(), 1u);
  const ObjectMaterial& m = mesh->materials[0];
  EXPECT_EQ(m, (ObjectMaterial{.name = "cup",
                               .base_colour = Rgb(0.1f, 0.2f, 0.3f),
                               .metallic = 0.25f,
                               .roughness = 0.5f,
                               .ior = 1.4f,
                               .transmission = 0.75f,
                               .attenuation_colour = Rgb(0.5f, 0.25f, 1.0f),
                               .attenuation_distance_m = 0.5f,
                               .dispersion = 0.3f,
                               .clearcoat = 0.6f,
                               .clearcoat_roughness = 0.1f,
                               .anisotropy = 0.7f,
                               .anisotropy_rotation = 0.4f,
                               .emission = Rgb(4.0f, 2.0f, 0.0f)}));
  EXPECT_NEAR(m.absorption_per_m().g, std::log(4.0f) / 0.5f, 1e-5f);
  EXPECT_TRUE(notes_.empty());
}

TEST_F(GltfMaterial, defaults_are_those_of_the_specification) {
  const auto mesh = read("{}");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->materials[0].metallic, 1.0f);
  EXPECT_EQ(mesh->materials[0].roughness, 1.0f);
  EXPECT_EQ(mesh->materials[0].base_colour, Rgb(1.0f));
  const auto glass = read(with_extension("KHR_materials_transmission", R"({"transmissionFactor":1})"));
  EXPECT_EQ(glass->materials[0].ior, 1.5f) << "transmission without KHR_materials_ior";
  EXPECT_TRUE(glass->materials[0].thin) << "without KHR_materials_volume light goes straight through";
  EXPECT_EQ(glass->materials[0].attenuation_distance_m, 0.0f);
  EXPECT_EQ(glass->materials[0].absorption_per_m(), Rgb(0.0f));
}

TEST_F(GltfMaterial, every_texture_is_found_and_a_picture_is_kept_once_for_each_meaning) {
  const auto mesh =
      read(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":0}},
    "normalTexture":{"index":0,"scale":0.5},"occlusionTexture":{"index":0,"strength":0.25},"emissiveTexture":{"index":0},
    "extensions":{"KHR_materials_transmission":{"transmissionTexture":{"index":0}},
    "KHR_materials_clearcoat":{"clearcoatTexture":{"index":0},"clearcoatRoughnessTexture":{"index":0}},
    "KHR_materials_anisotropy":{"anisotropyTexture":{"index":0}}}})");
  ASSERT_TRUE(mesh) << mesh.error().message();
  ObjectMaterial m = mesh->materials[0];
  EXPECT_EQ(std::ranges::count_if(m.texture_uses(), [](const TextureUse* use) { return static_cast<bool>(*use); }), 9)
      << "all but those of a lobe";
  EXPECT_EQ(mesh->textures.size(), 2u) << "as colours and as numbers";
  EXPECT_EQ(m.base_colour_texture.texture, m.emission_texture.texture);
  EXPECT_NE(m.base_colour_texture.texture, m.normal_texture.texture);
  EXPECT_EQ(m.normal_scale, 0.5f);
  EXPECT_EQ(m.occlusion_strength, 0.25f);
  EXPECT_EQ(mesh->textures[0].width(), 2) << "a picture need not be square";
  EXPECT_EQ(mesh->textures[0].height(), 3);
}

/// KhronosGroup/glTF-Sample-Models, TextureTransformTest: offset, counter-clockwise rotation with v down, scale.
TEST_F(GltfMaterial, texture_coordinates_are_transformed_as_khr_texture_transform_says) {
  const auto mesh =
      read(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":
    {"offset":[0.25,0.5],"rotation":0.5,"scale":[2,3]}}}}})");
  ASSERT_TRUE(mesh) << mesh.error().message();
  const glm::mat3& m = mesh->materials[0].base_colour_texture.uv_from_mesh;
  const glm::vec3 origin = m * glm::vec3(0, 0, 1), right = m * glm::vec3(1, 0, 1) - origin,
                  down = m * glm::vec3(0, 1, 1) - origin;
  EXPECT_LT(glm::length(origin - glm::vec3(0.25f, 0.5f, 1.0f)), 1e-6f);
  EXPECT_LT(glm::length(right - 2.0f * glm::vec3(std::cos(0.5f), -std::sin(0.5f), 0.0f)), 1e-6f);
  EXPECT_LT(glm::length(down - 3.0f * glm::vec3(std::sin(0.5f), std::cos(0.5f), 0.0f)), 1e-6f);
}

TEST_F(GltfMaterial, samplers_wrap) {
  const auto mesh = read(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})",
                         R"(,"textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":33071,"wrapT":33648}],)"
                         R"("images":[{"uri":"ramp.png"}])");
  EXPECT_FALSE(mesh) << "the picture is missing";
  EXPECT_NE(mesh.error().message().find("ramp.png"), std::string::npos) << mesh.error().message();
  ASSERT_TRUE(write_png(folder_ / "ramp.png", {2, 2, {0, 0, 0, 255, 255, 255, 0, 0, 0, 255, 255, 255}}));
  const auto read_now = read(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})",
                             R"(,"textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":33071,"wrapT":33648}],)"
                             R"("images":[{"uri":"ramp.png"}])");
  ASSERT_TRUE(read_now) << read_now.error().message();
  EXPECT_EQ(read_now->textures[0].at({3.0f, 0.5f}).r, 1.0f) << "held beyond the edge";
}

TEST_F(GltfMaterial, numbers_that_mean_nothing_are_errors) {
  expect_error(R"({"pbrMetallicRoughness":{"roughnessFactor":-0.5}})", "roughness is -0.5");
  expect_error(R"({"pbrMetallicRoughness":{"roughnessFactor":1.5}})", "roughness is 1.5");
  expect_error(R"({"pbrMetallicRoughness":{"metallicFactor":2}})", "metallic is 2");
  expect_error(R"({"pbrMetallicRoughness":{"baseColorFactor":[-1,0,0,1]}})", "base colour (red)");
  expect_error(R"({"emissiveFactor":[0,-1,0]})", "emission (green)");
  expect_error(
      R"({"emissiveFactor":[1,0,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":1e20}}})",
      "emission (red)"); // its square is no float
  expect_error(R"({"occlusionTexture":{"index":0,"strength":3}})", "occlusion");
  expect_error(with_extension("KHR_materials_ior", R"({"ior":0.5})"), "index of refraction");
  expect_error(with_extension("KHR_materials_ior", R"({"ior":"glass"})"), "ior is no number");
  expect_error(with_extension("KHR_materials_transmission", R"({"transmissionFactor":-1})"), "transmission is -1");
  expect_error(with_extension("KHR_materials_volume", R"({"attenuationDistance":0})"), "attenuation");
  expect_error(with_extension("KHR_materials_volume", R"({"attenuationColor":[1,2]})"), "attenuationColor");
  expect_error(with_extension("KHR_materials_volume", R"({"attenuationColor":[1,2,1]})"), "attenuation colour (green)");
  expect_error(with_extension("KHR_materials_clearcoat", R"({"clearcoatFactor":9})"), "clear coat");
  expect_error(with_extension("KHR_materials_anisotropy", R"({"anisotropyStrength":-9})"), "anisotropy");
  expect_error(with_extension("KHR_materials_dispersion", R"({"dispersion":-1})"), "dispersion");
  expect_error(with_extension("KHR_materials_emissive_strength", R"({"emissiveStrength":"x"})"), "no number");
  expect_error(with_extension("KHR_materials_ior", R"({"ior":0.2})"), "material 0 \"cup\"");
}

TEST_F(GltfMaterial, a_member_of_another_type_is_an_error_and_not_the_default) {
  const std::string place = "a.glb, material 0 \"cup\": ";
  expect_error(R"({"name":"cup","pbrMetallicRoughness":{"roughnessFactor":"smooth"}})",
               place + "roughnessFactor is \"smooth\", not a number");
  expect_error(R"({"name":"cup","pbrMetallicRoughness":{"metallicFactor":[1]}})", place + "metallicFactor is [1], not");
  expect_error(R"({"name":"cup","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25]}})",
               place + "baseColorFactor is [0.5,0.25], not 4 numbers");
  expect_error(R"({"name":"cup","pbrMetallicRoughness":{"baseColorFactor":[1,1,"a",1]}})", "not 4 numbers");
  expect_error(R"({"name":"cup","pbrMetallicRoughness":{"baseColorTexture":{"index":"a"}}})", "index of a texture");
  expect_error(R"({"name":"cup","pbrMetallicRoughness":3})", place + "pbrMetallicRoughness is 3, not an object");
  expect_error(R"({"name":"cup","emissiveFactor":[1,1]})", "emissiveFactor is [1,1], not 3 numbers");
  expect_error(R"({"name":"cup","normalTexture":{"index":0,"scale":"x"}})", "scale is \"x\", not a number");
  expect_error(R"({"name":"cup","extensions":{"KHR_materials_ior":1.4}})", "KHR_materials_ior is 1.4, not an object");
}

TEST_F(GltfMaterial, a_picture_that_cannot_be_read_is_named_with_its_model_and_material) {
  const std::string material = R"({"name":"cup","pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
  std::ofstream(folder_ / "words.png") << "no picture";
  expect_error(material, "a.glb, material 0 \"cup\", words.png: neither a PNG nor a JPEG",
               R"(,"textures":[{"source":0}],"images":[{"uri":"words.png"}])");
  expect_error(material, "a.glb, material 0 \"cup\", image 0: neither a PNG nor a JPEG",
               R"(,"textures":[{"source":0}],"images":[{"bufferView":0,"mimeType":"image/png"}])");
  expect_error(material, "a.glb, " + (folder_ / "gone.png").string() + ": cannot open",
               R"(,"textures":[{"source":0}],"images":[{"uri":"gone.png"}])");
}

TEST_F(GltfMaterial, textures_that_cannot_be_used_are_errors) {
  const std::string base = R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":)";
  expect_error(base + "4}}}", "texture that is not there");
  expect_error(base + "0}}}", "image", R"(,"textures":[{"source":5}],"images":[{"uri":"flat.png"}])");
  expect_error(base + "0}}}", "sampler that is not there",
               R"(,"textures":[{"source":0,"sampler":2}],"images":[{"uri":"flat.png"}])");
  expect_error(base + "0}}}", "wrap mode",
               R"(,"textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":7}],)"
               R"("images":[{"uri":"flat.png"}])");
  expect_error(base + "0}}}", "EXT_texture_webp", R"(,"textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}])");
  expect_error(base + R"(0,"extensions":{"KHR_texture_transform":{"scale":[1]}}}}})", "scale");
  expect_error(base + R"(0,"extensions":{"KHR_texture_transform":{"offset":[1e30,0]}}}}})", "KHR_texture_transform");
  expect_error(with_extension("KHR_materials_transmission", R"({"transmissionTexture":{"index":"a"}})"),
               "transmissionTexture");
}

TEST_F(GltfMaterial, a_picture_of_16k_is_refused_before_it_is_decoded) {
  std::ifstream file(folder_ / "flat.png", std::ios::binary);
  std::vector<char> png((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const unsigned char header[] = {0, 0, 0x40, 0, 0, 0, 0x40, 0, 8, 2, 0, 0, 0, 0x26, 0xaa, 0x87, 0xd3}; // and its CRC
  std::copy(std::begin(header), std::end(header), png.begin() + 16);
  std::ofstream(folder_ / "large.png", std::ios::binary).write(png.data(), static_cast<std::streamsize>(png.size()));
  const auto mesh = read(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})",
                         R"(,"textures":[{"source":0}],"images":[{"uri":"large.png"}])");
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::limit_exceeded) << mesh.error().message();
  EXPECT_NE(mesh.error().message().find("16384 x 16384"), std::string::npos) << mesh.error().message();
}

TEST_F(GltfMaterial, an_unknown_extension_is_an_error_where_it_is_required_and_a_note_where_not) {
  for (const char* name : {"KHR_materials_sheen", "EXT_mesh_gpu_instancing", "KHR_draco_mesh_compression"}) {
    expect_error("{}", name, fmt::format(R"(,"extensionsRequired":["{}"],"extensionsUsed":["{}"])", name, name));
  }
  for (const char* name : {"KHR_materials_ior", "KHR_materials_dispersion", "KHR_texture_transform"})
    EXPECT_TRUE(read("{}", fmt::format(R"(,"extensionsRequired":["{}"])", name))) << name;
  EXPECT_TRUE(read(with_extension("KHR_materials_sheen", R"({"sheenColorFactor":[1,1,1]})")));
  EXPECT_TRUE(noted("KHR_materials_sheen is not read"));
}

TEST_F(GltfMaterial, without_texture_coordinates_the_factors_count_and_that_is_said) {
  const auto mesh = read(R"({"name":"cup","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0,
    "baseColorTexture":{"index":0}}})",
                         kTexture, "");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->reflectance[0], Rgb(0.5f));
  EXPECT_FALSE(mesh->materials[mesh->triangle_material[0]].base_colour_texture);
  EXPECT_TRUE(noted("without texture coordinates")) << "cup";
}

TEST_F(GltfMaterial, a_texture_of_another_set_of_coordinates_is_left_out_and_that_is_said) {
  const auto mesh = read(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"occlusionTexture":{"index":0,
    "texCoord":1}})");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_TRUE(mesh->materials[0].base_colour_texture);
  EXPECT_FALSE(mesh->materials[0].occlusion_texture);
  EXPECT_TRUE(noted("another set"));
}

TEST_F(GltfMaterial, a_normal_map_saved_as_a_colour_picture_is_noted) {
  const std::string material = R"({"normalTexture":{"index":0}})";
  ASSERT_TRUE(read(material));
  EXPECT_FALSE(noted("normal map"));
  ASSERT_TRUE(write_png(folder_ / "srgb.png", {1, 1, {188, 188, 255}})); // 0.5 0.5 1 encoded as sRGB
  ASSERT_TRUE(read(material, R"(,"textures":[{"source":0}],"images":[{"uri":"srgb.png"}])"));
  EXPECT_TRUE(noted("normal map leans"));
}

TEST_F(GltfMaterial, alpha_is_said_to_be_left_out) {
  ASSERT_TRUE(read(R"({"alphaMode":"BLEND"})"));
  EXPECT_TRUE(noted("alpha is not read"));
}

TEST_F(GltfMaterial, anisotropy_without_a_texture_follows_the_texture_coordinates) {
  const auto mesh = read(with_extension("KHR_materials_anisotropy", R"({"anisotropyStrength":0.5})"), "");
  ASSERT_TRUE(mesh) << mesh.error().message();
  const SurfaceLook look = surface_look(*mesh, 0, 0.3f, 0.3f, 0.01f);
  EXPECT_GT(look.tangent.x, 0.9999f) << "u grows along x";
  EXPECT_TRUE(mesh->uv.empty());
}

TEST_F(GltfMaterial, tangents_of_the_file_count) {
  auto parts = test::square(with_extension("KHR_materials_anisotropy", R"({"anisotropyStrength":0.5})"),
                            ",\"TEXCOORD_0\":2,\"TANGENT\":5");
  parts.add_accessor(parts.add_view(std::vector<float>{0, 1, 0, -1, 0, 1, 0, -1, 0, 1, 0, -1, 0, 1, 0, -1}), 5126, 4,
                     "VEC4");
  const std::vector<std::uint8_t> bytes = parts.glb();
  std::ofstream(folder_ / "a.glb", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto mesh = read_object_mesh(folder_ / "a.glb");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->tangents[0], glm::vec4(0, 0, 1, -1)) << "y of the file is z of the world";
}

TEST_F(GltfMaterial, damaged_materials_are_refused_or_give_finite_looks) {
  const std::string transform = R"({"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.1,0.2],"rotation":1,)"
                                R"("scale":[2,3],"texCoord":0}}})";
  auto parts = test::square(
      R"({"emissiveFactor":[1,1,1],"pbrMetallicRoughness":{"roughnessFactor":0.5,"metallicFactor":0.5,"baseColorTexture":)" +
          transform + R"(},"normalTexture":)" + transform +
          R"(,"extensions":{"KHR_materials_ior":{"ior":1.4},"KHR_materials_transmission":{"transmissionFactor":0.5,)"
          R"("transmissionTexture":{"index":0}},"KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2,)"
          R"("attenuationColor":[1,0.5,0.2]},"KHR_materials_clearcoat":{"clearcoatFactor":1},)"
          R"("KHR_materials_anisotropy":{"anisotropyStrength":0.5,"anisotropyRotation":3}}})",
      ",\"TEXCOORD_0\":2,\"COLOR_0\":4");
  parts.more = R"(,"textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":33071}],"images":[{"uri":"flat.png"}])";
  const std::string good = parts.json("buffer.bin");
  std::ofstream(folder_ / "buffer.bin", std::ios::binary)
      .write(reinterpret_cast<const char*>(parts.buffer.data()), static_cast<std::streamsize>(parts.buffer.size()));
  std::mt19937 random(11);
  const char letters[] = "0123456789-.eE[]{}\"null";
  int read = 0;
  for (int k = 0; k < 1500; ++k) {
    std::string bad = good;
    for (int n = 0; n < 1 + k % 3; ++n)
      bad[good.find("\"materials\"") + random() % 900] = letters[random() % (sizeof(letters) - 1)];
    std::ofstream(folder_ / "bad.gltf") << bad;
    const auto mesh = read_object_mesh(folder_ / "bad.gltf");
    if (!mesh)
      continue;
    ++read;
    const SurfaceLook look = surface_look(*mesh, 0, 0.3f, 0.3f, 0.01f);
    const SurfaceMaterial& m = look.material;
    ASSERT_TRUE(std::isfinite(look.normal.x + look.tangent.y + m.absorption_per_m.r + m.emission.g + m.ior)) << bad;
    for (const float v : {m.base_colour.r, m.metallic, m.alpha_u, m.alpha_v, m.transmission, m.clearcoat, m.occlusion})
      ASSERT_TRUE(v >= 0.0f && v <= 1.0f) << v << " " << bad;
  }
  EXPECT_GT(read, 30) << "some damage is harmless";
}

} // namespace
} // namespace daylit
