// Lens files of other programs beside their own formulas.

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/lens/lens.h"

namespace daylit {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kPolynomial[] = {-225.1, 0.0, 1.22e-3, -6.1e-7, 1.32e-9};

std::string ocam(const std::string& affine, const std::string& more = "") {
  return "#polynomial coefficients for the DIRECT mapping function (ocam_model.ss in MATLAB). These are used by "
         "cam2world\n\n"
         "5 -2.251000e+02 0.000000e+00 1.220000e-03 -6.100000e-07 1.320000e-09 \n\n"
         "#polynomial coefficients for the inverse mapping function (ocam_model.invpol in MATLAB). These are used by "
         "world2cam\n\n3 350.0 200.0 1.0\n\n"
         "#center: \"row\" and \"column\", starting from 0 (C convention)\n\n386.5 512.25\n\n"
         "#affine parameters \"c\", \"d\", \"e\"\n\n" +
         affine + "\n\n#image size: \"height\" and \"width\"\n\n768 1024\n" + more;
}

/// The angle of the ray (a, b, polynomial(r)) from the axis, which is -z in OCamCalib's frame.
double theta_of(double r) {
  double z = 0;
  for (int k = 4; k >= 0; --k)
    z = z * r + kPolynomial[k];
  return std::atan2(r, -z);
}

TEST(OcamLens, pixels_are_those_of_the_polynomial_to_a_third_of_a_pixel) {
  const auto lens = parse_lens(ocam("1.0004 0.0001 -0.0002", "#max_theta_deg\n93\n"), "calib_results.txt");
  ASSERT_TRUE(lens) << lens.error().message();
  EXPECT_EQ(lens->width_px, 1024);
  EXPECT_NEAR(lens->max_theta, 93 * kDegree, 0.5 * kDegree);
  for (double r = 5; theta_of(r) < 92 * kDegree; r += 5)
    for (double phi = 0; phi < 6.28; phi += 0.4) {
      const double a = r * std::sin(phi), b = r * std::cos(phi), t = theta_of(r); // a: down, b: right
      const auto at = lens->project({std::sin(t) * std::cos(phi), std::sin(t) * std::sin(phi), std::cos(t)});
      ASSERT_TRUE(at) << r;
      EXPECT_NEAR(at->x, -0.0002 * a + b + 512.25, 0.33) << r;
      EXPECT_NEAR(at->y, 1.0004 * a + 0.0001 * b + 386.5, 0.33) << r;
    }
  const auto usual = parse_lens(ocam("1 0 0"), "calib_results.txt");
  ASSERT_TRUE(usual);
  EXPECT_NEAR(usual->max_theta, 90 * kDegree, 0.5 * kDegree) << "the field where nothing is said";
}

TEST(OcamLens, what_cannot_be_kept_or_read_is_refused) {
  const auto skewed = parse_lens(ocam("1 0.02 0"), "x.txt");
  ASSERT_FALSE(skewed);
  EXPECT_NE(skewed.error().what.find("pixels from any lens"), std::string::npos) << skewed.error().message();
  EXPECT_FALSE(parse_lens(ocam("1 nan 0"), "x.txt"));
  EXPECT_FALSE(parse_lens(ocam("1 0"), "x.txt"));
  std::string cut = ocam("1 0 0");
  for (std::size_t n = 60; n < cut.size() - 10; n += 17)
    EXPECT_FALSE(parse_lens(cut.substr(0, n), "x.txt")) << n;
}

std::string header(const std::string& view, const std::string& size = "-Y 400 +X 400") {
  return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nVIEW= -vtv -vh 10 -vv 10\n" + view + "\n\n" + size + "\n";
}

TEST(RadianceView, an_angular_fisheye_is_a_lens_with_its_orientation) {
  const auto lens = parse_lens(header("VIEW= -vta -vp 0 0 1 -vd 0 0 1 -vu 0 1 0 -vh 180 -vv 180"), "sky.hdr");
  ASSERT_TRUE(lens) << lens.error().message();
  EXPECT_EQ(lens->kind, LensKind::equidistant);
  EXPECT_EQ(lens->height_px, 400);
  const auto right = lens->unproject({399.5, 199.5}), above = lens->unproject({199.5, -0.5});
  ASSERT_TRUE(right && above);
  EXPECT_NEAR(glm::distance(lens->world_from_camera * *right, glm::dvec3(-1, 0, 0)), 0, 1e-9) << "right = forward x up";
  EXPECT_NEAR(glm::distance(lens->world_from_camera * *above, glm::dvec3(0, 1, 0)), 0, 1e-9);
  EXPECT_NEAR(lens->max_theta, 90 * kDegree, 1e-12);
}

TEST(RadianceView, a_perspective_view_has_its_focal_length_and_other_views_are_refused) {
  const auto lens = parse_lens(header("VIEW= -vtv -vd 1 0 0 -vu 0 0 1 -vh 90 -vv 60", "-Y 300 +X 500"), "x.hdr");
  ASSERT_TRUE(lens) << lens.error().message();
  EXPECT_NEAR(lens->fx, 250, 1e-9);
  EXPECT_NEAR(lens->fy, 150 / std::tan(30 * kDegree), 1e-9);
  for (const char* view : {"VIEW= -vth -vh 180 -vv 180", "VIEW= -vta -vh 180 -vv 180 -vs 0.5", "VIEW= -vta -vh 180",
                           "VIEW= -vta -vh 400 -vv 400", "VIEW= -vta -vh 180 -vv 180 -vd 0 0 1 -vu 0 0 1"})
    EXPECT_FALSE(parse_lens(header(view), "x.hdr")) << view;
  EXPECT_FALSE(parse_lens(header("", "+X 500"), "x.hdr"));
}

TEST(RadianceView, of_a_large_picture_only_the_beginning_is_read) {
  const auto path = std::filesystem::temp_directory_path() / "daylit-large-view.hdr";
  std::ofstream(path) << header("VIEW= -vta -vd 0 0 1 -vu 0 1 0 -vh 180 -vv 180") << std::string(3 << 20, 'x');
  EXPECT_TRUE(read_lens(path));
  std::ofstream(path) << std::string(3 << 20, ' ');
  EXPECT_FALSE(read_lens(path));
  std::filesystem::remove(path);
}

} // namespace
} // namespace daylit
