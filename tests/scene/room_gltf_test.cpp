// glTF rooms: what is understood, and that hostile files end in an error.

#include <filesystem>
#include <fstream>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/image/image_formats.h"
#include "scene/room/room_formats.h"
#include "tests/scene/gltf_builder.h"

namespace daylit {
namespace {

using test::GltfParts;

const std::vector<glm::dvec3> kSquare = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
const std::vector<std::uint16_t> kTwo = {0, 1, 2, 0, 2, 3};
const char* const kWhite = R"({"name":"white","pbrMetallicRoughness":{"baseColorFactor":[0.8,0.7,0.6,1]}})";

Result<std::vector<std::uint8_t>> no_file(const std::string& name) {
  return Error{ErrorCode::file_missing, "no such file", name, ""};
}

Result<RoomFile> parse(const std::vector<std::uint8_t>& bytes) { return parse_gltf_room(bytes, "test.glb", no_file); }
Result<RoomFile> parse(const std::string& text) {
  return parse_gltf_room({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "test.gltf", no_file);
}

GltfParts square() {
  GltfParts parts;
  parts.add_material(kWhite);
  parts.add_mesh(kSquare, kTwo, 0);
  return parts;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST(RoomGltf, frame_is_turned_and_base_colour_is_the_reflectance) {
  GltfParts parts = square();
  parts.add_node(R"({"mesh":0})");
  const auto file = parse(parts.glb());
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_EQ(file->room.triangles.size(), 2u);
  EXPECT_EQ(file->room.vertices[2], glm::dvec3(2, 1, 0));
  EXPECT_EQ(file->room.materials[0].name, "white");
  EXPECT_FLOAT_EQ(file->room.materials[0].reflectance.g, 0.7f);
  EXPECT_GT(area_normal(file->room, file->room.triangles[0]).z, 0.0);
}

TEST(RoomGltf, nodes_are_instances_with_transforms_in_double) {
  GltfParts parts = square();
  // A turn of 90 degrees about the format's y axis (our z), ten kilometres east, under a parent scaled by two.
  parts.add_node(R"({"mesh":0})");
  parts.add_node(R"({"children":[2],"scale":[2,2,2]})");
  parts.add_node(
      R"({"mesh":0,"translation":[10000.0000001,0,0],"rotation":[0,0.7071067811865476,0,0.7071067811865476]})", false);
  const auto file = parse(parts.glb());
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->room.triangles.size(), 4u);
  // (2, 1, 0) -> turned (-1, 2, 0) -> moved -> scaled.
  EXPECT_LT(glm::distance(file->room.vertices[6], glm::dvec3(19998.0000002, 4, 0)), 1e-11);
}

TEST(RoomGltf, matrix_and_translation_rotation_scale_agree) {
  GltfParts parts = square();
  parts.add_node(R"({"mesh":0,"matrix":[0,0,-3,0, 0,3,0,0, 3,0,0,0, 5,6,7,1]})");
  parts.add_node(
      R"({"mesh":0,"translation":[5,6,7],"rotation":[0,0.7071067811865476,0,0.7071067811865476],"scale":[3,3,3]})");
  const auto file = parse(parts.glb());
  ASSERT_TRUE(file) << file.error().message();
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(glm::distance(file->room.vertices[k], file->room.vertices[k + 4]), 1e-12);
}

TEST(RoomGltf, windows_transmit_what_the_extensions_say) {
  GltfParts parts = square();
  parts.add_material(R"({"name":"window","pbrMetallicRoughness":{"baseColorFactor":[0.9,0.9,0.9,1]}})");
  parts.add_material(
      R"({"name":"window.001","pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0.5,1]},)"
      R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":0.8},"KHR_materials_ior":{"ior":1.52}}})");
  parts.add_mesh({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}}, {0, 1, 2}, 1);
  parts.add_mesh({{0, 0, 2}, {1, 0, 2}, {1, 1, 2}}, {0, 1, 2}, 2);
  for (int m = 0; m < 3; ++m)
    parts.add_node(fmt::format("{{\"mesh\":{}}}", m));
  const auto file = parse(parts.glb());
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_TRUE(file->room.materials[1].is_window && file->room.materials[2].is_window);
  EXPECT_EQ(file->room.materials[1].transmittance, Rgb(1.0f));
  EXPECT_FLOAT_EQ(file->room.materials[2].transmittance.g, 0.4f);
  EXPECT_FLOAT_EQ(file->room.materials[2].refractive_index, 1.52f);
}

TEST(RoomGltf, texture_counts_as_its_decoded_mean_and_is_reported) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "daylit_gltf";
  std::filesystem::create_directories(folder / "textures");
  // Half black, half white: linear mean one half whatever the transfer function.
  Rgb8Image image{2, 2, {0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 0}};
  ASSERT_TRUE(write_png(folder / "textures/chess.png", image));
  GltfParts parts;
  parts.add_material(
      R"({"name":"tiles","pbrMetallicRoughness":{"baseColorFactor":[0.8,0.4,1,1],"baseColorTexture":{"index":0}}})");
  parts.add_mesh(kSquare, kTwo, 0);
  parts.add_node(R"({"mesh":0})");
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"textures/chess.png"}])";
  const auto write = [&](const std::string& name) {
    const auto glb = parts.glb();
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(glb.data()), static_cast<std::streamsize>(glb.size()));
    return folder / name;
  };
  const auto file = read_room(write("room.glb"));
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_NEAR(file->room.materials[0].reflectance.r, 0.4, 1e-6);
  EXPECT_NEAR(file->room.materials[0].reflectance.b, 0.5, 1e-6);
  ASSERT_FALSE(file->report.notes.empty());
  EXPECT_NE(file->report.notes[0].find("mean"), std::string::npos);
  // Only beneath the folder of the model.
  for (const char* uri : {"../secret.png", "textures/../../secret.png", "/etc/hostname"}) {
    parts.more = fmt::format(R"(,"textures":[{{"source":0}}],"images":[{{"uri":"{}"}}])", uri);
    const auto outside = read_room(write("outside.glb"));
    ASSERT_FALSE(outside) << uri;
    EXPECT_NE(outside.error().message().find("outside its own folder"), std::string::npos) << outside.error().message();
  }
}

TEST(RoomGltf, text_form_with_an_external_buffer_equals_the_binary_form) {
  GltfParts parts = square();
  parts.add_node(R"({"mesh":0})");
  const std::string text = parts.json("room.bin");
  const auto file = parse_gltf_room({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "room.gltf",
                                    [&](const std::string& name) -> Result<std::vector<std::uint8_t>> {
                                      EXPECT_EQ(name, "room.bin");
                                      return parts.buffer;
                                    });
  const auto binary = parse(parts.glb());
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_TRUE(binary);
  EXPECT_EQ(file->content_hash, binary->content_hash);
}

TEST(RoomGltf, every_broken_reference_is_an_error) {
  GltfParts parts = square();
  parts.add_node(R"({"mesh":0,"children":[1]})");
  parts.add_node(R"({"name":"x"})", false);
  const std::string good = parts.json();
  ASSERT_TRUE(parse(parts.glb(good)));
  const std::vector<std::pair<std::string, std::string>> damage = {
      {R"("children":[1])", R"("children":[0])"},          // its own child
      {R"("children":[1])", R"("children":[7])"},          // not there
      {R"("children":[1])", R"("children":[-1])"},         //
      {R"("mesh":0)", R"("mesh":9)"},                      //
      {R"("POSITION":0)", R"("POSITION":5)"},              //
      {R"("POSITION":0)", R"("POSITION":1)"},              // indices as positions
      {R"("indices":1)", R"("indices":0)"},                // positions as indices
      {R"("material":0)", R"("material":3)"},              //
      {R"("count":4)", R"("count":400)"},                  // beyond the view
      {R"("count":4)", R"("count":3)"},                    // an index beyond the positions
      {R"("count":4)", R"("count":4611686018427387905)"},  // wraps around in 64 bit
      {R"("byteOffset":0)", R"("byteOffset":4000000000)"}, //
      {R"("byteLength":48)", R"("byteLength":4800)"},      //
      {R"("bufferView":0)", R"("bufferView":8)"},          //
      {R"("buffer":0)", R"("buffer":2)"},                  //
      {R"([0.8,0.7,0.6,1])", R"([1.8,0.7,0.6,1])"},        // reflects more than it receives
      {R"("version":"2.0"})", R"("version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"])"},
  };
  for (const auto& [from, to] : damage) {
    const auto file = parse(parts.glb(replaced(good, from, to)));
    EXPECT_FALSE(file) << to;
    if (!file) {
      EXPECT_FALSE(file.error().what.empty() || file.error().where.empty()) << to;
    }
  }
}

TEST(RoomGltf, deep_nesting_and_random_damage_never_crash) {
  EXPECT_FALSE(parse(std::string(100000, '[')));
  EXPECT_FALSE(parse(R"({"asset":{"version":"2.0"},"extras":)" + std::string(100000, '{')));
  EXPECT_FALSE(parse(std::string()));
  GltfParts parts = square();
  parts.add_node(R"({"mesh":0})");
  const std::vector<std::uint8_t> good = parts.glb();
  std::mt19937 random(7);
  for (int k = 0; k < 3000; ++k) {
    std::vector<std::uint8_t> bad = good;
    for (int n = 0; n <= k % 4; ++n)
      bad[random() % bad.size()] = static_cast<std::uint8_t>(random());
    if (k % 5 == 0)
      bad.resize(random() % bad.size());
    (void)static_cast<bool>(parse(bad));
  }
}

} // namespace
} // namespace daylit
