// Reflectances from photographs: rendered by path tracing, which shares only geometry and rays with the transport.

#include <fstream>

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "calibration/material_report.h"
#include "scene/config/config.h"
#include "simulate/board_picture.h"
#include "tests/calibration/calibrate_program.h"
#include "tests/calibration/material_room.h"

namespace daylit::calibration {
namespace {

bool quiet(const std::string&, double) { return true; }

/// A small room in three photographs, with the transport that all tests share.
class Materials : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = test::fresh_folder("materials");
    test::write_material_room(folder_, {.width_px = 120, .samples = 256});
    ASSERT_EQ(test::simulate_views(folder_), 0);
    auto scene = read_material_scene(test::view_configs(folder_), {});
    ASSERT_TRUE(scene) << scene.error().message();
    scene_ = new MaterialScene(std::move(*scene));
    auto transport = RoomTransport::make(scene_->room.room, {scene_->skies.begin(), scene_->skies.end()}, quiet);
    ASSERT_TRUE(transport) << transport.error().message();
    transport_ = transport->release();
  }
  static void TearDownTestSuite() {
    delete transport_;
    delete scene_;
  }

  static MaterialCalibration calibrated(const MaterialScene& scene) {
    auto found = calibrate_materials(scene, *transport_, quiet);
    EXPECT_TRUE(found) << found.error().message();
    return found ? std::move(*found) : MaterialCalibration{};
  }
  static std::string why(const MaterialCalibration& c) {
    std::string all;
    for (const std::string& reason : c.report.why)
      all += reason + "\n";
    return all;
  }

  inline static std::filesystem::path folder_;
  inline static MaterialScene* scene_ = nullptr;
  inline static RoomTransport* transport_ = nullptr;
};

/// Largest relative error over the channels.
double error_of(const MaterialEstimate& m, const Rgb& truth) {
  double worst = 0;
  for (int c = 0; c < 3; ++c)
    worst = std::max(worst, std::abs(static_cast<double>(m.reflectance[c] / truth[c]) - 1.0));
  return worst;
}

TEST_F(Materials, five_unknown_reflectances_are_found_within_three_percent) {
  const MaterialCalibration found = calibrated(*scene_);
  EXPECT_TRUE(found.report.pass) << why(found);
  int measured = 0;
  for (const MaterialEstimate& m : found.fit.materials)
    if (m.seen && m.coverage >= 0.01) {
      EXPECT_LT(error_of(m, test::true_reflectance(m.name)), 0.03) << m.name;
      ++measured;
    }
  EXPECT_EQ(measured, 5);
}

TEST_F(Materials, what_no_picture_shows_is_named_and_kept) {
  const MaterialCalibration found = calibrated(*scene_);
  for (const MaterialEstimate& m : found.fit.materials)
    if (m.name == "hidden") {
      EXPECT_FALSE(m.seen);
      EXPECT_EQ(m.reflectance, m.given);
      EXPECT_NE(why(found).find("'hidden'"), std::string::npos) << why(found);
      return;
    }
  FAIL() << "no such material";
}

TEST_F(Materials, things_in_front_of_the_wall_and_highlights_do_no_harm) {
  MaterialScene scene = *scene_;
  for (MaterialView& view : scene.views)
    for (int y = 0; y < view.radiance.height; ++y)
      for (int x = 0; x < view.radiance.width; ++x) {
        if (x % 24 < 5 && y > view.radiance.height / 4)
          view.radiance.at(x, y) = Rgb(0.02f, 0.01f, 0.03f);
        if (x % 31 == 0)
          view.radiance.at(x, y) *= 6.0f;
      }
  const MaterialCalibration found = calibrated(scene);
  for (const MaterialEstimate& m : found.fit.materials)
    if (m.seen && m.coverage >= 0.01) {
      EXPECT_LT(error_of(m, test::true_reflectance(m.name)), 0.05) << m.name;
    }
}

TEST_F(Materials, a_wrong_pose_is_named) {
  MaterialScene scene = *scene_;
  scene.views[1].world_from_camera =
      scene.views[1].world_from_camera * glm::rotate(glm::dmat4(1.0), 0.09, glm::dvec3(0, 1, 0));
  const MaterialCalibration found = calibrated(scene);
  EXPECT_FALSE(found.report.pass);
  EXPECT_NE(why(found).find(scene.views[1].name + ": wrong pose"), std::string::npos) << why(found);
  EXPECT_EQ(why(found).find(scene.views[0].name + ": wrong pose"), std::string::npos) << why(found);
}

TEST_F(Materials, a_wrong_scale_is_named) {
  for (const float scale : {0.5f, 1.7f}) {
    MaterialScene scene = *scene_;
    for (MaterialView& view : scene.views)
      for (Rgb& texel : view.radiance.texels)
        texel *= scale;
    const MaterialCalibration found = calibrated(scene);
    EXPECT_FALSE(found.report.pass) << scale;
    EXPECT_NE(why(found).find("wrong scale"), std::string::npos) << why(found);
  }
}

TEST_F(Materials, one_picture_of_another_exposure_is_named) {
  MaterialScene scene = *scene_;
  for (Rgb& texel : scene.views[2].radiance.texels)
    texel *= 1.4f;
  const MaterialCalibration found = calibrated(scene);
  EXPECT_FALSE(found.report.pass);
  EXPECT_NE(why(found).find(scene.views[2].name + ": 1."), std::string::npos) << why(found);
}

TEST_F(Materials, a_sky_of_another_time_is_named) {
  auto turned = SkyImage::make(scene_->skies[0].image(),
                               [] {
                                 auto projection = std::get<FisheyeProjection>(scene_->skies[0].projection());
                                 projection.rotation = 0.8;
                                 return SkyProjection(projection);
                               }(),
                               {GroundFill::Kind::albedo, 0.2f});
  ASSERT_TRUE(turned) << turned.error().message();
  auto transport = RoomTransport::make(scene_->room.room, {Sky(*turned)}, quiet);
  ASSERT_TRUE(transport);
  const auto found = calibrate_materials(*scene_, **transport, quiet);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_FALSE(found->report.pass);
  EXPECT_NE(why(*found).find("wrong sky"), std::string::npos) << why(*found);
}

TEST_F(Materials, over_exposed_pictures_are_named) {
  MaterialScene scene = *scene_;
  for (MaterialView& view : scene.views)
    for (std::size_t i = 0; i < view.left_out.size(); i += 5)
      view.left_out[i] = MaterialView::kOverRange;
  const MaterialCalibration found = calibrated(scene);
  EXPECT_NE(why(found).find("over-exposed"), std::string::npos) << why(found);
}

TEST_F(Materials, the_pose_may_come_from_a_marker_board_in_the_picture) {
  LensModel lens = ideal_pinhole(480, 360, 0.9);
  const auto print = PrintedBoard::print(BoardLayout::single("6X6_250", 23, 0.2), 0.05);
  ASSERT_TRUE(print);
  const glm::dmat4 world_from_camera = look_at({0.6, 1.9, 1.0}, {1.5, 1.2, 0.0});
  glm::dmat4 world_from_board(1.0);
  world_from_board[3] = {1.5, 1.2, 0.0, 1.0};
  const Rgb8Image seen = BoardCamera(lens, {}).picture(*print, glm::inverse(world_from_camera) * world_from_board, 1);
  ASSERT_TRUE(write_png(folder_ / "out/board.png", seen));
  ASSERT_TRUE(write_lens(folder_ / "out/board.yaml", lens));
  std::ofstream(folder_ / "out/board.toml")
      << "[sky]\nimage = \"sky.exr\"\nprojection = \"fisheye\"\nlens = \"sky.yaml\"\nground = { albedo = 0.2 }\n"
         "[interior]\nimage = \"board.png\"\nlens = \"board.yaml\"\nresponse = \"srgb\"\n"
         "[marker]\nids = [23]\nsize_m = 0.2\nworld_from_board = [1, 0, 0, 1.5, 0, 1, 0, 1.2, 0, 0, 1, 0, 0, 0, 0, 1]\n"
         "[room]\nmodel = \"../guess.obj\"\n";
  const auto scene = read_material_scene({folder_ / "out/board.toml"}, {});
  ASSERT_TRUE(scene) << scene.error().message();
  const glm::dmat4 off = glm::inverse(world_from_camera) * scene->views[0].world_from_camera;
  EXPECT_LT(glm::length(glm::dvec3(off[3])), 0.02);
  EXPECT_NEAR(off[0][0] + off[1][1] + off[2][2], 3.0, 1e-3);
}

TEST_F(Materials, the_program_writes_a_room_that_reads_as_the_same) {
  std::string configs;
  for (const auto& config : test::view_configs(folder_))
    configs += config.string() + " ";
  const auto found = test::calibrate(folder_, "materials " + configs + "-o found.obj --report out");
  ASSERT_EQ(found.exit_code, 0) << found.json;
  EXPECT_EQ(found.json.value("verdict", ""), "pass") << found.json;
  const auto room = read_room(folder_ / "found.obj");
  ASSERT_TRUE(room) << room.error().message();
  EXPECT_EQ(room->room.triangles.size(), scene_->room.room.triangles.size());
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/report.html"));
  EXPECT_EQ(test::calibrate(folder_, "materials " + configs + "-o found.txt").exit_code, 2);
}

} // namespace
} // namespace daylit::calibration
