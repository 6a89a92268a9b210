// Objects set down on surfaces of a room, and where they stand written back.

#include <cmath>

#include <gtest/gtest.h>

#include "scene/config/placement_text.h"
#include "scene/placing/set_down.h"
#include "scene/placing/surface_below.h"
#include "test_rooms.h"

namespace daylit {
namespace {

/// 4 x 4 x 3 m with a roof 0.4 m thick and a hole of 1 x 1 m in the wall x = 0. A table, solid, 1 x 1 x 0.75 m in the
/// middle, and a shelf 2 cm thick above one half of it, 1.25 m high.
Room furnished() {
  test::RoomBuilder b;
  const std::uint32_t wall = b.material("wall"), table = b.material("table"), shelf = b.material("shelf");
  b.box({0, 0, 0}, {4, 4, 3}, wall, 0b011110);
  b.box({0, 0, 3}, {4, 4, 3.4}, wall);
  b.quad({0, 0, 0}, {0, 4, 0}, {0, 4, 1}, {0, 0, 1}, wall);
  b.quad({0, 0, 2}, {0, 4, 2}, {0, 4, 3}, {0, 0, 3}, wall);
  b.quad({0, 0, 1}, {0, 1.5, 1}, {0, 1.5, 2}, {0, 0, 2}, wall);
  b.quad({0, 2.5, 1}, {0, 4, 1}, {0, 4, 2}, {0, 2.5, 2}, wall);
  b.box({1.5, 1.5, 0}, {2.5, 2.5, 0.75}, table);
  b.box({1.5, 1.5, 1.25}, {2.0, 2.5, 1.27}, shelf);
  return b.room;
}

/// A box whose origin is its lower corner, `lean` further along x at its top.
ObjectMesh box_mesh(const glm::vec3& size, float lean = 0.0f) {
  ObjectMesh mesh;
  for (int k = 0; k < 8; ++k) {
    const float z = k & 4 ? 1.0f : 0.0f;
    mesh.positions.emplace_back((k & 1 ? size.x : 0.0f) + lean * z, k & 2 ? size.y : 0.0f, size.z * z);
  }
  mesh.normals.assign(8, glm::vec3(0, 0, 1));
  mesh.reflectance.assign(8, Rgb(0.5f));
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

ObjectConfig on(const std::string& surface, double x, double y) {
  ObjectConfig object;
  object.model = "box.obj";
  object.on = StandsOn{surface, true};
  object.position = {x, y, 0.0};
  return object;
}

class Placing : public testing::Test {
protected:
  const Room room_ = furnished();
  const RayScene rays_ = *RayScene::build(room_);

  Result<double> height(const std::string& surface, double x, double y, double free_m = 0.2) const {
    const auto found = surface_below(room_, rays_, {x, y}, surface, free_m);
    return found ? Result<double>(found->height_m) : Result<double>(found.error());
  }
};

TEST_F(Placing, the_surface_below_has_air_of_the_objects_height_above_it) {
  EXPECT_NEAR(*height("", 3.0, 3.0), 0.0, 1e-5);       // not the roof, not the inside of the roof
  EXPECT_FALSE(height("", 3.0, 3.0, 3.1));             // what is higher than the room stands nowhere
  EXPECT_NEAR(*height("", 2.2, 2.0), 0.75, 1e-5);      // not inside the table
  EXPECT_NEAR(*height("", 1.7, 2.0), 1.27, 1e-5);      // the shelf is higher than the table
  EXPECT_NEAR(*height("table", 1.7, 2.0), 0.75, 1e-5); // below the shelf
  EXPECT_NEAR(*height("Table", 1.7, 2.0), 0.75, 1e-5);
  EXPECT_NEAR(*height("floor", 3.0, 3.0), 0.0, 1e-5);  // no material is called so: the lowest
  EXPECT_NEAR(*height("floor", 2.2, 2.0), 0.75, 1e-5); // the floor below is in the dark
  const auto low = height("table", 1.7, 2.0, 0.6);     // 0.5 m up to the shelf
  ASSERT_FALSE(low);
  EXPECT_EQ(low.error().code, ErrorCode::not_found);
  const auto none = height("table", 3.0, 3.0);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message().find("below is \"wall\":"), std::string::npos) << none.error().message();
  const auto two = height("chair", 2.2, 2.0);
  ASSERT_FALSE(two);
  EXPECT_NE(two.error().message().find("below are \"wall\", \"table\":"), std::string::npos) << two.error().message();
  const auto outside = height("", 9.0, 9.0);
  ASSERT_FALSE(outside);
  EXPECT_NE(outside.error().message().find("nothing of the room is below; give a place above a surface"),
            std::string::npos)
      << outside.error().message();
}

/// Rounding decides whether a vertical line there meets a face.
TEST(PlacingAtEdges, a_place_on_an_edge_of_the_room_is_a_place_in_it_at_every_edge) {
  for (const glm::dvec3& size : {glm::dvec3(4, 5, 2.8), glm::dvec3(4.2, 3.1, 2.7), glm::dvec3(3.33, 7.77, 3.1)}) {
    test::RoomBuilder b;
    const glm::dvec3 low(0.1, 0, 0);
    b.box(low, low + size, b.material("wall"), 0b111110);
    b.box(low + glm::dvec3(0, 0, size.z), low + size + glm::dvec3(0, 0, 0.3), b.material("roof"));
    const RayScene rays = *RayScene::build(b.room);
    for (const glm::dvec2& part : {glm::dvec2(0, 0.3), {1, 0.3}, {0.3, 0}, {0.3, 1}, {0, 0}, {1, 1}, {0, 1}, {1, 0}}) {
      const auto found = surface_below(b.room, rays, glm::dvec2(low) + part * glm::dvec2(size), "", 0.2);
      ASSERT_TRUE(found) << size.x << ": " << part.x << " " << part.y << ": " << found.error().message();
      EXPECT_NEAR(found->height_m, 0.0, 1e-5) << size.x << ": " << part.x << " " << part.y;
    }
    EXPECT_FALSE(surface_below(b.room, rays, {low.x - 0.01, 1.0}, "", 0.2));
  }
}

TEST_F(Placing, an_object_stands_on_its_lowest_points_however_it_is_turned_and_scaled) {
  const ObjectMesh mesh = box_mesh({0.2f, 0.2f, 0.3f});
  for (const glm::dvec3& turn :
       {glm::dvec3(0, 0, 0), glm::dvec3(90, 0, 0), glm::dvec3(180, 0, 0), glm::dvec3(30, 20, 70)}) {
    ObjectConfig object = on("table", 2.2, 2.0);
    object.rotation_deg = turn;
    object.scale = 0.7;
    const auto placed = set_down(object, WeighedMesh(mesh), room_, rays_);
    ASSERT_TRUE(placed) << placed.error().message();
    EXPECT_NEAR(placed_bounds(mesh, object_transform(*placed)).min.z, 0.75, 1e-5);
    EXPECT_EQ(glm::dvec2(placed->position), glm::dvec2(2.2, 2.0));
  }
  ObjectConfig floating = on("", 2.2, 2.0);
  floating.on.reset();
  floating.position.z = 1.1;
  EXPECT_EQ(set_down(floating, WeighedMesh(mesh), room_, rays_)->position.z, 1.1);
}

TEST_F(Placing, a_sheet_is_set_down_just_above_the_surface_and_a_solid_on_it) {
  ObjectMesh box = box_mesh({0.2f, 0.2f, 0.3f}), sheet = box, walls = box;
  sheet.triangles.resize(2);                                                   // the bottom alone
  walls.triangles.erase(walls.triangles.begin(), walls.triangles.begin() + 2); // all but the bottom
  const auto above = [&](const ObjectMesh& mesh) {
    const auto placed = set_down(on("table", 2.1, 2.0), WeighedMesh(mesh), room_, rays_);
    EXPECT_TRUE(placed) << placed.error().message();
    return placed_bounds(mesh, object_transform(*placed)).min.z - 0.75;
  };
  EXPECT_NEAR(above(sheet), 0.5e-3, 1e-5);
  EXPECT_NEAR(above(walls), 0.0, 1e-5); // nothing lies in the table's plane, and light must not pass below
  EXPECT_NEAR(above(box), 0.0, 1e-5);
}

TEST_F(Placing, without_a_place_it_stands_in_the_middle_of_the_surface) {
  ObjectConfig object = on("table", 0, 0);
  object.on->has_place = false;
  const ObjectMesh mesh = box_mesh({0.2f, 0.1f, 0.3f});
  const auto placed = set_down(object, WeighedMesh(mesh), room_, rays_);
  ASSERT_TRUE(placed) << placed.error().message();
  const Bounds box = placed_bounds(mesh, object_transform(*placed));
  EXPECT_LT(glm::length(box.centre() - glm::dvec3(2.0, 2.0, 0.9)), 1e-5);
  object.on->surface = "TABLE";
  EXPECT_TRUE(set_down(object, WeighedMesh(mesh), room_, rays_));
  object.on->surface = "chair";
  EXPECT_FALSE(set_down(object, WeighedMesh(mesh), room_, rays_));
}

/// "wall" is a block inside and a chimney outside, which is higher; "shell" is the roof alone.
TEST(PlacingByName, by_the_name_of_a_material_it_stands_inside_the_room_or_is_reported_on_the_roof) {
  ObjectConfig object = on("wall", 0, 0);
  object.on->has_place = false;
  const ObjectMesh mesh = box_mesh({0.2f, 0.2f, 0.3f});
  test::RoomBuilder b;
  const std::uint32_t wall = b.material("wall"), shell = b.material("shell"), floor = b.material("parquet");
  b.box({0, 0, 0}, {4, 4, 3}, wall, 0b001110);
  b.box({0, 0, 0}, {4, 4, 3}, floor, 0b010000);
  b.box({-3, 0, 3}, {4, 4, 3.4}, shell);       // its middle is beside the room
  b.box({3, 3, 0}, {3.5, 3.5, 0.75}, wall);    // a block inside
  b.box({-2, 1, 1.5}, {-1.6, 1.4, 3.6}, wall); // a chimney outside, the highest of all
  const RayScene rays = *RayScene::build(b.room);
  const auto placed = set_down(object, WeighedMesh(mesh), b.room, rays);
  ASSERT_TRUE(placed) << placed.error().message();
  EXPECT_LT(glm::length(placed->position - glm::dvec3(3.15, 3.15, 0.75)), 1e-5) << placed->position.z;
  EXPECT_TRUE(standing_warnings(*placed, WeighedMesh(mesh), b.room, rays).empty());
  object.on->surface = "shell";
  const auto above = set_down(object, WeighedMesh(mesh), b.room, rays);
  ASSERT_TRUE(above) << above.error().message();
  EXPECT_NEAR(above->position.z, 3.4, 1e-5);
  b.room.triangles.resize(b.room.triangles.size() - 12); // no chimney: the roof is the highest
  const auto warned = standing_warnings(*above, WeighedMesh(mesh), b.room, *RayScene::build(b.room));
  ASSERT_EQ(warned.size(), 1u);
  EXPECT_NE(warned[0].find("may be its roof: \"shell\" has no place below a ceiling"), std::string::npos) << warned[0];
}

TEST_F(Placing, an_object_that_would_tip_or_is_cut_by_the_room_is_reported) {
  const auto warnings = [&](const ObjectMesh& mesh, double x, double y) {
    const auto placed = set_down(on("table", x, y), WeighedMesh(mesh), room_, rays_);
    EXPECT_TRUE(placed) << placed.error().message();
    return standing_warnings(*placed, WeighedMesh(mesh), room_, rays_);
  };
  EXPECT_TRUE(warnings(box_mesh({0.2f, 0.2f, 0.3f}), 2.1, 2.0).empty());
  const auto leaning = warnings(box_mesh({0.2f, 0.2f, 0.3f}, 0.3f), 2.1, 2.0); // its middle is 5 cm beside its foot
  ASSERT_EQ(leaning.size(), 1u);
  EXPECT_NE(leaning[0].find("would tip over: its centre of mass lies 5.0 cm"), std::string::npos) << leaning[0];
  // Three eighths of the foot are beyond the edge of the table, two of its corners: the rest carries it.
  EXPECT_TRUE(warnings(box_mesh({0.4f, 0.2f, 0.3f}), 2.25, 2.0).empty());
  const auto over = warnings(box_mesh({0.4f, 0.2f, 0.3f}, -0.7f), 2.45, 2.0); // 5 cm of its foot are on the table
  ASSERT_EQ(over.size(), 1u);
  EXPECT_NE(over[0].find("would tip over"), std::string::npos);
  // Below the shelf's edge: too wide to stand beside it.
  const auto cut = warnings(box_mesh({0.2f, 0.2f, 0.7f}), 1.95, 2.0);
  ASSERT_EQ(cut.size(), 1u);
  EXPECT_NE(cut[0].find("\"shelf\" cuts through it"), std::string::npos) << cut[0];
}

TEST_F(Placing, an_object_with_a_position_is_reported_where_the_room_cuts_through_it_and_may_touch_or_hang) {
  const ObjectMesh mesh = box_mesh({0.2f, 0.2f, 0.3f});
  const auto warnings = [&](const glm::dvec3& position) {
    ObjectConfig object;
    object.model = "box.obj";
    object.position = position;
    return standing_warnings(object, WeighedMesh(mesh), room_, rays_);
  };
  EXPECT_TRUE(warnings({3.0, 3.0, 1.0}).empty()) << "it hangs";
  EXPECT_TRUE(warnings({3.0, 3.8, 0.0}).empty()) << "floor and wall touch it";
  EXPECT_TRUE(warnings({2.1, 2.0, 0.75}).empty()) << "on the table";
  const auto sunk = warnings({3.0, 3.0, -0.02});
  ASSERT_EQ(sunk.size(), 1u);
  EXPECT_NE(sunk[0].find("box.obj intersects the room: \"wall\" cuts through it"), std::string::npos) << sunk[0];
}

TEST_F(Placing, an_object_longer_than_the_room_is_said_to_be_in_another_unit) {
  const ObjectMesh mesh = box_mesh({200.0f, 200.0f, 300.0f}), fits = box_mesh({0.2f, 0.2f, 3.3f});
  const auto fails = set_down(on("", 3.0, 3.0), WeighedMesh(mesh), room_, rays_);
  ASSERT_FALSE(fails);
  EXPECT_NE(fails.error().message().find("it is 300 m long, the room 4 m: a model in millimetres needs scale = 0.001"),
            std::string::npos)
      << fails.error().message();
  ObjectConfig free = on("", 3.0, 3.0);
  free.on.reset();
  const auto warnings = standing_warnings(free, WeighedMesh(mesh), room_, rays_);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].find("box.obj is larger than the room: it is 300 m long"), 0u) << warnings[0];
  const auto high = set_down(on("", 3.0, 3.0), WeighedMesh(fits), room_, rays_);
  ASSERT_FALSE(high);
  EXPECT_EQ(high.error().message().find("box.obj, on, its centre of mass (3.10, 3.10): nothing 3.30 m high"), 0u)
      << high.error().message();
}

TEST(PlacingMass, centre_of_mass_of_a_solid_and_of_a_sheet) {
  EXPECT_LT(glm::length(weigh(box_mesh({0.2f, 0.4f, 0.6f}, 0.1f)).centre_of_mass - glm::dvec3(0.15, 0.2, 0.3)), 1e-6);
  ObjectMesh open = box_mesh({2.0f, 2.0f, 2.0f});
  open.triangles.resize(2); // the bottom alone
  EXPECT_LT(glm::length(weigh(open).centre_of_mass - glm::dvec3(1.0, 1.0, 0.0)), 1e-6);
}

TEST(PlacementText, only_places_that_changed_are_rewritten) {
  const std::string before = "# my room\n[sky] # grün\nimage = \"a.hdr\"\n"
                             "[[object]] # first\nmodel = \"a.obj\"\nposition = [ 1.50, 2,\n   0 ] # here\nscale = 2\n"
                             "[[object]]\nmodel = \"ä.obj\" # no place yet\nscale = 1\n"
                             "[[object]]\non = [1, 2]  # anywhere\nmodel = \"c.obj\"\n"
                             "[[object]]\nposition = [3.0, 4.0]\non = \"table\"\nmodel = \"d.obj\"\n";
  std::vector<ObjectConfig> objects(4);
  objects[0].position = {1.5, 2.0, 0.0};
  objects[1].position = {0.25, 0.5, 0.75};
  objects[2].on = StandsOn{"", true};
  objects[2].position = {1.125, 2.0, 0.4};
  objects[3].on = StandsOn{"table", true};
  objects[3].position = {3.0, 5.0, 0.4};
  objects[0].scale = 2;
  std::vector<EditedObject> edited;
  for (const ObjectConfig& o : objects)
    edited.push_back({o, edited.size()});
  const auto after = with_objects(before, edited, 4, "config.toml");
  ASSERT_TRUE(after) << after.error().message();
  EXPECT_EQ(*after, "# my room\n[sky] # grün\nimage = \"a.hdr\"\n"
                    "[[object]] # first\nmodel = \"a.obj\"\nposition = [ 1.50, 2,\n   0 ] # here\nscale = 2\n"
                    "[[object]]\nmodel = \"ä.obj\" # no place yet\nposition = [0.25, 0.5, 0.75]\nscale = 1\n"
                    "[[object]]\non = [1.125, 2]  # anywhere\nmodel = \"c.obj\"\n"
                    "[[object]]\nposition = [3, 5]\non = \"table\"\nmodel = \"d.obj\"\n");
  EXPECT_FALSE(with_objects(before, edited, 3, "config.toml")) << "the file has others than were read";
}

const std::string kThree = "[sky]\nimage = \"a.hdr\"\n\n# the pot\n[[object]]\nmodel = \"pot.obj\"\nscale = 2 # big\n\n"
                           "# the blob\n[[object]]\nmodel = \"blob.obj\"\n\n[[object]]\nmodel = \"cube.obj\"\n\n"
                           "# lights\n[light]\nsamples = 32\n";

std::vector<EditedObject> three() {
  std::vector<EditedObject> objects(3);
  for (std::size_t k = 0; k < 3; ++k)
    objects[k].in_file = k;
  objects[0].object.scale = 2;
  return objects;
}

TEST(PlacementText, rotation_and_scale_are_written_where_they_changed_only) {
  auto objects = three();
  objects[0].object.scale = 1.5;
  objects[2].object.rotation_deg = {0, 0, 30};
  const auto after = with_objects(kThree, objects, 3, "config.toml");
  ASSERT_TRUE(after) << after.error().message();
  std::string expected = kThree;
  expected.replace(expected.find("scale = 2"), 9, "scale = 1.5");
  expected.replace(expected.find("\"cube.obj\""), 10, "\"cube.obj\"\nrotation = [0, 0, 30]");
  // An object without a place gets none as long as it stands at the origin.
  EXPECT_EQ(*after, expected);
}

TEST(PlacementText, an_object_that_is_gone_takes_its_comment_along_and_nothing_else) {
  auto objects = three();
  objects.erase(objects.begin() + 1);
  const auto after = with_objects(kThree, objects, 3, "config.toml");
  ASSERT_TRUE(after) << after.error().message();
  std::string expected = kThree;
  const std::size_t from = expected.find("# the blob"), to = expected.find("[[object]]\nmodel = \"cube");
  expected.erase(from, to - from);
  EXPECT_EQ(*after, expected);
}

TEST(PlacementText, a_new_object_comes_after_the_last_and_reads_back) {
  auto objects = three();
  EditedObject added;
  added.object.model = "room/new.obj";
  added.object.position = {1, 2, 0.5};
  objects.push_back(added);
  const auto after = with_objects(kThree, objects, 3, "room/config.toml");
  ASSERT_TRUE(after) << after.error().message();
  std::string expected = kThree;
  expected.insert(expected.find("\n\n# lights"), "\n\n[[object]]\nmodel = \"new.obj\"\nposition = [1, 2, 0.5]\n"
                                                 "rotation = [0, 0, 0]\nscale = 1");
  EXPECT_EQ(*after, expected);
  const auto alone = with_objects("[light]\nsamples = 3", std::vector<EditedObject>{added}, 0, "room/config.toml");
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->find("[light]\nsamples = 3\n\n[[object]]\nmodel = \"new.obj\""), 0u) << *alone;
  EXPECT_FALSE(with_objects("object = [{ model = \"a.obj\" }]", std::vector<EditedObject>{}, 1, "c.toml"));
}

} // namespace
} // namespace daylit
