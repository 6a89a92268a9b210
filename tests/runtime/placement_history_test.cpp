// What points of the room keep of the objects that stay, when another one moves: the same as when all is looked at
// anew.

#include <gtest/gtest.h>

#include "runtime/indirect/placement_history.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::Surrounded;

/// Three black spheres in the white room; the last one stands where it is told.
struct ThreeSpheres : Surrounded {
  ThreeSpheres() : Surrounded(0.15f) {}
  std::vector<PlacedPart> parts(const glm::dvec3& last) const {
    std::vector<PlacedPart> all;
    for (const glm::dvec3& at : {glm::dvec3(2.0, 2.5, 0.16), glm::dvec3(2.45, 2.5, 0.16), last}) {
      glm::dmat4 world(1.0);
      world[3] = glm::dvec4(at, 1.0);
      all.push_back({&mesh_rays, mesh.triangles, mesh.positions, mesh.positions.size() * all.size(), world});
    }
    return all;
  }
  void set_down(const glm::dvec3& last) {
    change.set_objects(parts(last));
    change.set_sky(pyramid, {});
    const std::vector<TwoSided> black(3 * mesh.positions.size());
    change.set_direct(black, {}, {});
    change.set_indirect(black);
  }
  std::vector<float> along_floor() const {
    std::vector<float> change_of_light;
    for (double x = 1.6; x < 3.0; x += 0.031)
      for (const double y : {2.3, 2.44, 2.52, 2.71})
        change_of_light.push_back(at({x, y, 0.0}).irradiance.g);
    return change_of_light;
  }
};

TEST(PlacementHistory, after_objects_move_the_light_of_the_floor_is_as_if_all_were_looked_at_anew) {
  ThreeSpheres moved;
  const std::vector<glm::dvec3> places{
      {2.9, 2.2, 0.16}, {2.2, 2.2, 0.4}, {2.22, 2.5, 0.16}, {1.75, 2.62, 0.16}, {3.4, 4.0, 0.9}};
  for (const glm::dvec3& place : places) {
    moved.set_down(place);
    ThreeSpheres anew;
    anew.set_down(place);
    const std::vector<float> kept = moved.along_floor(), expected = anew.along_floor();
    for (std::size_t k = 0; k < kept.size(); ++k)
      ASSERT_EQ(kept[k], expected[k]) << k << ", " << place.x;
  }
}

TEST(PlacementHistory, what_is_seen_of_an_object_holds_until_it_or_one_before_it_moves) {
  const ThreeSpheres spheres;
  PlacementHistory history;
  const glm::dvec3 x(1.7, 2.5, 0.0); // the first sphere stands before the second
  EXPECT_FALSE(history.holds(0, x, 0)) << "nothing stood anywhere";
  history.add(1, PlacedParts(spheres.parts({2.9, 2.5, 0.16})));
  history.add(2, PlacedParts(spheres.parts({2.9, 2.6, 0.16})));
  EXPECT_TRUE(history.holds(0, x, 1)) << "the third is behind it";
  EXPECT_TRUE(history.holds(1, x, 1)) << "the same";
  EXPECT_FALSE(history.holds(2, x, 1)) << "it moved";
  history.add(3, PlacedParts(spheres.parts({1.9, 2.9, 0.5})));
  EXPECT_TRUE(history.holds(1, x, 2)) << "it is aside";
  history.add(4, PlacedParts(spheres.parts({2.22, 2.5, 0.3})));
  EXPECT_FALSE(history.holds(1, x, 3)) << "it stands before it now";
  history.add(5, PlacedParts(spheres.parts({2.9, 2.5, 0.16})));
  EXPECT_FALSE(history.holds(1, x, 4)) << "it stood before it";
  EXPECT_TRUE(history.holds(1, x, 1)) << "all stands as it stood then";
  for (std::uint64_t version = 6; version < 6 + PlacementHistory::kKept; ++version)
    history.add(version, PlacedParts(spheres.parts({2.9, 2.5, 0.16})));
  EXPECT_FALSE(history.holds(1, x, 5)) << "that long ago is not known";
}

TEST(PlacementHistory, among_other_objects_nothing_holds) {
  const ThreeSpheres spheres, others;
  PlacementHistory history;
  history.add(1, PlacedParts(spheres.parts({2.9, 2.5, 0.16})));
  history.add(2, PlacedParts(others.parts({2.9, 2.5, 0.16})));
  EXPECT_FALSE(history.holds(0, {1.7, 2.5, 0.0}, 1));
  EXPECT_TRUE(history.holds(0, {1.7, 2.5, 0.0}, 2));
}

} // namespace
} // namespace daylit
