#include "runtime/object/divide_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/model/mesh_edit.h"
#include "scene/model/surface_look.h"

namespace daylit {
namespace {

/// A box of that size, its corners shared, normals from the middle.
ObjectMesh box(const glm::vec3& size) {
  ObjectMesh mesh;
  for (int k = 0; k < 8; ++k) {
    mesh.positions.push_back(size * glm::vec3(k & 1, k >> 1 & 1, k >> 2 & 1));
    mesh.normals.push_back(glm::normalize(mesh.positions.back() - 0.5f * size));
    mesh.reflectance.emplace_back(0.1f * static_cast<float>(k));
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

double area(const ObjectMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += 0.5 * static_cast<double>(glm::length(glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                                                            mesh.positions[t[2]] - mesh.positions[t[0]])));
  return sum;
}

TEST(DivideMesh, no_edge_is_longer_than_a_sixth_of_the_radius_and_the_surface_stays_closed) {
  const glm::vec3 size(0.3f, 0.2f, 0.9f);
  ObjectMesh mesh = box(size);
  const double before = area(mesh);
  divide_coarse_mesh(mesh);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  float longest = 0;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      longest = std::max(longest, glm::distance(mesh.positions[a], mesh.positions[b]));
      ++sides[std::minmax(a, b)];
    }
  EXPECT_LE(longest, 0.5f * glm::length(size) / 6.0f * 1.0001f);
  EXPECT_NEAR(area(mesh), before, 1e-5 * before);
  EXPECT_TRUE(std::ranges::all_of(sides, [](const auto& side) { return side.second == 2; }));
  EXPECT_EQ(mesh.positions.size(), mesh.normals.size());
  EXPECT_EQ(mesh.positions.size(), mesh.reflectance.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    ASSERT_NEAR(glm::length(mesh.normals[i]), 1.0f, 1e-5f);
}

TEST(DivideMesh, a_fine_mesh_keeps_every_vertex_and_an_empty_one_is_left) {
  ObjectMesh mesh = box({1, 1, 1});
  divide_coarse_mesh(mesh);
  const ObjectMesh fine = mesh;
  divide_coarse_mesh(mesh);
  EXPECT_EQ(mesh.positions, fine.positions);
  EXPECT_EQ(mesh.triangles, fine.triangles);
  ObjectMesh none;
  divide_coarse_mesh(none);
  EXPECT_TRUE(none.positions.empty());
}

/// Each face with its own corners.
void add_flat_box(ObjectMesh& mesh, const glm::vec3& low, const glm::vec3& high) {
  for (int axis = 0; axis < 3; ++axis)
    for (const bool up : {false, true}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (int k = 0; k < 4; ++k) {
        glm::vec3 p = low, n(0.0f);
        p[axis] = up ? high[axis] : low[axis];
        p[u] = k & 1 ? high[u] : low[u];
        p[v] = k >> 1 ? high[v] : low[v];
        n[axis] = up ? 1.0f : -1.0f;
        mesh.positions.push_back(p);
        mesh.normals.push_back(n);
        mesh.reflectance.emplace_back(0.5f);
      }
      mesh.triangles.push_back({first, first + (up ? 1u : 2u), first + (up ? 2u : 1u)});
      mesh.triangles.push_back({first + 3, first + (up ? 2u : 1u), first + (up ? 1u : 2u)});
    }
}

std::ptrdiff_t vertices_within(const ObjectMesh& mesh, const glm::vec3& x, float reach) {
  return std::ranges::count_if(mesh.positions, [&](const glm::vec3& p) { return glm::distance(p, x) < reach; });
}

TEST(DivideMesh, vertices_are_close_around_a_joint_and_not_away_from_it) {
  ObjectMesh post;
  add_flat_box(post, {0, 0, 0}, {0.04f, 0.04f, 1.0f});
  ObjectMesh joined = post;
  add_flat_box(joined, {0.04f, 0.005f, 0.48f}, {0.5f, 0.035f, 0.52f}); // touches it and shares no corner
  const double before = area(joined);
  divide_coarse_mesh(post);
  divide_coarse_mesh(joined);
  const glm::vec3 at_joint(0.04f, 0.02f, 0.54f), away(0.04f, 0.02f, 0.9f);
  EXPECT_GE(vertices_within(joined, at_joint, 0.04f), 2 * vertices_within(post, at_joint, 0.04f));
  EXPECT_LE(vertices_within(joined, away, 0.04f), vertices_within(post, away, 0.04f));
  EXPECT_NEAR(area(joined), before, 1e-5 * before);
}

TEST(DivideMesh, the_sides_of_a_crate_have_vertices_close_above_the_floor) {
  ObjectMesh crate;
  add_flat_box(crate, {0, 0, 0.3f}, {1, 1, 1.3f});
  divide_coarse_mesh(crate);
  const float radius = 0.5f * std::sqrt(3.0f);
  const auto inside = [&](float low) { // of a side, above its lower edge
    return std::ranges::count_if(crate.positions, [&](const glm::vec3& p) {
      return p.x == 1.0f && p.y > 0.0f && p.y < 1.0f && p.z > low && p.z <= low + radius / 12.0f;
    });
  };
  EXPECT_GE(inside(0.3f), 2 * inside(0.8f));
}

TEST(DivideMesh, a_gap_that_is_everywhere_as_wide_costs_few_vertices) {
  ObjectMesh plates, one;
  add_flat_box(plates, {0, 0, 0}, {1, 1, 0.02f});
  add_flat_box(plates, {0, 0, 0.0202f}, {1, 1, 0.0402f});
  add_flat_box(one, {0, 0, 0}, {1, 1, 0.0402f});
  divide_coarse_mesh(plates);
  divide_coarse_mesh(one);
  EXPECT_LE(plates.positions.size(), 3 * one.positions.size());
}

/// A sheet of one metre, its two triangles of two materials, a checker pattern on it.
ObjectMesh patterned_sheet() {
  ObjectMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  for (const glm::vec3& p : mesh.positions) {
    mesh.normals.emplace_back(0, 0, 1);
    mesh.uv.emplace_back(p.x, 1.0f - p.y);
    mesh.colours.emplace_back(p.x);
  }
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  mesh.triangle_material = {0, 1};
  mesh.materials.resize(2);
  for (ObjectMaterial& m : mesh.materials)
    m.base_colour_texture.texture = m.normal_texture.texture = 0;
  Rgb8Image checks{32, 32, {}};
  for (int k = 0; k < 32 * 32; ++k)
    for (int c = 0; c < 3; ++c)
      checks.bytes.push_back((k + k / 32) % 2 ? 255 : 0);
  mesh.textures.push_back(*Texture::make(checks, TextureCoding::linear));
  set_tangents(mesh);
  set_reflectance(mesh);
  return mesh;
}

TEST(DivideMesh, a_pattern_stays_where_it_is) {
  ObjectMesh mesh = patterned_sheet();
  divide_coarse_mesh(mesh);
  ASSERT_GT(mesh.triangles.size(), 100u);
  ASSERT_EQ(mesh.triangle_material.size(), mesh.triangles.size());
  for (const std::size_t size : {mesh.uv.size(), mesh.colours.size(), mesh.tangents.size(), mesh.reflectance.size()})
    ASSERT_EQ(size, mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const glm::vec3& p = mesh.positions[v];
    EXPECT_LT(glm::distance(mesh.uv[v], glm::vec2(p.x, 1.0f - p.y)), 1e-6f);
    EXPECT_NEAR(mesh.colours[v].r, p.x, 1e-6f);
    EXPECT_LT(glm::distance(mesh.tangents[v], glm::vec4(1, 0, 0, 1)), 1e-5f);
    EXPECT_NEAR(mesh.reflectance[v].r, 0.7f * 0.5f * p.x, 0.02f) << "half of the texels around";
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& v = mesh.triangles[t];
    const glm::vec3 p = (mesh.positions[v[0]] + mesh.positions[v[1]] + mesh.positions[v[2]]) / 3.0f;
    EXPECT_EQ(mesh.triangle_material[t], p.y > p.x ? 1 : 0);
    const float texel = mesh.textures[0].at({p.x, 1.0f - p.y}).r;
    EXPECT_NEAR(base_colour(mesh, t, 1.0f / 3.0f, 1.0f / 3.0f, 0.0f).r, 0.7f * texel * p.x, 1e-3f);
  }
}

} // namespace
} // namespace daylit
