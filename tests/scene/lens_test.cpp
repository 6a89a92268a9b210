#include "scene/lens/lens.h"

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

LensModel distorted_fisheye() {
  LensModel lens = ideal_fisheye(1032, 778, 210 * kPi / 180);
  lens.fx = 336.8, lens.fy = 336.4, lens.cx = 543.4, lens.cy = 377.7;
  lens.distortion = {-0.0021, -0.0008, -0.0029, 0.0003, 0, 0, 0, 0};
  lens.max_theta = monotone_field(lens.kind, lens.distortion, lens.max_theta);
  return lens;
}

LensModel distorted_pinhole() {
  LensModel lens = ideal_pinhole(640, 480, 1.0);
  lens.distortion = {-0.281, 0.025, 0.0012, -0.0001, 0.163, 0, 0, 0};
  lens.max_theta = monotone_field(lens.kind, lens.distortion, kPi / 2);
  return lens;
}

glm::dvec3 at_angles(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

TEST(Lens, equidistant_round_trip_to_1e_12_beyond_90_degrees) {
  const LensModel lens = distorted_fisheye();
  ASSERT_GT(lens.max_theta, 100 * kPi / 180);
  for (double theta = 0; theta < lens.max_theta; theta += 0.01)
    for (double phi = 0; phi < 6.3; phi += 0.7) {
      const glm::dvec3 d = at_angles(theta, phi);
      const auto pixel = lens.project(d);
      ASSERT_TRUE(pixel);
      const auto back = lens.unproject(*pixel);
      ASSERT_TRUE(back);
      EXPECT_LT(glm::length(*back - d), 1e-12) << theta;
    }
}

TEST(Lens, ideal_fisheye_is_linear_in_the_angle) {
  const LensModel lens = ideal_fisheye(512, 496, 190 * kPi / 180);
  const auto rim = lens.project(at_angles(95 * kPi / 180, 0)), half = lens.project(at_angles(47.5 * kPi / 180, 0));
  ASSERT_TRUE(rim && half);
  EXPECT_NEAR(rim->x - lens.cx, 248, 1e-9); // the circle touches the shorter side
  EXPECT_NEAR(half->x - lens.cx, 124, 1e-9);
  EXPECT_FALSE(lens.project(at_angles(95.1 * kPi / 180, 0)));
  EXPECT_FALSE(lens.unproject({lens.cx + 248.1, lens.cy}));
}

TEST(Lens, pinhole_round_trip_to_1e_12) {
  LensModel rational = distorted_pinhole();
  rational.distortion = {0.3, -0.1, 0.001, -0.002, 0.01, 0.5, -0.05, 0.002};
  for (const LensModel& lens : {ideal_pinhole(640, 480, 1.0), distorted_pinhole(), rational})
    for (double theta = 0; theta < 0.6; theta += 0.05)
      for (double phi = 0; phi < 6.3; phi += 0.3) {
        const glm::dvec3 d = at_angles(theta, phi);
        const auto back = lens.unproject(*lens.project(d));
        ASSERT_TRUE(back);
        EXPECT_LT(glm::length(*back - d), 1e-12) << theta << " " << phi;
      }
  EXPECT_FALSE(ideal_pinhole(640, 480, 1.0).project({0, 0, -1}));
}

TEST(Lens, a_folding_polynomial_limits_the_field) {
  // r (1 - 0.281 r^2 + ...) turns back at some radius: directions beyond it must not land in the image again.
  LensModel lens = distorted_pinhole();
  lens.distortion = {-0.4, 0, 0, 0, 0, 0, 0, 0};
  lens.max_theta = monotone_field(lens.kind, lens.distortion, kPi / 2);
  EXPECT_NEAR(std::tan(lens.max_theta), std::sqrt(1 / 1.2), 2e-3); // d(r - 0.4 r^3)/dr = 0
  EXPECT_FALSE(lens.project(at_angles(1.2, 0)));
}

TEST(Lens, solid_angle_density_is_the_jacobian) {
  for (const LensModel& lens : {distorted_fisheye(), distorted_pinhole()})
    for (const glm::dvec2 offset : {glm::dvec2(0, 0), glm::dvec2(60, 100), glm::dvec2(-180, 40)}) {
      const glm::dvec2 p = glm::dvec2(lens.cx, lens.cy) + offset;
      const double h = 1e-3;
      const glm::dvec3 du = (*lens.unproject({p.x + h, p.y}) - *lens.unproject({p.x - h, p.y})) / (2 * h);
      const glm::dvec3 dv = (*lens.unproject({p.x, p.y + h}) - *lens.unproject({p.x, p.y - h})) / (2 * h);
      EXPECT_NEAR(lens.solid_angle_density(p) / glm::length(glm::cross(du, dv)), 1.0, 1e-6);
    }
}

TEST(LensFile, ros_kalibr_and_opencv_spellings_are_read) {
  const auto ros = parse_lens("image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
                              "  data: [500, 0, 320, 0, 501, 240, 0, 0, 1]\ndistortion_model: equidistant\n"
                              "distortion_coefficients:\n  data: [0.1, 0.2, 0.3, 0.4]\nmax_theta_deg: 95\n",
                              "ros");
  ASSERT_TRUE(ros) << ros.error().message();
  EXPECT_EQ(ros->kind, LensKind::equidistant);
  EXPECT_NEAR(ros->max_theta, 95 * kPi / 180, 1e-12);
  const auto kalibr = parse_lens("cam0:\n  camera_model: pinhole\n  intrinsics: [500, 501, 320, 240]\n"
                                 "  distortion_model: radtan\n  distortion_coeffs: [0.1, 0.2, 0.003, 0.004]\n"
                                 "  resolution: [640, 480]\n",
                                 "kalibr");
  ASSERT_TRUE(kalibr) << kalibr.error().message();
  EXPECT_EQ(kalibr->fy, 501);
  EXPECT_EQ(kalibr->width_px, 640);
  const auto opencv = parse_lens("%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
                                 "   data: [ 6.2e+02, 0., 324.,\n       0., 628.156, 260.908,\n       0., 0., 1. ]\n"
                                 "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n"
                                 "   data: [ 0.0995485, -0.206384,\n       0.00754589, 0.00336531, 0 ]\n",
                                 "opencv");
  ASSERT_TRUE(opencv) << opencv.error().message();
  EXPECT_EQ(opencv->fx, 620);
  EXPECT_EQ(opencv->distortion[3], 0.00336531);
  EXPECT_EQ(opencv->width_px, 0);
}

TEST(LensFile, the_shared_camera_files_are_read) {
  const std::filesystem::path data = std::filesystem::path(DAYLIT_SOURCE_DIR) / "../shared/data";
  if (!std::filesystem::exists(data))
    GTEST_SKIP() << "the shared data are not here";
  const auto markers = read_lens(data / "markers/tutorial_camera_params.yml");
  ASSERT_TRUE(markers) << markers.error().message();
  EXPECT_EQ(markers->fx, 628.158);
  const auto chessboard = read_lens(data / "chessboard/left_intrinsics.yml");
  ASSERT_TRUE(chessboard) << chessboard.error().message();
  EXPECT_EQ(chessboard->height_px, 480);
}

TEST(LensFile, written_file_reads_back) {
  std::string pattern = (std::filesystem::temp_directory_path() / "daylit-lens-XXXXXX").string();
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  LensModel lens = distorted_fisheye();
  const glm::dvec3 z = glm::normalize(glm::dvec3(1, 2, 3)), x = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), z));
  lens.world_from_camera = glm::dmat3(x, glm::cross(z, x), z);
  ASSERT_TRUE(write_lens(pattern + "/lens.yaml", lens));
  const auto back = read_lens(pattern + "/lens.yaml");
  std::filesystem::remove_all(pattern);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->fx, lens.fx);
  EXPECT_EQ(back->distortion, lens.distortion);
  EXPECT_NEAR(back->max_theta, lens.max_theta, 1e-3); // monotone_field is found in steps
  for (int c = 0; c < 3; ++c)
    EXPECT_LT(glm::length(back->world_from_camera[c] - lens.world_from_camera[c]), 1e-12);
}

TEST(LensFile, bad_files_name_the_key) {
  const std::string matrix = "camera_matrix: [500, 0, 320, 0, 501, 240, 0, 0, 1]\n";
  const std::pair<std::string, std::string> cases[] = {
      {"distortion_model: plumb_bob\n", "camera_matrix"},
      {"camera_matrix: [1, 2]\n", "camera_matrix"},
      {"camera_matrix: [500, 0, 320, 0, .nan, 240, 0, 0, 1]\n", "camera_matrix"},
      {"camera_matrix: [-500, 0, 320, 0, 500, 240, 0, 0, 1]\n", "camera_matrix"},
      {"camera_matrix: {rows: 3}\n", "camera_matrix"},
      {matrix + "distortion_model: omni\n", "distortion_model"},
      {matrix + "distortion_model: equidistant\ndistortion_coefficients: [1]\n", "distortion_coefficients"},
      {matrix + "distortion_coefficients: [a, b, c, d]\n", "distortion_coefficients"},
      {matrix + "image_width: -3\nimage_height: 3\n", "image_width"},
      {matrix + "world_from_camera: [1, 0, 0, 0, 1, 0]\n", "world_from_camera"},
      {matrix + "world_from_camera: [2, 0, 0, 0, 1, 0, 0, 0, 1]\n", "world_from_camera"},
      {matrix + "world_from_camera: [-1, 0, 0, 0, 1, 0, 0, 0, 1]\n", "world_from_camera"},
      {matrix + "max_theta_deg: 200\n", "max_theta_deg"},
      {matrix + "cam0: {camera_model: omni}\n", "camera_model"},
  };
  for (const auto& [text, key] : cases) {
    const auto lens = parse_lens(text, "bad.yaml");
    ASSERT_FALSE(lens) << text;
    EXPECT_NE(lens.error().where.find(key), std::string::npos) << lens.error().message();
  }
  for (const char* text : {"", "[", "42", "a: b: c", "%YAML:1.0", "{{{{", "\x01\x02", "- 1\n- 2\n", "&a [*a]"})
    EXPECT_FALSE(parse_lens(text, "bad.yaml")) << text;
  EXPECT_FALSE(parse_lens(std::string(100000, '['), "deep.yaml"));
}

} // namespace
} // namespace daylit
