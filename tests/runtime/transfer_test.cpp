#include <atomic>
#include <cstring>
#include <filesystem>
#include <random>

#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>

#include "object_shapes.h"
#include "runtime/object/cut_mesh.h"
#include "runtime/object/mesh_topology.h"
#include "runtime/object/transfer.h"
#include "scene/core/atomic_file.h"
#include "scene/core/checksum.h"
#include "scene/core/read_file.h"
#include "sh/sh9.h"
#include "test_scene.h"

namespace daylit {
namespace {

std::filesystem::path scratch_folder() {
  const auto folder = std::filesystem::path(DAYLIT_BINARY_DIR) / "scratch" /
                      ::testing::UnitTest::GetInstance()->current_test_info()->name();
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

TEST(Transfer, a_convex_object_has_the_unshadowed_vector) {
  // C_lm = A_l Y_lm(n): no ray may be blocked, although the facets lie below the smooth normals' tangent planes.
  const ObjectMesh sphere = test::torus(0.0f, 0.2f, 16, 8);
  const auto transfer = compute_transfer(sphere);
  ASSERT_TRUE(transfer);
  for (std::size_t i = 0; i < sphere.positions.size(); ++i) {
    const auto y = sh::evaluate9<double>(glm::dvec3(sphere.normals[i]));
    for (int c = 0; c < 9; ++c)
      EXPECT_NEAR((*transfer)[i].front[c], sh::kClampedCosine9<double>[c] * y[c], 1e-6) << "vertex " << i;
  }
}

// The wall's front faces away from the vertex: shells block from both sides.
TEST(Transfer, a_wall_beside_a_vertex_takes_half_of_its_light) {
  // A floor vertex at the foot of an infinite wall sees the half space x < 0: with Y_00 constant, half of pi Y_00 is
  // left; Y_11 ~ x keeps the integral over x < 0 of its odd part, - c1 integral over a quarter sphere cos x = - c1 2/3.
  ObjectMesh mesh;
  mesh.positions = {{0, 0, 0}, {0.001f, -20, -1}, {0.001f, 20, -1}, {0.001f, 0, 40}};
  mesh.normals = {{0, 0, 1}, {-1, 0, 0}, {-1, 0, 0}, {-1, 0, 0}};
  mesh.reflectance.assign(4, Rgb(0.5f));
  mesh.triangles = {{1, 3, 2}};
  const auto transfer = compute_transfer(mesh, {4096});
  ASSERT_TRUE(transfer);
  EXPECT_NEAR((*transfer)[0].front[0], 0.5 * std::numbers::pi * 0.28209479, 0.01);
  EXPECT_NEAR((*transfer)[0].front[3], -0.48860251 * 2.0 / 3.0, 0.01);
}

// Two sheets that touch along an edge, each with vertices of its own there, which lie in the plane of the other sheet.
TEST(Transfer, a_sheet_that_touches_another_takes_half_of_the_light_at_their_edge) {
  for (int k = 0; k < 16; ++k) { // either face of the wall is met, however both are turned
    const float side = k % 2 ? 1.0f : -1.0f, a = 0.7f * static_cast<float>(k);
    const glm::mat3 turn(glm::rotate(glm::mat4(1.0f), a, glm::normalize(glm::vec3(1, 2, 3))));
    ObjectMesh mesh;
    mesh.positions = {{0, 0, 0}, {0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -20, 0}, {0, 20, 0}, {0, 0, 40}, {0, 0, 0}};
    mesh.normals.assign(4, {0, 0, 1});
    mesh.normals.insert(mesh.normals.end(), 4, {side, 0, 0});
    for (glm::vec3& p : mesh.positions)
      p = turn * p;
    for (glm::vec3& n : mesh.normals)
      n = turn * n;
    mesh.reflectance.assign(8, Rgb(0.5f));
    mesh.triangles = {{0, 3, 1}, {0, 2, 3}, {4, 6, 7}, {7, 6, 5}};
    if (side > 0.0f)
      for (std::size_t i : {2, 3})
        std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    const auto transfer = compute_transfer(mesh, {4096});
    ASSERT_TRUE(transfer);
    EXPECT_NEAR((*transfer)[0].front[0], 0.5 * std::numbers::pi * 0.28209479, 0.01) << k;
  }
}

TEST(Transfer, a_torus_shadows_its_own_inside) {
  const ObjectMesh mesh = test::torus(0.15f, 0.06f);
  const auto transfer = compute_transfer(mesh);
  ASSERT_TRUE(transfer);
  const float open = std::numbers::pi_v<float> * 0.28209479f;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const float c = (*transfer)[i].front[0];
    EXPECT_LE(c, open * 1.0001f);
    const glm::vec2 outward = glm::normalize(glm::vec2(mesh.positions[i]));
    const float faces_out = glm::dot(outward, glm::vec2(mesh.normals[i]));
    if (faces_out > 0.99f) {
      EXPECT_NEAR(c, open, 1e-4f);
    }
    if (faces_out < -0.99f) {
      EXPECT_LT(c, 0.8f * open);
    }
  }
}

TEST(Transfer, a_closed_mesh_has_no_back_and_seams_leave_it_closed) {
  const ObjectMesh ring = test::torus(0.15f, 0.06f, 12, 8); // vertices are double along two seams, but for rounding
  ObjectMesh seamed = ring;
  for (std::size_t i = 0; i < seamed.positions.size(); ++i) {
    const auto column = i / 9 % 12, row = i % 9 % 8;
    seamed.positions[i] = ring.positions[column * 9 + row];
  }
  EXPECT_TRUE(is_closed(seamed));
  EXPECT_FALSE(is_closed(test::bowl(0.25f)));
  const auto transfer = compute_transfer(seamed, {.closed = true});
  ASSERT_TRUE(transfer);
  for (const VertexTransfer& t : *transfer)
    EXPECT_EQ(t.back, TransferVector{});
}

TEST(Transfer, of_a_closed_mesh_wound_inwards_backs_are_seen) {
  ObjectMesh ring = test::torus(0.15f, 0.06f, 12, 8);
  for (std::size_t i = 0; i < ring.positions.size(); ++i)
    ring.positions[i] = glm::vec3(ring.positions[i / 9 % 12 * 9 + i % 9 % 8]);
  const std::size_t vertices = ring.positions.size(), triangles = ring.triangles.size();
  ASSERT_TRUE(is_closed(ring));
  for (std::size_t i = 0; i < vertices; ++i) { // a second one beside it
    ring.positions.push_back(ring.positions[i] + glm::vec3(1.0f, 0.0f, 0.0f));
    ring.normals.push_back(ring.normals[i]);
  }
  const auto first = static_cast<std::uint32_t>(vertices);
  for (std::size_t t = 0; t < triangles; ++t)
    ring.triangles.push_back(
        {ring.triangles[t][0] + first, ring.triangles[t][1] + first, ring.triangles[t][2] + first});
  EXPECT_TRUE(is_closed(ring));
  for (std::size_t t = triangles; t < ring.triangles.size(); ++t)
    std::swap(ring.triangles[t][1], ring.triangles[t][2]);
  EXPECT_FALSE(is_closed(ring));
}

TEST(Transfer, stops_when_asked_and_leaves_no_file) {
  const auto folder = scratch_folder();
  std::atomic<int> calls = 0; // progress is reported from every worker
  const auto stop = [&](const std::string&, double) { return ++calls < 3; };
  const auto transfer = cached_transfer(test::torus(0.15f, 0.06f), folder, "torus", {}, stop);
  ASSERT_FALSE(transfer);
  EXPECT_EQ(transfer.error().code, ErrorCode::interrupted);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

double area(const ObjectMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles)
    sum += 0.5 * glm::length(glm::cross(glm::dvec3(mesh.positions[t[1]] - mesh.positions[t[0]]),
                                        glm::dvec3(mesh.positions[t[2]] - mesh.positions[t[0]])));
  return sum;
}

bool on_pipe(const glm::vec3& p) {
  return p.x > 0.05f && std::hypot(p.y, p.z) > 0.0275f && std::hypot(p.y, p.z) < 0.0301f;
}

TEST(CutMesh, no_triangle_of_a_pipe_leads_from_inside_a_pot_to_its_outside) {
  const ObjectMesh before = test::pot_with_pipe();
  ObjectMesh mesh = before;
  const auto cuts = cut_where_parts_cross(mesh);
  ASSERT_TRUE(cuts);
  EXPECT_GE(*cuts, 16u); // along the pipe 8 edges, and 8 across its quadrilaterals
  std::size_t crossing = 0, turned = 0;
  for (const auto& t : mesh.triangles) {
    const glm::vec3 p[3] = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    if (!on_pipe(p[0]) || !on_pipe(p[1]) || !on_pipe(p[2]))
      continue;
    const auto [least, most] = std::minmax({glm::length(p[0]), glm::length(p[1]), glm::length(p[2])});
    crossing += least < 0.195f && most > 0.205f; // the ball's facets lie within 0.9 mm of it
    turned += glm::dot(glm::cross(p[1] - p[0], p[2] - p[0]), mesh.normals[t[0]] + mesh.normals[t[1]]) < 0.0f;
  }
  EXPECT_EQ(crossing, 0u);
  EXPECT_EQ(turned, 0u);
  EXPECT_NEAR(area(mesh), area(before), 0.003 * area(before)); // the slits
}

TEST(CutMesh, textures_and_materials_stay_where_they_are) {
  ObjectMesh mesh = test::pot_with_pipe();
  for (const glm::vec3& p : mesh.positions)
    mesh.uv.emplace_back(2.0f * p.x, p.y - p.z);
  mesh.materials.resize(2);
  const auto pipe = [&](const auto& t) {
    return std::ranges::all_of(t, [&](std::uint32_t v) { return on_pipe(mesh.positions[v]); });
  };
  for (const auto& t : mesh.triangles)
    mesh.triangle_material.push_back(pipe(t) ? 1 : 0);
  ASSERT_TRUE(cut_where_parts_cross(mesh));
  ASSERT_EQ(mesh.uv.size(), mesh.positions.size());
  ASSERT_EQ(mesh.triangle_material.size(), mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const glm::vec3& p = mesh.positions[v];
    EXPECT_LT(glm::distance(mesh.uv[v], glm::vec2(2.0f * p.x, p.y - p.z)), 1e-6f);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    EXPECT_EQ(mesh.triangle_material[t], pipe(mesh.triangles[t]) ? 1 : 0);
}

TEST(CutMesh, what_nothing_crosses_stays_as_it_is) {
  ObjectMesh mesh = test::torus(0.15f, 0.06f);
  const ObjectMesh before = mesh;
  const auto cuts = cut_where_parts_cross(mesh);
  ASSERT_TRUE(cuts);
  EXPECT_EQ(*cuts, 0u);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

TEST(CutMesh, a_pipe_is_lit_up_to_the_pot_and_dark_inside) {
  ObjectMesh mesh = test::pot_with_pipe();
  ASSERT_TRUE(cut_where_parts_cross(mesh));
  const auto transfer = compute_transfer(mesh);
  ASSERT_TRUE(transfer);
  const float open = std::numbers::pi_v<float> * 0.28209479f;
  std::size_t lit = 0, dark = 0; // of the cuts, whose two sides lie in pairs along the pipe
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const glm::vec3& p = mesh.positions[i];
    const float r = glm::length(p), share = (*transfer)[i].front[0] / open;
    if (!on_pipe(p) || std::fabs(mesh.normals[i].x) > 0.01f || r < 0.195f || r > 0.205f)
      continue;
    lit += share > 0.35f; // half of the sky
    dark += share < 0.1f;
  }
  EXPECT_GE(lit, 16u);
  EXPECT_EQ(lit, dark);
}

TEST(TransferFile, a_second_run_reads_what_the_first_computed) {
  const auto folder = scratch_folder();
  const ObjectMesh mesh = test::torus(0.15f, 0.06f, 12, 8);
  const auto first = cached_transfer(mesh, folder, "torus"), second = cached_transfer(mesh, folder, "torus");
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(first->from_cache);
  EXPECT_TRUE(second->from_cache);
  EXPECT_EQ(first->transfer, second->transfer);
}

TEST(TransferFile, a_changed_mesh_has_another_key) {
  ObjectMesh mesh = test::torus(0.15f, 0.06f, 12, 8);
  const std::string key = transfer_key(mesh);
  mesh.positions[5].x += 1e-6f;
  EXPECT_NE(transfer_key(mesh), key);
}

TEST(TransferFile, damage_is_refused_and_computed_again) {
  const auto folder = scratch_folder();
  const ObjectMesh mesh = test::torus(0.15f, 0.06f, 12, 8);
  const std::string key = transfer_key(mesh);
  const auto path = folder / ("torus-" + key + ".transfer");
  ASSERT_TRUE(cached_transfer(mesh, folder, "torus"));
  const auto good = *read_whole_file(path);
  const auto damaged = [&](std::vector<std::uint8_t> bytes) {
    const std::span<const std::byte> part = std::as_bytes(std::span<const std::uint8_t>(bytes));
    EXPECT_TRUE(write_file_atomically(path, std::span(&part, 1)));
    return read_transfer(path, key, mesh.positions.size());
  };
  for (const std::size_t at : {std::size_t{0}, std::size_t{8}, std::size_t{12}, std::size_t{16}, std::size_t{24},
                               std::size_t{40}, std::size_t{60}, good.size() - 1}) {
    auto bytes = good;
    bytes[at] ^= 0x40;
    EXPECT_FALSE(damaged(bytes)) << "byte " << at;
  }
  EXPECT_FALSE(damaged({good.begin(), good.end() - 3}));
  EXPECT_FALSE(damaged({}));
  const auto again = cached_transfer(mesh, folder, "torus");
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->from_cache);
  EXPECT_FALSE(again->note.empty());
  EXPECT_EQ(*read_whole_file(path), good);
  EXPECT_TRUE(cached_transfer(mesh, folder, "torus")->from_cache);
}

// Bytes 40..47 of the header hold the checksum of what follows it.
void sign(std::vector<std::uint8_t>& file) {
  if (file.size() < 48)
    return;
  const std::uint64_t hash = checksum64(std::as_bytes(std::span(file).subspan(48)));
  std::memcpy(file.data() + 40, &hash, sizeof(hash));
}

TEST(TransferFile, ten_thousand_damaged_files_are_refused_or_read_as_they_are) {
  const auto folder = scratch_folder();
  const ObjectMesh mesh = test::torus(0.15f, 0.06f, 6, 4);
  const std::string key = transfer_key(mesh);
  ASSERT_TRUE(cached_transfer(mesh, folder, "torus"));
  const auto good = *read_whole_file(folder / ("torus-" + key + ".transfer"));
  std::mt19937 random(9);
  int refused = 0, read = 0;
  for (int i = 0; i < 10000; ++i) {
    auto bytes = good;
    const bool intent = i % 2 == 1;
    if (i % 5 == 0)
      bytes.resize(random() % (2 * good.size()));
    const std::uint32_t words[] = {0xffffffffu, 0x7f800000u, 0u, 0x7fc00000u, 0x7fffffffu, 0x40490fdcu, 1u << 30};
    if (bytes.size() >= 4 && i % 3 == 0)
      std::memcpy(bytes.data() + random() % (bytes.size() - 3), &words[random() % 7], 4);
    else if (!bytes.empty())
      bytes[random() % std::min<std::size_t>(bytes.size(), i % 4 == 0 ? 48 : bytes.size())] ^=
          static_cast<std::uint8_t>(1u << random() % 8);
    if (intent)
      sign(bytes);
    const auto parsed = parse_transfer(bytes, "damaged", key, mesh.positions.size());
    ++(parsed ? read : refused);
    if (!parsed)
      continue;
    ASSERT_TRUE(intent || bytes == good) << i;
    ASSERT_EQ(std::memcmp(parsed->data(), bytes.data() + 48, bytes.size() - 48), 0) << i;
  }
  EXPECT_GT(refused, 6000);
  EXPECT_GT(read, 500); // signed, and within the range of coefficients
}

TEST(TransferFile, vectors_of_another_mesh_or_setting_are_not_taken) {
  const auto folder = scratch_folder();
  const ObjectMesh one = test::torus(0.15f, 0.06f, 12, 8), other = test::torus(0.15f, 0.05f, 12, 8);
  ASSERT_TRUE(cached_transfer(one, folder, "object"));
  EXPECT_FALSE(cached_transfer(other, folder, "object")->from_cache);
  EXPECT_FALSE(cached_transfer(one, folder, "object", {512})->from_cache);
  // A file under the name of the other's: what a copied or renamed file would be.
  std::filesystem::copy_file(folder / ("object-" + transfer_key(one) + ".transfer"),
                             folder / ("object-" + transfer_key(other) + ".transfer"),
                             std::filesystem::copy_options::overwrite_existing);
  const auto taken = cached_transfer(other, folder, "object");
  ASSERT_TRUE(taken);
  EXPECT_FALSE(taken->from_cache);
  EXPECT_EQ(taken->transfer, *compute_transfer(other));
}

TEST(TransferFile, a_folder_that_cannot_be_written_to_costs_the_computation_only) {
  const auto folder = scratch_folder();
  const ObjectMesh mesh = test::torus(0.15f, 0.06f, 12, 8);
  const auto transfer = cached_transfer(mesh, folder / "gone", "torus");
  ASSERT_TRUE(transfer) << transfer.error().message();
  EXPECT_EQ(transfer->transfer, *compute_transfer(mesh));
  EXPECT_NE(transfer->note.find("not cached"), std::string::npos) << transfer->note;
  EXPECT_FALSE(std::filesystem::exists(folder / "gone"));
  // A folder in the place of the file: neither read nor removed.
  std::filesystem::create_directories(folder / ("torus-" + transfer_key(mesh) + ".transfer") / "kept");
  const auto blocked = cached_transfer(mesh, folder, "torus");
  ASSERT_TRUE(blocked) << blocked.error().message();
  EXPECT_FALSE(blocked->note.empty());
  EXPECT_TRUE(std::filesystem::exists(folder / ("torus-" + transfer_key(mesh) + ".transfer") / "kept"));
}

} // namespace
} // namespace daylit
