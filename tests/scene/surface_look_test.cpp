// What a mesh looks like at a point: channels of textures, normal maps, tangents; and meshes that are changed.

#include "scene/model/surface_look.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>

#include "scene/material/library.h"
#include "scene/model/mesh_edit.h"
#include "scene/placing/read_object.h"

namespace daylit {
namespace {

/// Of one colour.
Texture plain(std::array<std::uint8_t, 3> c, TextureCoding coding = TextureCoding::linear) {
  return *Texture::make({1, 1, {c[0], c[1], c[2]}}, coding);
}

/// A square of one metre in the x-y plane that faces up, u to the right, v down (against y).
ObjectMesh square(ObjectMaterial m = {}) {
  ObjectMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.normals.assign(4, {0, 0, 1});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uv = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  mesh.materials = {std::move(m)};
  return mesh;
}

SurfaceLook middle(const ObjectMesh& mesh) { return surface_look(mesh, 0, 0.3f, 0.3f, 0.001f); }

TEST(SurfaceLook, every_channel_multiplies_what_it_belongs_to) {
  ObjectMaterial m{.base_colour = Rgb(1.0f, 0.5f, 0.25f),
                   .metallic = 0.8f,
                   .roughness = 0.5f,
                   .transmission = 0.5f,
                   .clearcoat = 0.9f,
                   .clearcoat_roughness = 0.7f,
                   .emission = Rgb(2.0f),
                   .occlusion_strength = 0.5f};
  for (TextureUse* use : m.texture_uses())
    use->texture = 0;
  m.normal_texture = {};
  m.base_colour_texture.texture = m.emission_texture.texture = 1;
  ObjectMesh mesh = square(m);
  mesh.textures = {plain({51, 102, 204}), plain({188, 188, 255}, TextureCoding::srgb)}; // 0.2 0.4 0.8; about 0.5 0.5 1
  const SurfaceMaterial at = middle(mesh).material;
  const float half = srgb_decode(188.0f / 255.0f);
  EXPECT_NEAR(at.base_colour.r, half, 1e-5f);
  EXPECT_NEAR(at.base_colour.b, 0.25f, 1e-5f);
  EXPECT_NEAR(at.metallic, 0.8f * 0.8f, 1e-5f) << "blue";
  EXPECT_NEAR(at.alpha_u, 0.2f * 0.2f, 1e-5f) << "green, squared";
  EXPECT_NEAR(at.transmission, 0.5f * 0.2f, 1e-5f) << "red";
  EXPECT_NEAR(at.clearcoat, 0.9f * 0.2f, 1e-5f) << "red";
  EXPECT_NEAR(at.clearcoat_alpha, 0.28f * 0.28f, 1e-5f) << "green";
  EXPECT_NEAR(at.occlusion, 0.6f, 1e-5f) << "half of what red takes away";
  EXPECT_NEAR(at.emission.g, 2.0f * half, 1e-5f);
}

TEST(SurfaceLook, the_smoothest_surface_has_the_least_slope) {
  EXPECT_EQ(middle(square({.roughness = 0.0f})).material.alpha_u, kLeastAlpha);
}

TEST(SurfaceLook, a_normal_map_tilts_towards_tangent_and_up_the_picture) {
  ObjectMaterial m;
  m.normal_texture.texture = 0;
  ObjectMesh mesh = square(m);
  mesh.textures = {plain({255, 128, 128})};
  set_tangents(mesh);
  ASSERT_EQ(mesh.tangents.size(), 4u);
  for (const glm::vec4& t : mesh.tangents)
    EXPECT_LT(glm::length(t - glm::vec4(1, 0, 0, 1)), 1e-6f) << "u grows along x; the bitangent is n x t";
  EXPECT_GT(middle(mesh).normal.x, 0.99f);
  mesh.textures = {plain({128, 255, 128})};
  EXPECT_GT(middle(mesh).normal.y, 0.99f) << "the second channel points up the picture";
  mesh.materials[0].normal_scale = 0.0f;
  EXPECT_GT(middle(mesh).normal.z, 0.999f);
  mesh.materials[0].normal_scale = 1.0f;
  mesh.textures = {plain({128, 128, 255})};
  EXPECT_GT(middle(mesh).normal.z, 0.9999f);
  EXPECT_NEAR(glm::dot(middle(mesh).normal, middle(mesh).tangent), 0.0f, 1e-6f);
}

TEST(SurfaceLook, a_mirrored_texture_mirrors_its_normals) {
  ObjectMaterial m;
  m.normal_texture.texture = 0;
  ObjectMesh mesh = square(m);
  for (glm::vec2& uv : mesh.uv)
    uv.x = 1.0f - uv.x;
  mesh.textures = {plain({255, 128, 128})};
  set_tangents(mesh);
  EXPECT_EQ(mesh.tangents[0].w, -1.0f);
  EXPECT_LT(middle(mesh).normal.x, -0.99f);
  mesh.textures = {plain({128, 255, 128})};
  EXPECT_GT(middle(mesh).normal.y, 0.99f) << "up the picture is still up";
}

TEST(SurfaceLook, a_turned_texture_turns_its_normals) {
  ObjectMaterial m;
  m.normal_texture.texture = 0;
  m.normal_texture.uv_from_mesh = glm::mat3({0, -1, 0}, {1, 0, 0}, {0, 0, 1}); // u grows with v: down, against y
  ObjectMesh mesh = square(m);
  mesh.textures = {plain({255, 128, 128})};
  set_tangents(mesh);
  EXPECT_LT(middle(mesh).normal.y, -0.99f);
}

TEST(SurfaceLook, anisotropy_is_wider_along_its_direction) {
  ObjectMaterial m{.metallic = 1.0f, .roughness = 0.5f, .anisotropy = 0.8f};
  ObjectMesh mesh = square(m);
  set_tangents(mesh);
  SurfaceLook look = middle(mesh);
  EXPECT_NEAR(look.material.alpha_v, 0.25f, 1e-6f);
  EXPECT_NEAR(look.material.alpha_u, 0.25f + 0.64f * 0.75f, 1e-6f) << "mix(alpha, 1, strength^2)";
  EXPECT_GT(look.tangent.x, 0.9999f);
  mesh.materials[0].anisotropy_rotation = 1.5707963f;
  EXPECT_GT(middle(mesh).tangent.y, 0.9999f) << "counter-clockwise";
  mesh.materials[0].anisotropy_texture.texture = 0;
  mesh.textures = {plain({128, 255, 128})}; // along the bitangent, half as strong
  look = middle(mesh);
  EXPECT_LT(look.tangent.x, -0.999f) << "the direction of the map, turned";
  EXPECT_NEAR(look.material.alpha_u, 0.25f + 0.16f * 0.75f, 3e-3f);
}

TEST(SurfaceLook, a_diffuse_material_has_no_interface) {
  EXPECT_EQ(middle(square()).material.ior, 1.0f);
  EXPECT_EQ(middle(square({.roughness = 0.5f})).material.ior, 1.5f);
}

TEST(SurfaceLook, a_mesh_without_materials_is_diffuse_of_its_vertices) {
  ObjectMesh mesh = square();
  mesh.materials.clear();
  mesh.uv.clear();
  mesh.reflectance = {Rgb(0.2f), Rgb(0.4f), Rgb(0.6f), Rgb(0.8f)};
  EXPECT_NEAR(middle(mesh).material.base_colour.r, 0.4f * 0.2f + 0.3f * 0.4f + 0.3f * 0.6f, 1e-6f);
  EXPECT_EQ(middle(mesh).material.base_colour, base_colour(mesh, 0, 0.3f, 0.3f, 0.0f));
}

TEST(SurfaceLook, the_footprint_counts_in_metres_of_the_mesh) {
  Rgb8Image checks{64, 64, {}};
  for (int k = 0; k < 64 * 64; ++k)
    for (int c = 0; c < 3; ++c)
      checks.bytes.push_back((k + k / 64) % 2 ? 255 : 0);
  for (const float size : {0.01f, 1.0f, 30.0f})
    for (const float repeats : {1.0f, 8.0f}) {
      ObjectMaterial m{.base_colour = Rgb(1.0f)};
      m.base_colour_texture = {0, glm::mat3(glm::vec3(repeats, 0, 0), glm::vec3(0, repeats, 0), glm::vec3(0, 0, 1))};
      ObjectMesh mesh = square(m);
      mesh.textures.push_back(*Texture::make(checks, TextureCoding::linear));
      for (glm::vec3& p : mesh.positions)
        p *= size;
      const float texel = size / (64.0f * repeats), next = 1.0f / (64.0f * repeats), middle_of = 0.5f * next;
      const auto contrast = [&](float footprint) { // of neighbours in the lowest row
        return std::fabs(base_colour(mesh, 0, 0.0f, middle_of, footprint).r -
                         base_colour(mesh, 0, next, middle_of, footprint).r);
      };
      EXPECT_GT(contrast(texel), 0.99f) << size << " m, " << repeats << " times";
      EXPECT_LT(contrast(2.0f * texel), 0.02f);
    }
}

TEST(MeshEdit, a_vertex_on_an_edge_has_all_of_its_ends) {
  ObjectMaterial m;
  m.normal_texture.texture = m.base_colour_texture.texture = 0;
  ObjectMesh mesh = square(m);
  mesh.textures = {plain({128, 128, 255})};
  mesh.colours = {Rgb(0.0f), Rgb(1.0f), Rgb(0.5f), Rgb(0.5f)};
  set_tangents(mesh);
  set_reflectance(mesh);
  const std::uint32_t v = add_between(mesh, 0, 1, 0.25f);
  EXPECT_EQ(v, 4u);
  EXPECT_EQ(mesh.positions[v], glm::vec3(0.25f, 0, 0));
  EXPECT_EQ(mesh.uv[v], glm::vec2(0.25f, 1.0f));
  EXPECT_EQ(mesh.colours[v], Rgb(0.25f));
  EXPECT_EQ(mesh.tangents[v], glm::vec4(1, 0, 0, 1));
  EXPECT_EQ(mesh.normals[v], glm::vec3(0, 0, 1));
  EXPECT_EQ(mesh.reflectance.size(), 5u);
}

TEST(MeshEdit, meshes_put_together_look_as_they_did_alone) {
  ObjectMaterial textured{.base_colour = Rgb(0.8f), .metallic = 1.0f, .roughness = 0.3f};
  textured.base_colour_texture.texture = 0;
  ObjectMesh a = square(textured), b = square({.base_colour = Rgb(0.3f)}), c = square(textured), all;
  a.textures = {plain({255, 0, 0})};
  c.textures = {plain({0, 0, 255})};
  b.uv.clear();
  b.materials.push_back({.base_colour = Rgb(0.1f)});
  b.triangle_material = {1, 0};
  for (ObjectMesh* part : {&a, &b, &c}) {
    set_reflectance(*part);
    const glm::dmat4 place =
        glm::translate(glm::dmat4(1.0), glm::dvec3(0, 0, static_cast<double>(all.positions.size())));
    ASSERT_TRUE(append_mesh(all, *part, place));
  }
  EXPECT_EQ(all.triangles.size(), 6u);
  EXPECT_EQ(all.uv.size(), all.positions.size());
  EXPECT_EQ(base_colour(all, 0, 0.3f, 0.3f, 0.0f), Rgb(0.8f, 0, 0));
  EXPECT_EQ(base_colour(all, 2, 0.3f, 0.3f, 0.0f), Rgb(0.1f));
  EXPECT_EQ(base_colour(all, 3, 0.3f, 0.3f, 0.0f), Rgb(0.3f));
  EXPECT_EQ(base_colour(all, 5, 0.3f, 0.3f, 0.0f), Rgb(0, 0, 0.8f));
  EXPECT_EQ(all.positions[9].z, 8.0f);
  EXPECT_EQ(all.material_or_null(4)->metallic, 1.0f);
  EXPECT_NEAR(surface_look(all, 5, 0.2f, 0.2f, 0.0f).material.alpha_u, 0.09f, 1e-6f);
}

TEST(MeshEdit, a_brushed_metal_without_texture_coordinates_is_brushed_around_its_axis) {
  ObjectMesh mesh;
  for (int k = 0; k < 12; ++k) { // a tube around z
    const float angle = 2.0f * 3.14159265f * static_cast<float>(k) / 12.0f;
    for (const float z : {0.0f, 1.0f}) {
      mesh.normals.emplace_back(std::cos(angle), std::sin(angle), 0.0f);
      mesh.positions.emplace_back(0.1f * std::cos(angle), 0.1f * std::sin(angle), z);
    }
  }
  for (std::uint32_t k = 0; k < 24; k += 2)
    mesh.triangles.push_back({k, (k + 2) % 24, k + 1});
  give_material(mesh, *library_material("brushed-steel"));
  const SurfaceLook look = surface_look(mesh, 0, 0.3f, 0.3f, 0.0f);
  EXPECT_GT(std::fabs(look.tangent.z), 0.999f) << "the highlight lies across the grooves, which run around";
  EXPECT_GT(look.material.alpha_u, 2.0f * look.material.alpha_v);
  EXPECT_NEAR(mesh.reflectance[0].r, (20.0f * 0.562f + 1.0f) / 21.0f, 1e-5f);
}

TEST(ReadObject, a_material_of_the_library_replaces_those_of_the_model) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "daylit-read-object";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "a.mtl") << "newmtl paint\nKd 0.2 0.3 0.4\n";
  std::ofstream(folder / "a.obj") << "mtllib a.mtl\nusemtl paint\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  ObjectConfig object;
  object.model = folder / "a.obj";
  EXPECT_EQ(read_object(object)->materials[0].base_colour, Rgb(0.2f, 0.3f, 0.4f));
  object.reflectance = Rgb(0.6f);
  EXPECT_EQ(read_object(object)->reflectance[0], Rgb(0.6f));
  EXPECT_FALSE(read_object(object)->materials[0].is_glossy()) << "a reflectance alone is diffuse";
  object.material = "porcelain";
  EXPECT_TRUE(read_object(object)->materials[0].is_glossy());
  EXPECT_EQ(read_object(object)->materials[0].base_colour, Rgb(0.6f)) << "porcelain of that colour";
  object.material = "porcelin";
  EXPECT_EQ(read_object(object).error().code, ErrorCode::not_found);
  std::filesystem::remove_all(folder);
}

} // namespace
} // namespace daylit
