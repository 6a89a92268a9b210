// Orientation of a sky camera: simulated days, with the sun and with clouds; known points; what is said of bad input.

#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "calibration/orientation_fit.h"
#include "calibration/sun_spot.h"
#include "scene/image/image_formats.h"
#include "scene/sky/sun_position.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit::calibration {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180.0;
const Place kPlace{50.36, 7.6, 1.0};

/// A day in front of a fish-eye that looks up, not quite, and is turned.
struct SimulatedDay {
  LensModel lens = ideal_fisheye(512, 496, 190 * kDegree);
  std::mt19937 random;
  explicit SimulatedDay(unsigned seed) : random(seed) {
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    const glm::dmat3 up{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}}; // x right, y down, z forward; mirrored below
    const glm::dquat turn = glm::angleAxis(3.0 * u(random), glm::dvec3(0, 0, 1)) *
                            glm::angleAxis(0.3 * u(random), glm::normalize(glm::dvec3(u(random), u(random), 0)));
    lens.world_from_camera = glm::mat3_cast(turn) * glm::dmat3(up[0], -up[1], up[2]);
  }

  /// Sky with bright clouds; a sun of half a degree as area coverage, unless a cloud is before it.
  RgbImage picture(const LocalTime& time, bool cloudy) {
    std::uniform_real_distribution<double> u(0.0, 1.0);
    const double phase = 6.28 * u(random), relative = 0.01;
    std::normal_distribution<double> noise(1.0, relative);
    const glm::dvec3 sun = glm::transpose(lens.world_from_camera) * sun_position(kPlace, time).direction;
    const auto at = lens.project(sun);
    RgbImage image(lens.width_px, lens.height_px);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const auto d = lens.unproject({x, y});
        if (!d)
          continue;
        const double apart = glm::length(*d - sun);
        const double cloud = std::max(0.0, std::sin(5 * d->x + phase) + std::sin(7 * d->y + 2 * phase));
        double value = 1.0 + 1.5 * cloud + (cloudy ? 12.0 : 20.0) * std::exp(-apart / (cloudy ? 0.15 : 0.05));
        if (at && !cloudy)
          value += 1e5 * std::max(0.0, 1 - std::abs(x - at->x)) * std::max(0.0, 1 - std::abs(y - at->y));
        image.at(x, y) = Rgb(static_cast<float>(value * noise(random)));
      }
    return image;
  }
};

std::vector<LocalTime> hours() {
  std::vector<LocalTime> times;
  for (int h = 8; h <= 17; ++h)
    times.push_back({2026, 6, 3, h + 0.37});
  return times;
}

/// Error of the orientation, degrees, after a day of ten pictures of which every second may be cloudy.
double error_after_day(unsigned seed, bool clouds, double* sigma = nullptr) {
  SimulatedDay day(seed);
  std::vector<Sighting> sightings;
  int k = 0;
  for (const LocalTime& time : hours()) {
    std::string why;
    if (const auto sun = find_sun(day.picture(time, clouds && k++ % 2 == 1), day.lens, INFINITY, why))
      sightings.push_back({time_text(time), sun->direction, sun_position(kPlace, time).direction});
  }
  const auto fit = fit_orientation(sightings, 1.5, 3);
  EXPECT_TRUE(fit);
  if (sigma)
    *sigma = fit->sigma_deg;
  return turn_between(fit->world_from_camera, day.lens.world_from_camera);
}

TEST(Alignment, a_day_with_sun_gives_the_orientation) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    double sigma = 0;
    const double error = error_after_day(seed, false, &sigma);
    EXPECT_LT(error, 0.03) << seed;
    EXPECT_LT(error, 4 * sigma) << "the stated uncertainty";
  }
}

TEST(Alignment, clouds_half_of_the_time_do_little_harm) {
  for (unsigned seed = 4; seed <= 6; ++seed)
    EXPECT_LT(error_after_day(seed, true), 0.05) << seed;
}

std::vector<Sighting> random_sightings(const glm::dmat3& world_from_camera, int count, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Sighting> sightings;
  for (int k = 0; k < count; ++k) {
    const glm::dvec3 d = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    const glm::dvec3 off = noise * glm::dvec3(normal(random), normal(random), normal(random));
    sightings.push_back({"s" + std::to_string(k), d, glm::normalize(world_from_camera * d + off)});
  }
  return sightings;
}

TEST(Alignment, wrong_directions_are_left_out_and_the_uncertainty_holds) {
  const glm::dmat3 truth = glm::mat3_cast(glm::angleAxis(1.0, glm::normalize(glm::dvec3(1, 2, 3))));
  int within = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    auto sightings = random_sightings(truth, 9, 0.002, seed);
    sightings[2].world = -sightings[2].world;
    sightings[5].world = sightings[6].world;
    const auto fit = fit_orientation(sightings, 1.5, 3);
    ASSERT_TRUE(fit);
    EXPECT_FALSE(fit->used[2] || fit->used[5]);
    within += turn_between(fit->world_from_camera, truth) < 2 * fit->sigma_deg ? 1 : 0;
  }
  EXPECT_GE(within, 28) << "two standard deviations of the worst axis, three axes";
}

TEST(Alignment, one_direction_is_refused) {
  std::vector<Sighting> same(5, {"s", {0, 0, 1}, {1, 0, 0}});
  EXPECT_FALSE(fit_orientation(same, 1.5, 3));
  EXPECT_FALSE(fit_orientation({}, 1.5, 3));
}

/// Pictures of four hours of the day; line(name, time) is called for each. Their names, a blank after each.
std::string write_hours(const fs::path& folder, SimulatedDay& day,
                        const std::function<void(const std::string&, const LocalTime&)>& line) {
  std::string names;
  for (const LocalTime& time : {hours()[0], hours()[3], hours()[6], hours()[9]}) {
    const std::string name = "sky" + std::to_string(static_cast<int>(time.hour)) + ".exr";
    EXPECT_TRUE(write_exr(folder / name, day.picture(time, false)));
    names += name + " ";
    line(name, time);
  }
  return names;
}

TEST(AlignProgram, pictures_of_a_day_give_a_lens_file_and_a_wrong_clock_is_noticed) {
  const fs::path folder = test::fresh_folder("align");
  SimulatedDay day(7);
  LensModel lens = day.lens;
  lens.world_from_camera = glm::dmat3(1.0);
  ASSERT_TRUE(write_lens(folder / "lens.yaml", lens));
  std::ofstream times(folder / "times.txt"), late(folder / "late.txt"), night(folder / "night.txt");
  const std::string names = write_hours(folder, day, [&](const std::string& name, const LocalTime& time) {
    times << name << " " << time_text(time) << "\n";
    LocalTime wrong = time;
    wrong.day = wrong.hour > 11 ? 25 : 3; // two clocks
    wrong.month = wrong.hour > 11 ? 12 : 6;
    late << name << " " << time_text(wrong) << "\n";
    wrong.hour = 1;
    night << name << " " << time_text(wrong) << "\n";
  });
  for (std::ofstream* file : {&times, &late, &night})
    file->close();
  const std::string align =
      "align " + names + "--lens lens.yaml --place 50.36,7.6,1 -o aligned.yaml --report r --times ";
  const auto good = test::calibrate(folder, align + "times.txt");
  EXPECT_EQ(good.json.value("verdict", ""), "pass") << good.json;
  const auto aligned = read_lens(folder / "aligned.yaml");
  ASSERT_TRUE(aligned) << aligned.error().message();
  EXPECT_LT(turn_between(aligned->world_from_camera, day.lens.world_from_camera), 0.15);
  const auto wrong = test::calibrate(folder, align + "late.txt");
  EXPECT_EQ(wrong.json.value("verdict", ""), "repeat") << wrong.json;
  const auto dark = test::calibrate(folder, align + "night.txt");
  EXPECT_EQ(dark.exit_code, 1);
  EXPECT_EQ(dark.json.value("verdict", ""), "repeat") << dark.json;
  EXPECT_TRUE(test::says(dark, "should be below the horizon")) << dark.json;
}

TEST(AlignProgram, a_sun_where_it_should_be_night_is_said_and_the_direction_of_the_camera_is_printed) {
  const fs::path folder = test::fresh_folder("align-night");
  SimulatedDay day(11);
  ASSERT_TRUE(write_lens(folder / "lens.yaml", day.lens));
  std::ofstream times(folder / "times.txt"), one(folder / "one.txt");
  const std::string names = write_hours(folder, day, [&](const std::string& name, const LocalTime& time) {
    times << name << " " << time_text(time) << "\n";
    one << name << " " << time_text(time.hour > 17.0 ? LocalTime{2026, 6, 3, 1.0} : time) << "\n";
  });
  times.close();
  one.close();
  const std::string align =
      "align " + names + "--lens lens.yaml --place 50.36,7.6,1 --north 20 -o aligned.yaml --times ";
  const auto good = test::calibrate(folder, align + "times.txt");
  EXPECT_EQ(good.json.value("verdict", ""), "pass") << good.json;
  EXPECT_EQ(good.json.value("north_deg", 0.0), 20.0);
  EXPECT_EQ(good.json.value("turn_per_minute_of_clock_deg", 0.0), 0.25);
  const glm::dvec3 axis = day.lens.world_from_camera[2], top = -day.lens.world_from_camera[1];
  const auto azimuth = [](const glm::dvec3& d) { return std::atan2(d.x, d.y) / kDegree; };
  EXPECT_NEAR(std::remainder(good.json.value("axis_azimuth_deg", -1.0) - azimuth(axis), 360.0), 0.0, 1.0);
  EXPECT_NEAR(std::remainder(good.json.value("top_azimuth_deg", -1.0) - azimuth(top), 360.0), 0.0, 0.2);
  EXPECT_TRUE(test::says(good, "apart from the clock")) << good.json;
  const auto night = test::calibrate(folder, align + "one.txt --force");
  EXPECT_EQ(night.json.value("verdict", ""), "repeat") << night.json;
  EXPECT_TRUE(test::says(night, "sky17.exr: the sun is seen where it should be below the horizon")) << night.json;
}

TEST(AlignProgram, known_points_give_the_orientation) {
  const fs::path folder = test::fresh_folder("points");
  const SimulatedDay day(9);
  ASSERT_TRUE(write_lens(folder / "lens.yaml", day.lens));
  ASSERT_TRUE(write_exr(folder / "sky.exr", RgbImage(4, 4)));
  std::ofstream points(folder / "points.txt");
  const glm::dvec3 position(0.4, 1.2, 2.0);
  int count = 0;
  for (const glm::dvec3& p : {glm::dvec3(3, 1, 4), glm::dvec3(-2, 5, 6), glm::dvec3(0, -4, 5), glm::dvec3(1, 2, 9)}) {
    const auto px = day.lens.project(glm::transpose(day.lens.world_from_camera) * (p - position));
    ASSERT_TRUE(px);
    points << std::round(px->x) << " " << std::round(px->y) << " " << p.x << " " << p.y << " " << p.z << " corner "
           << count++ << "\n";
  }
  points.close();
  const auto found =
      test::calibrate(folder, "align sky.exr --lens lens.yaml --landmarks points.txt --position 0.4,1.2,2 -o out.yaml");
  EXPECT_EQ(found.exit_code, 0) << found.json;
  const auto aligned = read_lens(folder / "out.yaml");
  ASSERT_TRUE(aligned);
  EXPECT_LT(turn_between(aligned->world_from_camera, day.lens.world_from_camera), 0.3);
}

} // namespace
} // namespace daylit::calibration
