// Rooms from Radiance scenes and Honeybee models.

#include <filesystem>
#include <fstream>
#include <map>

#include <gtest/gtest.h>

#include "scene/format/rad_text.h"
#include "scene/room/aperture.h"
#include "scene/room/glass.h"
#include "scene/room/room_hbjson.h"
#include "scene/room/room_rad.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;

double total_area(const Room& room, bool windows) {
  double area = 0;
  for (const RoomTriangle& t : room.triangles)
    area += room.is_window(t) == windows ? area_m2(room, t) : 0.0;
  return area;
}

using Files = std::map<std::string, std::string>;

Result<RoomFile> parse_rad(const std::string& text, const Files& files = {}) {
  return parse_rad_room(text, "test.rad", [&files](const std::string& name) -> Result<std::vector<std::uint8_t>> {
    const auto found = files.find(name);
    if (found == files.end())
      return Error{ErrorCode::file_missing, "not there", name, ""};
    return std::vector<std::uint8_t>(found->second.begin(), found->second.end());
  });
}

void expect_rad_error(const std::string& text, const std::string& part, const Files& files = {}) {
  const auto file = parse_rad(text, files);
  ASSERT_FALSE(file) << text;
  EXPECT_NE(file.error().message().find(part), std::string::npos) << file.error().message();
}

const std::string kGrey = "void plastic grey 0 0 5 .5 .5 .5 0 0\n";
const std::string kSquare = "grey polygon square 0 0 12 0 0 0 1 0 0 1 1 0 0 1 0\n";

TEST(RadRoom, materials_are_read_by_their_formulas) {
  const auto file =
      parse_rad("# a comment\nvoid plastic p\n0\n0\n5 .4 .5 .6 .1 .05\nvoid trans t 0 0 7 .5 .5 .5 0 0 .4 0\n"
                "void metal m 0 0 5 .7 .6 .5 .9 0\nvoid glass g 0 0 3 1 .8 .5\nvoid alias also p\n"
                "p polygon a 0 0 9 0 0 0 1 0 0 0 1 0\nt polygon b 0 0 9 0 0 1 1 0 1 0 1 1\n"
                "m polygon c 0 0 9 0 0 2 1 0 2 0 1 2\ng polygon d 0 0 9 0 0 3 1 0 3 0 1 3\n"
                "also polygon e 0 0 9 0 0 4 1 0 4 0 1 4\n");
  ASSERT_TRUE(file) << file.error().message();
  const std::vector<Material>& m = file->room.materials;
  EXPECT_NEAR(m[0].reflectance.g, 0.5 * 0.9 + 0.1, 1e-6);
  EXPECT_NEAR(m[1].reflectance.r, 0.5 * 0.6, 1e-6);
  EXPECT_NEAR(m[2].reflectance.b, 0.5, 1e-6);
  EXPECT_TRUE(m[3].is_window);
  // rayinit's 0.9166: the transmittance of glass of transmissivity 1.
  EXPECT_NEAR(pane_transmittance(m[3].transmittance, m[3].refractive_index, 1.0).r, 0.91832, 1e-4);
  // T = t (1 - R)^2 / (1 - t^2 R^2), R = 0.042580 for n = 1.52.
  EXPECT_NEAR(pane_transmittance(m[3].transmittance, m[3].refractive_index, 1.0).b,
              0.5 * 0.957420 * 0.957420 / (1 - 0.25 * 0.042580 * 0.042580), 1e-5);
  EXPECT_EQ(m[4].reflectance, m[0].reflectance);
}

TEST(RadRoom, xform_is_followed_with_copies) {
  const auto file = parse_rad(kGrey + "!xform -rz 90 -t 10 0 0 -a 3 -t 0 0 2 square.rad\n", {{"square.rad", kSquare}});
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->room.triangles.size(), 6u);
  const Bounds b = file->room.bounds();
  EXPECT_NEAR(b.min.x, 9.0, 1e-12); // x -> y, y -> -x, then moved
  EXPECT_NEAR(b.max.x, 10.0, 1e-12);
  EXPECT_NEAR(b.min.y, 0.0, 1e-12);
  EXPECT_NEAR(b.max.z, 4.0, 1e-12);
}

TEST(RadRoom, xform_options_follow_the_manual) {
  const auto at = [](const std::string& options, const glm::dvec3& p) {
    const auto x = detail::parse_xform(options + " f.rad", "test");
    EXPECT_TRUE(x) << options;
    return glm::dvec3(x->transforms.back() * glm::dvec4(p, 1.0));
  };
  const auto near = [](const glm::dvec3& a, const glm::dvec3& b) { return glm::distance(a, b) < 1e-12; };
  EXPECT_TRUE(near(at("-rx 90", {0, 1, 0}), {0, 0, 1}));
  EXPECT_TRUE(near(at("-ry 90", {0, 0, 1}), {1, 0, 0}));
  EXPECT_TRUE(near(at("-rz 90", {1, 0, 0}), {0, 1, 0}));
  EXPECT_TRUE(near(at("-s 2 -t 1 0 0", {1, 1, 1}), {3, 2, 2}));
  EXPECT_TRUE(near(at("-t 1 0 0 -s 2", {1, 1, 1}), {4, 2, 2}));
  EXPECT_TRUE(near(at("-mx -my", {1, 2, 3}), {-1, -2, 3}));
  EXPECT_TRUE(near(at("-a 2 -t 1 0 0 -a 3 -t 0 1 0", {0, 0, 0}), {1, 2, 0}));
  EXPECT_TRUE(near(at("-i 3 -t 1 0 0 -i 1 -rz 90", {0, 0, 0}), {0, 3, 0}));
}

TEST(RadRoom, other_commands_are_refused_and_nothing_is_run) {
  const fs::path mark = fs::temp_directory_path() / "daylit-must-not-be-made";
  fs::remove(mark);
  for (const std::string& command :
       {std::string("!genbox grey box 1 1 1"), "!touch " + mark.string(), "!xform a.rad | touch " + mark.string(),
        "!xform a.rad; touch " + mark.string(), "!xform $(touch " + mark.string() + ")", std::string("! xform `id`")})
    expect_rad_error(kGrey + command + "\n", "only a plain !xform", {{"a.rad", kSquare}});
  EXPECT_FALSE(fs::exists(mark));
}

TEST(RadRoom, damage_is_refused_with_file_and_line) {
  expect_rad_error(kGrey + "grey polygon a 0 0 12 0 0 0 1 0\n", "test.rad, line");
  expect_rad_error(kGrey + "grey polygon a 0 0 8 0 0 0 1 0 0 1 1\n", "line 2");
  expect_rad_error(kGrey + "grey polygon a 0 0 9 0 0 0 1 0 nan 1 1 0\n", "line 2");
  expect_rad_error(kGrey + "grey polygon a 0 0 -3 0 0 0\n", "line 2");
  expect_rad_error(kGrey + "grey polygon a 0 0 99999999999 0\n", "line 2");
  expect_rad_error(kGrey + "grey sphere a 0 0 4 0 0 0 1\n", "only polygons");
  expect_rad_error("void mirror glossy 0 0 3 1 1 1\nglossy polygon a 0 0 9 0 0 0 1 0 0 0 1 0\n", "mirror");
  expect_rad_error("red polygon a 0 0 9 0 0 0 1 0 0 0 1 0\n", "\"red\" is not defined");
  expect_rad_error("!xform missing.rad\n", "missing.rad");
  expect_rad_error("!xform -q 3 a.rad\n", "-q");
  expect_rad_error("!xform self.rad\n", "name itself", {{"self.rad", "!xform self.rad\n"}});
  expect_rad_error("!xform -a 200 -t 1 0 0 -a 200 a.rad\n", "10000", {{"a.rad", kSquare}});
  expect_rad_error(std::string("\0\1\2", 3), "no primitive");
}

/// A box of 4 x 5 x 3 (in `units`) with an aperture in the wall y = 0, as one room of a Honeybee model.
std::string honeybee(const std::string& units, const std::string& face_extra = "",
                     const std::string& properties = "{}") {
  const auto face = [](const std::string& id, const std::string& type, const std::string& boundary,
                       const std::string& more) {
    return R"({"type":"Face","identifier":")" + id + R"(","face_type":")" + type +
           R"(","boundary_condition":{"type":"Outdoors"},"geometry":{"type":"Face3D","boundary":)" + boundary + "}" +
           more + "}";
  };
  const std::string window =
      R"(,"apertures":[{"type":"Aperture","identifier":"win","boundary_condition":{"type":"Outdoors"},"geometry":{"boundary":[[1,0,1],[3,0,1],[3,0,2],[1,0,2]]}}])";
  return R"({"type":"Model","identifier":"m","units":")" + units + R"(","properties":{"radiance":)" + properties +
         R"(},"rooms":[{"identifier":"r","properties":{},"faces":[)" +
         face("floor", "Floor", "[[0,0,0],[0,5,0],[4,5,0],[4,0,0]]", "") + "," +
         face("top", "RoofCeiling", "[[0,0,3],[4,0,3],[4,5,3],[0,5,3]]", "") + "," +
         face("south", "Wall", "[[0,0,0],[4,0,0],[4,0,3],[0,0,3]]", window + face_extra) + "," +
         face("north", "Wall", "[[0,5,0],[0,5,3],[4,5,3],[4,5,0]]", "") + "," +
         face("west", "Wall", "[[0,0,0],[0,0,3],[0,5,3],[0,5,0]]", "") + "," +
         face("east", "Wall", "[[4,0,0],[4,5,0],[4,5,3],[4,0,3]]", "") + "]}]}";
}

TEST(HbjsonRoom, apertures_are_cut_out_and_generic_modifiers_stand_in) {
  const auto file = parse_hbjson_room(honeybee("Meters"), "box.hbjson");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_NEAR(total_area(file->room, true), 2.0, 1e-9);
  EXPECT_NEAR(total_area(file->room, false), 2 * (20 + 12 + 15) - 2.0, 1e-9);
  const auto apertures = find_apertures(file->room, *RayScene::build(file->room));
  ASSERT_TRUE(apertures) << apertures.error().message();
  ASSERT_EQ(apertures->list.size(), 1u);
  EXPECT_EQ(apertures->report.unexplained_escape, 0.0);
  for (const Material& m : file->room.materials)
    if (m.is_window) {
      EXPECT_NEAR(pane_transmittance(m.transmittance, m.refractive_index, 1.0).g, 0.64,
                  2e-3); // tvis of the generic pane
    }
}

TEST(HbjsonRoom, units_are_turned_to_metres) {
  EXPECT_NEAR(total_area(parse_hbjson_room(honeybee("Millimeters"), "mm")->room, true), 2e-6, 1e-15);
  EXPECT_NEAR(total_area(parse_hbjson_room(honeybee("Feet"), "feet")->room, true), 2 * 0.3048 * 0.3048, 1e-9);
  EXPECT_FALSE(parse_hbjson_room(honeybee("Cubits"), "cubits"));
}

TEST(HbjsonRoom, modifiers_come_from_the_face_then_the_set_of_the_model) {
  const std::string properties =
      R"({"global_modifier_set":{"identifier":"all","floor_set":{"exterior_modifier":"carpet"},"modifiers":[{"type":"Plastic","identifier":"carpet","r_reflectance":0.1,"g_reflectance":0.2,"b_reflectance":0.3}]},"modifiers":[{"type":"Plastic","identifier":"brick","r_reflectance":0.4,"g_reflectance":0.2,"b_reflectance":0.1,"specularity":0.0}]})";
  const auto file = parse_hbjson_room(
      honeybee("Meters", R"(,"properties":{"radiance":{"modifier":"brick"}})", properties), "m.hbjson");
  ASSERT_TRUE(file) << file.error().message();
  std::map<std::string, Rgb> found;
  for (const Material& m : file->room.materials)
    found[m.name] = m.reflectance;
  EXPECT_EQ(found.at("carpet"), Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(found.at("brick"), Rgb(0.4f, 0.2f, 0.1f));
  EXPECT_NEAR(found.at("generic roof_ceiling_set").r, 0.8, 1e-6);
}

TEST(HbjsonRoom, damage_is_refused) {
  const std::string good = honeybee("Meters");
  for (std::size_t cut = 0; cut < good.size(); cut += 41)
    EXPECT_FALSE(parse_hbjson_room(good.substr(0, cut), "cut")) << cut;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    const auto file = parse_hbjson_room(text, "bad.hbjson");
    EXPECT_FALSE(file) << to;
    return file ? std::string() : file.error().message();
  };
  EXPECT_NE(with("[1,0,1]", "[1,0]").find("win"), std::string::npos);
  EXPECT_NE(with("[1,0,1]", "[1,0,1e300]").find("win"), std::string::npos);
  EXPECT_NE(with("[1,0,1]", "[-1,0,1]").find("south"), std::string::npos); // beyond the wall
  EXPECT_NE(with("\"Model\"", "\"Room\"").find("Honeybee"), std::string::npos);
  EXPECT_FALSE(parse_hbjson_room(std::string(200000, '['), "deep"));
}

class SharedRooms : public testing::Test {
protected:
  void SetUp() override {
    data_ = fs::path(DAYLIT_SOURCE_DIR) / "../shared/data/rooms";
    if (!fs::exists(data_))
      GTEST_SKIP() << "skipped: the shared rooms are not here";
    std::string pattern = (fs::temp_directory_path() / "daylit-rooms-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    copy_ = pattern;
  }
  void TearDown() override {
    if (!copy_.empty())
      fs::remove_all(copy_);
  }
  fs::path data_, copy_;
};

TEST_F(SharedRooms, honeybee_model_has_its_eight_windows) {
  const auto file = read_room(data_ / "honeybee/model_complete_multiroom_radiance.hbjson");
  ASSERT_TRUE(file) << file.error().message();
  const auto apertures = find_apertures(file->room, *RayScene::build(file->room));
  ASSERT_TRUE(apertures) << apertures.error().message();
  EXPECT_EQ(apertures->report.window_polygons, 8);
  EXPECT_LT(apertures->report.unexplained_escape, 1e-3);
}

TEST_F(SharedRooms, tutorial_room_is_read_with_its_materials_and_refused_without) {
  fs::copy(data_ / "radtutorial", copy_ / "room", fs::copy_options::recursive);
  const auto without = read_room(copy_ / "room/room.rad");
  ASSERT_FALSE(without);
  EXPECT_NE(without.error().message().find("is not defined"), std::string::npos) << without.error().message();
  std::ofstream(copy_ / "room/all.rad") << "!xform materials.rad\n!xform room.rad\n!xform ./objects/Glazing.rad\n";
  const auto file = read_room(copy_ / "room/all.rad");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_NEAR(total_area(file->room, true), 6.096 * 1.524, 1e-6);
  const auto apertures = find_apertures(file->room, *RayScene::build(file->room));
  ASSERT_TRUE(apertures) << apertures.error().message();
  EXPECT_EQ(apertures->report.window_polygons, 1);
}

TEST_F(SharedRooms, files_outside_the_folder_of_the_scene_are_refused) {
  std::ofstream(copy_ / "out.rad") << "!xform ../../etc/passwd\n";
  const auto file = read_room(copy_ / "out.rad");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message().find("outside its own folder"), std::string::npos) << file.error().message();
}

TEST_F(SharedRooms, box_with_a_sphere_says_what_it_cannot_read) {
  const auto file = read_room(data_ / "cornell/cornell_window.rad");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message().find("sphere"), std::string::npos) << file.error().message();
}

} // namespace
} // namespace daylit
