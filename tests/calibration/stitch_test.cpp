// Maps from hand-held pictures, through the programs' own command lines.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "calibration/hand_held_list.h"
#include "calibration/rotation_match.h"
#include "scene/image/image_formats.h"
#include "scene/sky/sky_image.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;
using test::says;

/// Of the texels of an equirectangular map of 512 x 256.
std::vector<glm::dvec3> texel_directions() {
  const auto geometry = *SkyGeometry::make(512, 256, EquirectProjection{});
  std::vector<glm::dvec3> directions;
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 512; ++x)
      directions.push_back(*geometry->direction({x, y}));
  return directions;
}

/// Discs of many sizes and colours on a sphere, and a small bright one.
RgbImage spotted_map() {
  const auto directions = texel_directions();
  RgbImage map(512, 256, Rgb(0.3f));
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 700; ++k) {
    const glm::dvec3 at = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    const double cosine = std::cos(0.02 + 0.1 * u(random) * u(random));
    const Rgb colour = k == 699 ? Rgb(60.0f, 55.0f, 50.0f) : Rgb(u(random), u(random), u(random));
    for (std::size_t i = 0; i < directions.size(); ++i)
      if (glm::dot(directions[i], at) > (k == 699 ? std::cos(0.03) : cosine))
        map.texels[i] = colour;
  }
  return map;
}

double irradiance(const SkyImage& sky, const glm::dvec3& normal) {
  double sum = 0;
  for (int y = 0; y < sky.image().height; ++y)
    for (int x = 0; x < sky.image().width; ++x)
      sum += std::max(0.0, glm::dot(*sky.direction({x, y}), normal)) *
             static_cast<double>(luminance(sky.image().at(x, y))) *
             static_cast<double>(sky.solid_angle_sr()[static_cast<std::size_t>(y) * sky.image().width + x]);
  return sum;
}

/// Soft clouds: nothing that a corner detector finds.
RgbImage soft_map() {
  const auto directions = texel_directions();
  RgbImage map(512, 256, Rgb(0.2f));
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 60; ++k) {
    const glm::dvec3 at = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    for (std::size_t i = 0; i < directions.size(); ++i)
      map.texels[i] += Rgb(static_cast<float>(0.5 * std::exp((glm::dot(directions[i], at) - 1.0) / 0.02)));
  }
  return map;
}

/// world_from_camera of each line of a list.
std::vector<glm::dmat3> orientations(const fs::path& list) {
  std::vector<glm::dmat3> all;
  const auto listed = *calibration::read_picture_list(list);
  for (const auto& one : listed)
    all.push_back(one.world_from_camera);
  return all;
}

std::vector<glm::dmat3> found_orientations(const nlohmann::json& report) {
  std::vector<glm::dmat3> all;
  for (const auto& picture : report["pictures"]) {
    all.emplace_back();
    for (int k = 0; k < 9; ++k)
      all.back()[k % 3][k / 3] = picture["world_from_camera"][static_cast<std::size_t>(k)];
  }
  return all;
}

/// The largest error, degrees, of the turn between two pictures that look into nearly the same direction.
double worst_turn_between(const std::vector<glm::dmat3>& found, const std::vector<glm::dmat3>& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (glm::dot(truth[i][2], truth[j][2]) > 0.7) {
        const glm::dmat3 a = glm::transpose(found[i]) * found[j], b = glm::transpose(truth[i]) * truth[j],
                         off = glm::transpose(a) * b;
        worst = std::max(worst, std::acos(std::clamp(0.5 * (off[0][0] + off[1][1] + off[2][2] - 1), -1.0, 1.0)));
      }
  return worst * 180 / std::numbers::pi;
}

fs::path pictures(const std::string& name, const std::string& options, const RgbImage& map = spotted_map()) {
  const fs::path folder = test::fresh_folder(name);
  EXPECT_TRUE(write_exr(folder / "map.exr", map));
  EXPECT_EQ(std::system(("cd '" + folder.string() +
                         "' && " DAYLIT_BINARY_DIR
                         "/bin/daylit-simulate hand-held map.exr -o p --size 400,300 --fov 85 --quiet " +
                         options + " > /dev/null 2> stderr.txt")
                            .c_str()),
            0);
  return folder;
}

TEST(ProbeStitch, a_map_comes_back_from_pictures_with_rough_orientations) {
  const fs::path folder = pictures("stitch", "--pictures 24");
  const auto done = test::calibrate(folder, "probe-stitch p/list.txt --lens p/lens.yaml --height 256 -o found.exr");
  ASSERT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.json["verdict"], "pass") << done.json["why"];
  EXPECT_GT(done.json["coverage"], 0.999);
  EXPECT_LT(done.json["match_rms_deg"], 0.2);
  const auto truth = read_sky(folder / "map.exr", EquirectProjection{}),
             found = read_sky(folder / "found.exr", EquirectProjection{});
  ASSERT_TRUE(truth && found);
  for (const glm::dvec3& n : {glm::dvec3(1, 0, 0), {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}})
    EXPECT_NEAR(irradiance(*found, n) / irradiance(*truth, n), 1.0, 0.03) << n.x << " " << n.y << " " << n.z;
}

TEST(ProbeStitch, pictures_without_a_corner_are_aligned_by_their_light) {
  const fs::path folder = pictures("stitch-soft", "--pictures 24", soft_map());
  const auto done = test::calibrate(folder, "probe-stitch p/list.txt --lens p/lens.yaml --height 128 -o found.exr");
  ASSERT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.json["verdict"], "pass") << done.json["why"];
  EXPECT_LT(done.json["overlaps_matched"], 5);
  const auto truth = orientations(folder / "p/truth.txt"), rough = orientations(folder / "p/list.txt");
  EXPECT_GT(worst_turn_between(rough, truth), 4.0);
  EXPECT_LT(worst_turn_between(found_orientations(done.json), truth), 0.3);
  const auto exposed = *calibration::read_picture_list(folder / "p/truth.txt");
  std::vector<double> ratio;
  for (std::size_t i = 0; i < truth.size(); ++i)
    ratio.push_back(done.json["pictures"][i]["exposure"].get<double>() / exposed[i].exposure);
  EXPECT_LT(std::ranges::max(ratio) / std::ranges::min(ratio), 1.01) << "stated exposures are off by 3 %";
}

TEST(ProbeStitch, a_response_that_is_not_the_camera_s_is_said) {
  const fs::path folder = pictures("stitch-response", "--pictures 20", soft_map());
  const auto done =
      test::calibrate(folder, "probe-stitch p/list.txt --lens p/lens.yaml --response linear --height 64 -o found.exr");
  ASSERT_EQ(done.exit_code, 0);
  EXPECT_TRUE(says(done, "of 20 pictures were not exposed as stated: --response is not")) << done.json["why"];
}

TEST(ProbeStitch, rolls_of_the_wrong_sign_are_said_although_the_pictures_agree) {
  const fs::path folder = pictures("stitch-roll", "--pictures 24");
  std::ifstream list(folder / "p/list.txt");
  std::ofstream reversed(folder / "p/reversed.txt");
  std::string name, exposure;
  double azimuth = 0, altitude = 0, roll = 0;
  std::getline(list, name);
  while (list >> name >> exposure >> azimuth >> altitude >> roll)
    reversed << name << " " << exposure << " " << azimuth << " " << altitude << " " << -roll << "\n";
  reversed.close();
  const auto done = test::calibrate(folder, "probe-stitch p/reversed.txt --lens p/lens.yaml --height 64 -o found.exr");
  EXPECT_EQ(done.json["verdict"], "repeat");
  EXPECT_TRUE(says(done, "had to be turned by more than 3 times --off")) << done.json["why"];
}

TEST(ProbeStitch, pictures_with_nothing_in_common_are_no_map) {
  const fs::path folder = pictures("stitch-apart", "--pictures 24");
  std::ifstream list(folder / "p/list.txt");
  std::ofstream apart(folder / "p/apart.txt");
  std::string line;
  for (int k = -1; std::getline(list, line); ++k)
    if (k == 0 || k == 23)
      apart << line << "\n";
  apart.close();
  const auto done = test::calibrate(folder, "probe-stitch p/apart.txt --lens p/lens.yaml --height 64 -o found.exr");
  ASSERT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.json["verdict"], "repeat");
  EXPECT_TRUE(says(done, "nothing could be aligned")) << done.json["why"];
  for (const auto& picture : done.json["pictures"])
    EXPECT_LE(picture["sigma_deg"], 3.0) << "the list is right to --off";
}

TEST(ProbeStitch, gaps_are_counted_and_placed) {
  const fs::path folder = pictures("stitch-gap", "--pictures 14 --lowest 15");
  const auto done = test::calibrate(
      folder, "probe-stitch p/list.txt --lens p/lens.yaml --height 128 --projection angular -o found.exr");
  ASSERT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.json["verdict"], "repeat");
  EXPECT_TRUE(says(done, "is in no picture")) << done.json["why"];
  const double gap = done.json["gaps"][0]["solid_angle_sr"];
  EXPECT_NEAR(gap / (4 * std::numbers::pi), 1.0 - done.json["coverage"].get<double>(), 0.01);
  EXPECT_GT(gap, 2.0);
  EXPECT_LT(done.json["gaps"][0]["altitude_deg"], -70.0);
}

TEST(ProbeStitch, lists_that_cannot_be_read_are_refused_with_their_line) {
  const fs::path folder = pictures("stitch-list", "--pictures 2");
  const auto refused = [&](const std::string& list) {
    std::ofstream(folder / "p/bad.txt") << list;
    return test::calibrate(folder, "probe-stitch p/bad.txt --lens p/lens.yaml -o found.exr");
  };
  for (const char* list : {"000.png 0.1 0 0\n", "000.png -1 0 0 0\n", "000.png 0.1 nan 0 0\n", "# nothing\n",
                           "000.png 0.1 1 1 1 1\n", "missing.png 0.1 0 0 0\n", "000.png - 0 0 0\n"})
    EXPECT_EQ(refused(list).exit_code, 1) << list;
  EXPECT_EQ(refused("000.png 0.1 0 0 0\n").json["used"].size(), 1u) << "and a good one is read";
  EXPECT_FALSE(fs::exists(folder / "nothing.exr"));
}

TEST(RotationBetween, is_exact_without_noise_and_never_mirrors) {
  const glm::dmat3 turn(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6);
  std::vector<std::array<glm::dvec3, 2>> pairs;
  for (const glm::dvec3& d : {glm::dvec3(0, 0, 1), {0.6, 0, 0.8}})
    pairs.push_back({turn * d, d});
  const glm::dmat3 found = calibration::rotation_between(pairs);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(glm::distance(found[c], turn[c]), 0.0, 1e-9);
}

} // namespace
} // namespace daylit
