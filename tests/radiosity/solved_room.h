#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <glm/vec3.hpp>
#include <gtest/gtest.h>

#include "radiosity/first_bounce.h"
#include "radiosity/form_factors.h"
#include "radiosity/surface_mesh.h"
#include "tests/radiosity/dense_matrix.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity::testing {

inline const Progress kSilent = [](const std::string&, double) { return true; };

/// Everything up to the exchange matrix.
struct Solved {
  Room room;
  SurfaceMesh mesh;
  RayScene scene;
  std::vector<Aperture> apertures;
  PatchSet set;
  ExchangeMatrix exchange;
  std::vector<float> dense; ///< the same, [patch][patch]

  const float* row(std::size_t i) const { return dense.data() + i * set.patches.size(); }
};

inline Solved prepare(const Room& room, int facets, const std::vector<Aperture>& seeds = {},
                      const ExchangeOptions& options = {}) {
  Solved s;
  s.room = room;
  s.mesh = *mesh_surfaces(room, {.target_facets = facets});
  s.scene = *facet_scene(s.mesh);
  s.apertures = seeds;
  if (seeds.empty()) {
    const auto found = find_apertures(room, *RayScene::build(room));
    EXPECT_TRUE(found) << found.error().message();
    s.apertures = found->list;
  }
  s.set = find_patches(room, s.mesh, s.scene, s.apertures);
  s.exchange = *exchange_areas(s.set, s.mesh, room, *RayScene::build(room), options, kSilent);
  s.dense = dense(s.exchange);
  return s;
}

/// A point in the middle of a closed room, where the search for lit sides starts.
inline std::vector<Aperture> seed_at(const glm::dvec3& p) {
  return {{.corners = {p, p + glm::dvec3(1e-3, 0, 0), p + glm::dvec3(0, 1e-3, 0)}, .inward = {0, 0, 1}}};
}

/// A room with a hole, coloured walls and a box on its floor.
inline Room coloured_room() {
  Room room = daylit::testing::room_with_window_hole(0.5f);
  room.materials[0].reflectance = Rgb(0.8f, 0.5f, 0.2f);
  daylit::testing::add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  return room;
}

} // namespace daylit::radiosity::testing
