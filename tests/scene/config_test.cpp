#include <cmath>
#include <string>
#include <tuple>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "config_files.h"

namespace daylit {
namespace {

const char kRun[] = R"([sky]
image = "sky.exr"
projection = "fisheye"
lens = "sky.yaml"
rotation = 90
ground = { albedo = 0.3 }
fall_off = "fall-off.txt"

[interior]
image = "photo.png"
lens = "camera.yaml"
response = "srgb"
scale = "marker"
colour_matrix = [[1, 0.1, 0], [0, 1, 0], [0, 0, 1.2]]
blur_px = 0.7
noise = { floor = 0.001, photon = 2e-5 }

[marker]
ids = [23, 40]
size_m = 0.05
world_from_board = [1,0,0,2, 0,1,0,3, 0,0,1,0.5, 0,0,0,1]

[room]
model = "room.obj"
volume = "/absolute/room.volume"

[[object]]
model = "teapot.obj"
position = [1.5, 2.5, 0.75]
rotation = [0, 0, 90]
scale = 2.0
reflectance = 0.4

[light]
samples = 128
reflect_by = "maps"

[output]
png = "out/frame.png"
size = [512, 496]
)";

TEST_F(ConfigTest, reads_every_section) {
  const auto c = run(kRun);
  ASSERT_TRUE(c) << c.error().message();
  EXPECT_EQ(c->sky.image, folder_ / "sky.exr");
  EXPECT_NEAR(c->sky.rotation, 1.5707963267948966, 1e-15);
  EXPECT_EQ(c->sky.ground.kind, GroundFill::Kind::albedo);
  EXPECT_FLOAT_EQ(c->sky.ground.albedo, 0.3f);
  EXPECT_TRUE(c->interior.scale_from_marker);
  EXPECT_EQ(c->interior.response, "srgb");
  EXPECT_DOUBLE_EQ(c->interior.colour_matrix[1][0], 0.1); // row 0, column 1
  EXPECT_EQ(c->interior.blur_px, 0.7);
  EXPECT_EQ(c->interior.noise.floor, 0.001);
  EXPECT_EQ(c->interior.noise.photon, 2e-5);
  EXPECT_EQ(c->interior.noise.relative, 0.0);
  ASSERT_TRUE(c->marker);
  EXPECT_EQ(c->marker->ids, (std::vector<int>{23, 40}));
  EXPECT_EQ(c->marker->world_from_board[3], glm::dvec4(2, 3, 0.5, 1)); // the fourth column is the translation
  EXPECT_EQ(c->volume, "/absolute/room.volume");
  ASSERT_EQ(c->objects.size(), 1u);
  EXPECT_FLOAT_EQ(c->objects[0].reflectance->g, 0.4f);
  EXPECT_EQ(c->light_samples, 128);
  EXPECT_EQ(c->reflect_by, ReflectBy::maps);
  EXPECT_EQ(c->output.width_px, 512);
}

TEST_F(ConfigTest, written_text_reads_back_the_same) {
  const auto first = run(kRun);
  ASSERT_TRUE(first);
  const auto second = run(to_toml(*first));
  ASSERT_TRUE(second) << second.error().message();
  EXPECT_EQ(to_toml(*first), to_toml(*second));
  EXPECT_EQ(second->interior.colour_matrix, first->interior.colour_matrix);
  EXPECT_EQ(second->interior.noise.photon, first->interior.noise.photon);
  EXPECT_EQ(second->interior.blur_px, first->interior.blur_px);
  EXPECT_EQ(second->sky.fall_off, folder_ / "fall-off.txt");
  EXPECT_EQ(second->marker->world_from_board, first->marker->world_from_board);
}

TEST_F(ConfigTest, cameras_take_the_place_of_images_with_their_settings) {
  auto text = replaced(kRun, "image = \"sky.exr\"",
                       "camera = \"192.168.0.10\"\npixel_format = \"Mono16\"\nmosaic = \"rggb\"\nexposure_us = 2000\n"
                       "gain = 1.5\nframe_rate = 25\npacket_size = 8192\nsize = [640, 480]");
  text = replaced(text, "image = \"photo.png\"", "camera = \"Basler-1234\"");
  text = replaced(text, "scale = \"marker\"", "scale = 0.5");
  text = replaced(text, "ids = [23, 40]", "ids = [23, 40]\ncolumns = 2\ngap_m = 0.01");
  text += "[http]\nport = 0\naddress = \"0.0.0.0\"\ntoken_file = \"token\"\n";
  const auto first = run(text);
  ASSERT_TRUE(first) << first.error().message();
  const auto c = run(to_toml(*first));
  ASSERT_TRUE(c) << c.error().message();
  EXPECT_EQ(to_toml(*first), to_toml(*c));
  ASSERT_TRUE(c->is_live() && c->sky.camera && c->http);
  EXPECT_EQ(c->sky.camera->camera, "192.168.0.10");
  EXPECT_EQ(c->sky.camera->pixel_format, "Mono16");
  EXPECT_EQ(c->sky.camera->mosaic, "rggb");
  EXPECT_EQ(c->sky.camera->exposure_us, 2000.0);
  EXPECT_EQ(c->sky.camera->gain, 1.5);
  EXPECT_EQ(c->sky.camera->frame_rate_hz, 25.0);
  EXPECT_EQ(c->sky.camera->packet_bytes, 8192);
  EXPECT_EQ(c->sky.camera->width_px, 640);
  EXPECT_EQ(c->interior.camera->camera, "Basler-1234");
  EXPECT_FALSE(c->interior.camera->exposure_us) << "as the camera has it";
  EXPECT_EQ(c->marker->columns, 2);
  EXPECT_EQ(c->marker->gap_m, 0.01);
  EXPECT_EQ(c->http->token_file, folder_ / "token");
}

TEST_F(ConfigTest, a_sky_camera_may_cycle_exposures_and_have_an_illuminance_reading) {
  auto text = replaced(kRun, "image = \"sky.exr\"",
                       "camera = \"127.0.0.1\"\nexposures_us = [10, 640, 40960]\nresponse = \"log.txt\"\nwhite = 5000\n"
                       "illuminance = \"meter.txt\"\nplace = { latitude = 48.1, longitude = 11.6 }");
  text = replaced(text, "image = \"photo.png\"", "camera = \"127.0.0.2\"");
  text = replaced(text, "scale = \"marker\"", "scale = 0.5");
  const auto first = run(text);
  ASSERT_TRUE(first) << first.error().message();
  const auto c = run(to_toml(*first));
  ASSERT_TRUE(c) << c.error().message();
  EXPECT_EQ(c->sky.exposures_us, (std::vector<int>{10, 640, 40960}));
  EXPECT_EQ(c->sky.response, folder_ / "log.txt");
  EXPECT_EQ(c->sky.white, 5000.0);
  EXPECT_EQ(c->sky.illuminance_file, folder_ / "meter.txt");
  EXPECT_EQ(c->sky.place->latitude_deg, 48.1);
  EXPECT_EQ(c->sky.place->longitude_deg, 11.6);
  const std::tuple<const char*, const char*, const char*> changes[] = {
      {"[10, 640, 40960]", "[10]", "line 3: [sky] exposures_us: a bracket has 2 to 8"},
      {"[10, 640, 40960]", "[10, 15, 40960]", "a factor of 2"},
      {"white = 5000", "exposure_us = 10", "given together with exposures_us"},
      {", longitude = 11.6", "", "needs latitude and longitude"},
      {"\"meter.txt\"", "-3", "line 6: [sky] illuminance"},
      {"camera = \"127.0.0.1\"", "image = \"sky.exr\"", "[sky] exposures_us: is only used with camera"},
  };
  for (const auto& [from, to, part] : changes) {
    const auto bad = run(replaced(text, from, to));
    ASSERT_FALSE(bad) << from << " -> " << to;
    EXPECT_NE(bad.error().message().find(part), std::string::npos) << bad.error().message();
  }
}

TEST_F(ConfigTest, impossible_cameras_boards_and_servers_are_refused_with_their_line) {
  auto live = replaced(kRun, "image = \"sky.exr\"", "camera = \"127.0.0.1\"\nframe_rate = 25");
  live = replaced(live, "image = \"photo.png\"", "camera = \"127.0.0.2\"");
  live = replaced(live, "scale = \"marker\"", "scale = 1.0");
  live = replaced(live, "ids = [23, 40]", "ids = [23, 40]\ncolumns = 2");
  live += "[http]\nport = 8080\n";
  ASSERT_TRUE(run(live)) << run(live).error().message();
  const std::tuple<const char*, const char*, const char*> changes[] = {
      {"frame_rate = 25", "frame_rte = 25", "line 3: unknown key '[sky] frame_rte', did you mean 'frame_rate'?"},
      {"frame_rate = 25", "frame_rate = 0", "line 3: [sky] frame_rate"},
      {"frame_rate = 25", "exposure_us = \"long\"", "line 3: [sky] exposure_us: expected a number"},
      {"frame_rate = 25", "mosaic = \"rgbg\"", "did you mean 'rggb'"},
      {"frame_rate = 25", "pixel_format = \"RGB8\"\nmosaic = \"rggb\"", "line 4: [sky] mosaic: is only for"},
      {"frame_rate = 25", "packet_size = 1", "line 3: [sky] packet_size: is 0"},
      {"frame_rate = 25", "image = \"sky.exr\"", "given together with image"},
      {"camera = \"127.0.0.1\"", "image = \"sky.exr\"", "is only used with camera"},
      {"camera = \"127.0.0.2\"", "image = \"photo.png\"", "[sky] has a camera and [interior] has none"},
      {"camera = \"127.0.0.2\"", "camera = \"\"", "is empty"},
      {"camera = \"127.0.0.2\"", "camera = \"127.0.0.1\"", "is that of [sky] too"},
      {"scale = 1.0", "scale = \"marker\"", "is for single pictures"},
      {"ids = [23, 40]", "ids = [23, 23]", "[marker] ids: 23 stands there twice"},
      {"columns = 2", "columns = 3", "2 ids do not fill rows of 3"},
      {"columns = 2", "gap_m = 0.1", "is only used with columns"},
      {"port = 8080", "port = 70000", "[http] port"},
      {"port = 8080", "address = \"0.0.0.0\"", "needs token_file"},
  };
  for (const auto& [from, to, part] : changes) {
    const auto c = run(replaced(live, from, to));
    ASSERT_FALSE(c) << from << " -> " << to;
    EXPECT_NE(c.error().message().find(part), std::string::npos) << c.error().message();
  }
}

TEST_F(ConfigTest, a_depth_picture_comes_with_its_unit_and_its_noise) {
  EXPECT_TRUE(run(kRun)->interior.depth.empty());
  const auto plain = run(replaced(kRun, "image = \"photo.png\"", "image = \"photo.png\"\ndepth = \"depth.png\""));
  ASSERT_TRUE(plain) << plain.error().message();
  EXPECT_EQ(plain->interior.depth, folder_ / "depth.png");
  EXPECT_EQ(plain->interior.depth_unit_m, 0.001);
  const auto all = run(replaced(kRun, "image = \"photo.png\"",
                                "image = \"photo.png\"\ndepth = \"depth.exr\"\ndepth_unit_m = 0.0002\n"
                                "depth_noise_m = 0.0005"));
  ASSERT_TRUE(all) << all.error().message();
  const auto again = run(to_toml(*all));
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(again->interior.depth, folder_ / "depth.exr");
  EXPECT_EQ(again->interior.depth_unit_m, 0.0002);
  EXPECT_EQ(again->interior.depth_noise_m, 0.0005);
}

TEST_F(ConfigTest, depth_keys_without_depth_and_depth_of_a_camera_are_refused) {
  const auto problem = [&](const std::string& text) {
    const auto c = run(text);
    return c ? "" : c.error().message();
  };
  EXPECT_NE(problem(replaced(kRun, "image = \"photo.png\"", "image = \"photo.png\"\ndepth_unit_m = 0.001"))
                .find("depth_unit_m: is only used with depth"),
            std::string::npos);
  EXPECT_NE(
      problem(replaced(kRun, "image = \"photo.png\"", "image = \"photo.png\"\ndepth = \"d.png\"\ndepth_noise_m = -1"))
          .find("[interior] depth_noise_m"),
      std::string::npos);
  EXPECT_NE(problem(replaced(kRun, "image = \"photo.png\"", "camera = \"127.0.0.2\"\ndepth = \"d.png\""))
                .find("a camera's frames have none"),
            std::string::npos);
}

TEST_F(ConfigTest, noise_may_be_one_number_and_must_be_one) {
  const auto c = run(replaced(kRun, "noise = { floor = 0.001, photon = 2e-5 }", "noise = 0.01"));
  ASSERT_TRUE(c) << c.error().message();
  EXPECT_EQ(c->interior.noise.relative, 0.01);
  EXPECT_FALSE(run(replaced(kRun, "floor = 0.001", "flor = 0.001")));
  EXPECT_FALSE(run(replaced(kRun, "photon = 2e-5", "photon = -1")));
  EXPECT_FALSE(run(replaced(kRun, "noise = { floor = 0.001, photon = 2e-5 }", "noise = \"much\"")));
  EXPECT_FALSE(run(replaced(kRun, "blur_px = 0.7", "blur_px = 100")));
}

TEST_F(ConfigTest, unknown_key_names_line_and_suggestion) {
  const auto c = run(replaced(kRun, "rotation = 90", "rotaton = 90"));
  ASSERT_FALSE(c);
  EXPECT_NE(c.error().where.find("line 5"), std::string::npos) << c.error().message();
  EXPECT_NE(c.error().what.find("did you mean 'rotation'"), std::string::npos) << c.error().message();
}

TEST_F(ConfigTest, unknown_section_names_line_and_suggestion) {
  const auto c = run(replaced(kRun, "[light]", "[lights]"));
  ASSERT_FALSE(c);
  EXPECT_NE(c.error().message().find("did you mean 'light'"), std::string::npos) << c.error().message();
}

TEST_F(ConfigTest, all_problems_are_reported_together) {
  auto text = replaced(kRun, "samples = 128", "samples = -3");
  text = replaced(text, "scale = 2.0", "scale = nan");
  text = replaced(text, "albedo = 0.3", "albedo = 3");
  text = replaced(text, "volume = ", "volum = ");
  const auto c = run(text);
  ASSERT_FALSE(c);
  for (const char* part : {"samples", "scale", "albedo", "needs volume", "unknown key '[room] volum'"})
    EXPECT_NE(c.error().message().find(part), std::string::npos) << part << " in " << c.error().message();
}

TEST_F(ConfigTest, wrong_types_and_inconsistent_parts_are_refused) {
  const std::pair<const char*, const char*> changes[] = {
      {"image = \"sky.exr\"", "image = 3"},
      {"projection = \"fisheye\"", "projection = \"fisheyes\""},
      {"lens = \"sky.yaml\"", ""},
      {"ground = { albedo = 0.3 }", ""},
      {"scale = \"marker\"", "scale = \"markers\""},
      {"ids = [23, 40]", "ids = [1.5]"},
      {"ids = [23, 40]", "ids = \"23\""},
      {"0,0,0,1]", "0,0,0,2]"},
      {"[1,0,0,2,", "[-1,0,0,2,"},
      {"[1,0,0,2,", "[1,0,0,"},
      {"[[object]]", "[object]"},
      {"reflectance = 0.4", "reflectance = [0.4, 0.4]"},
      {"reflectance = 0.4", "reflectance = 1.4"},
      {"size = [512, 496]", "size = [512]"},
      {"size = [512, 496]", "size = [512, 0]"},
      {"samples = 128", "samples = 1e400"},
      {"colour_matrix = [[1, 0.1, 0], [0, 1, 0], [0, 0, 1.2]]", "colour_matrix = [0,0,0,0,0,0,0,0,0]"},
  };
  for (const auto& [from, to] : changes) {
    const auto c = run(replaced(kRun, from, to));
    ASSERT_FALSE(c) << from << " -> " << to;
    EXPECT_NE(c.error().where.find("CONFIG.toml"), std::string::npos) << c.error().message();
  }
}

TEST_F(ConfigTest, an_object_may_have_a_material_of_the_library) {
  const auto c = run(replaced(kRun, "reflectance = 0.4", "material = \"brushed-steel\""));
  ASSERT_TRUE(c) << c.error().message();
  EXPECT_EQ(c->objects[0].material, "brushed-steel");
  const auto again = run(to_toml(*c));
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(again->objects[0].material, "brushed-steel");
  const auto wrong = run(replaced(kRun, "reflectance = 0.4", "material = \"brushed-stel\""));
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message().find("did you mean 'brushed-steel'"), std::string::npos) << wrong.error().message();
  EXPECT_NE(wrong.error().message().find("porcelain"), std::string::npos) << "and all others";
}

TEST_F(ConfigTest, damaged_text_is_an_error_with_its_place) {
  const auto c = run("[sky\nimage=");
  ASSERT_FALSE(c);
  EXPECT_EQ(c.error().code, ErrorCode::file_malformed);
  EXPECT_NE(c.error().where.find("line 1"), std::string::npos);
  EXPECT_EQ(read_run_config(folder_ / "absent.toml").error().code, ErrorCode::file_missing);
}

TEST_F(ConfigTest, pose_may_be_position_and_target) {
  auto text = std::string(kRun);
  text += "[pose]\nposition = [0, 0, 1.5]\nlook_at = [3, 0, 1.5]\n";
  const auto c = run(text);
  ASSERT_TRUE(c) << c.error().message();
  const glm::dmat4 m = *c->world_from_camera;
  EXPECT_NEAR(glm::distance(glm::dvec3(m[2]), glm::dvec3(1, 0, 0)), 0.0, 1e-15);  // forward
  EXPECT_NEAR(glm::distance(glm::dvec3(m[0]), glm::dvec3(0, -1, 0)), 0.0, 1e-15); // right of +x, seen from above
  EXPECT_NEAR(glm::distance(glm::dvec3(m[1]), glm::dvec3(0, 0, -1)), 0.0, 1e-15); // down
  EXPECT_NEAR(glm::determinant(glm::dmat3(m)), 1.0, 1e-12);
}

TEST_F(ConfigTest, what_would_have_no_effect_is_refused) {
  const std::string pose = "[pose]\nposition = [0, 0, 1.5]\nlook_at = [3, 0, 1.5]\n";
  EXPECT_TRUE(run(kRun + pose)) << "the marker gives the scale";
  const auto beside = run(replaced(kRun, "scale = \"marker\"", "scale = 2") + pose);
  ASSERT_FALSE(beside);
  EXPECT_NE(beside.error().message().find("marker: has no effect beside [pose]"), std::string::npos);
  const auto ground = run(replaced(replaced(kRun, "lens = \"sky.yaml\"\n", ""), "fisheye", "equirect"));
  ASSERT_FALSE(ground);
  EXPECT_NE(ground.error().message().find("[sky] ground: has no effect"), std::string::npos);
  EXPECT_NE(ground.error().message().find("[sky] fall_off: is only used with"), std::string::npos);
}

TEST_F(ConfigTest, the_room_s_model_may_be_left_out) {
  const auto c = run(replaced(kRun, "model = \"room.obj\"\n", ""));
  ASSERT_TRUE(c) << c.error().message();
  EXPECT_TRUE(c->room_model.empty());
  EXPECT_TRUE(run(to_toml(*c)));
}

TEST_F(ConfigTest, object_turns_about_x_then_y_then_z) {
  ObjectConfig object;
  object.position = {10, 20, 30};
  object.rotation_deg = {90, 0, 90};
  object.scale = 2.0;
  // (0,1,0): about x -> (0,0,1); about z unchanged; times 2; plus the position.
  const glm::dvec3 p(object_transform(object) * glm::dvec4(0, 1, 0, 1));
  EXPECT_NEAR(glm::distance(p, glm::dvec3(10, 20, 32)), 0.0, 1e-12);
}

} // namespace
} // namespace daylit
