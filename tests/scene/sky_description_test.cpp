#include "scene/sky/sky_description.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/sky/sky.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

class SkyDescriptionTest : public testing::Test {
protected:
  void SetUp() override {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / ("daylit_sky_" + std::string(test->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path file(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  Result<SkyDescription> sky(const std::string& text) {
    return read_sky_description(file("sky.toml", "[sky]\n" + text));
  }
  std::filesystem::path folder_;
};

const std::string kWea = "place Test\nlatitude 40.78\nlongitude 73.97\ntime_zone 75\nsite_elevation 40\n"
                         "weather_data_file_units 1\n3 21 8.5 675 95\n3 21 3.5 0 0\n3 21 18.1 50 25\n";

double brute_force_horizontal(const Sky& sky) {
  constexpr int nz = 250, na = 400;
  double sum = 0.0;
  for (int i = 0; i < nz; ++i) {
    const double z = (i + 0.5) * 0.5 * kPi / nz;
    for (int k = 0; k < na; ++k) {
      const double a = (k + 0.5) * 2 * kPi / na;
      sum += static_cast<double>(sky.radiance({std::sin(z) * std::cos(a), std::sin(z) * std::sin(a), std::cos(z)}).g) *
             std::cos(z) * std::sin(z);
    }
  }
  return sum * 0.5 * kPi / nz * 2 * kPi / na;
}

TEST_F(SkyDescriptionTest, every_cie_type_has_the_diffuse_irradiance_that_was_asked_for) {
  for (int type = 1; type <= 15; ++type) {
    const auto d = sky("model = \"cie\"\ncie_type = " + std::to_string(type) +
                       "\ndiffuse_horizontal = 30\nsun = { azimuth = 20, elevation = 35, normal_irradiance = 100 }\n");
    ASSERT_TRUE(d) << d.error().message();
    EXPECT_NEAR(brute_force_horizontal(Sky(d->model)), 30.0, 30e-3) << type;
  }
}

TEST_F(SkyDescriptionTest, type_5_is_exactly_uniform_and_type_16_is_the_overcast_model) {
  const auto five = sky("model = \"cie\"\ncie_type = 5\nzenith_radiance = 2\n");
  ASSERT_TRUE(five) << five.error().message();
  const AnalyticSky uniform(five->model);
  for (const double z : {0.0, 0.01, 0.5, 1.0})
    EXPECT_EQ(uniform.sky_radiance({std::sqrt(1 - z * z), 0, z}), Rgb(2.0f));
  EXPECT_NEAR(uniform.diffuse_horizontal_irradiance().g, 2 * kPi, 1e-6);
  const auto sixteen = sky("model = \"overcast\"\nzenith_radiance = 3\n");
  EXPECT_FLOAT_EQ(AnalyticSky(sixteen->model).sky_radiance({0.8, 0, 0.6}).g, 2.2f);
}

// CIE 171 case 5.9: 1 x 1 m roof opening 3 m above, percent of the unobstructed irradiance; computed independently by
// Gauss rules.
TEST_F(SkyDescriptionTest, type_1_under_a_roof_opening_matches_the_reference_value) {
  const auto one = sky("model = \"cie\"\ncie_type = 1\n");
  const AnalyticSky analytic(one->model);
  constexpr int n = 300;
  double sum = 0.0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const glm::dvec3 p((i + 0.5) / n - 0.5, (j + 0.5) / n - 0.5, 3.0);
      const double r2 = glm::dot(p, p);
      sum += static_cast<double>(analytic.sky_radiance(p / std::sqrt(r2)).g) * 9.0 / (r2 * r2);
    }
  EXPECT_NEAR(100.0 * sum / (n * n) / static_cast<double>(analytic.diffuse_horizontal_irradiance().g), 4.3559, 3e-4);
}

TEST_F(SkyDescriptionTest, weather_tape_gives_its_illuminances) {
  const auto opened = open_sky({.file = file("t.wea", kWea), .time = "03-21 08:30"});
  ASSERT_TRUE(opened) << opened.error().message();
  const SunPosition sun = sun_position({40.78, -73.97, -5}, {.month = 3, .day = 21, .hour = 8.5});
  const auto perez = perez_sky({675, 95, sun.altitude, sun.distance});
  ASSERT_TRUE(perez);
  EXPECT_NEAR(brute_force_horizontal(opened->sky) * kLumensPerWatt / perez->diffuse_horizontal_lx, 1.0, 1e-3);
  ASSERT_TRUE(opened->sky.sun());
  EXPECT_NEAR(static_cast<double>(opened->sky.sun()->normal_irradiance.g) * kLumensPerWatt / perez->direct_normal_lx,
              1.0, 1e-6);
  EXPECT_NEAR(glm::distance(opened->sky.sun()->direction, sun.direction), 0.0, 1e-12);
  EXPECT_FALSE(opened->notes.empty());
}

TEST_F(SkyDescriptionTest, night_is_black_and_a_sun_on_the_horizon_is_left_out_with_a_note) {
  const auto night = open_sky({.file = file("t.wea", kWea), .time = "03-21 03:30"});
  ASSERT_TRUE(night) << night.error().message();
  EXPECT_EQ(night->sky.radiance({0, 0, 1}), Rgb(0.0f));
  EXPECT_FALSE(night->sky.sun());
  const auto dusk = open_sky({.file = file("t.wea", kWea), .time = "03-21 18:00"});
  ASSERT_TRUE(dusk) << dusk.error().message();
  EXPECT_FALSE(dusk->sky.sun());
  EXPECT_GT(dusk->sky.radiance({0, 0, 1}).g, 0.0f);
  EXPECT_TRUE(std::any_of(dusk->notes.begin(), dusk->notes.end(),
                          [](const std::string& note) { return note.find("left out") != std::string::npos; }));
  EXPECT_FALSE(open_sky({.file = file("t.wea", kWea), .time = "03-21 12:00"}));
  EXPECT_FALSE(open_sky({.file = file("t.wea", kWea)}));
}

TEST_F(SkyDescriptionTest, perez_section_place_and_time_are_those_of_the_tape) {
  const auto tape = open_sky({.file = file("t.wea", kWea), .time = "03-21 08:30"});
  const auto words = sky("model = \"perez\"\ndirect_normal_solar = 675\ndiffuse_horizontal_solar = 95\n"
                         "place = { latitude = 40.78, longitude = -73.97, time_zone = -5 }\ntime = \"03-21 08:30\"\n");
  ASSERT_TRUE(words) << words.error().message();
  const Sky same(words->model);
  for (const glm::dvec3& d : {glm::dvec3(0, 0, 1), glm::normalize(glm::dvec3(1, -1, 0.3)), glm::dvec3(0, 0, -1)})
    EXPECT_EQ(same.radiance(d), tape->sky.radiance(d));
  EXPECT_EQ(same.sun()->normal_irradiance, tape->sky.sun()->normal_irradiance);
  const auto from_file = sky("model = \"weather\"\nfile = \"t.wea\"\ntime = \"03-21 08:30\"\n");
  ASSERT_TRUE(from_file) << from_file.error().message();
  EXPECT_EQ(Sky(from_file->model).radiance({0, 0, 1}), tape->sky.radiance({0, 0, 1}));
}

TEST_F(SkyDescriptionTest, colours_keep_the_luminance) {
  const std::string text = "model = \"perez\"\ndirect_normal_solar = 675\ndiffuse_horizontal_solar = 95\n"
                           "sun = { azimuth = 0, elevation = 30 }\n";
  const auto plain = sky(text), coloured = sky(text + "sky_colour = [0.5, 0.8, 2]\nsun_colour = [2, 1, 0.5]\n");
  ASSERT_TRUE(coloured) << coloured.error().message();
  const glm::dvec3 d = glm::normalize(glm::dvec3(1, 2, 3));
  EXPECT_NEAR(luminance(Sky(coloured->model).radiance(d)) / luminance(Sky(plain->model).radiance(d)), 1.0, 1e-5);
  EXPECT_GT(Sky(coloured->model).radiance(d).b, 2.0f * Sky(plain->model).radiance(d).b * 0.9f);
  EXPECT_NEAR(luminance(coloured->model.sun->normal_irradiance) / luminance(plain->model.sun->normal_irradiance), 1.0,
              1e-5);
}

TEST_F(SkyDescriptionTest, rotation_turns_the_sun_from_east_to_north) {
  const std::string sun = "sun = { direction = [1, 0, 1], normal_irradiance = 5 }\n";
  const auto turned = sky("model = \"clear\"\nrotation = 90\n" + sun);
  ASSERT_TRUE(turned) << turned.error().message();
  EXPECT_NEAR(turned->model.sun->direction.y, std::sqrt(0.5), 1e-12);
  const auto option = open_sky({.file = file("s.toml", "[sky]\nmodel = \"clear\"\n" + sun), .rotation_deg = 90});
  ASSERT_TRUE(option);
  EXPECT_NEAR(option->sky.sun()->direction.y, std::sqrt(0.5), 1e-12);
}

TEST_F(SkyDescriptionTest, bad_descriptions_are_refused) {
  const std::string place = "place = { latitude = 40, longitude = -74, time_zone = -5 }\n";
  for (const std::string& text : {
           std::string("model = \"cie\"\n"),
           std::string("model = \"cie\"\ncie_type = 16\n"),
           std::string("model = \"cie\"\ncie_type = 12\n"), // needs the sun
           std::string("model = \"cie\"\ncie_type = 5\nzenith_radiance = 1\ndiffuse_horizontal = 3\n"),
           std::string("model = \"general\"\n"),
           std::string("model = \"general\"\ndistribution = [1, 2, 3]\n"),
           std::string("model = \"general\"\ndistribution = [0, -1, 0, -1, 0, 0]\n"), // black
           std::string("model = \"perez\"\nsun = { azimuth = 1, elevation = 30 }\n"),
           std::string("model = \"perez\"\ndirect_normal_solar = 500\ndiffuse_horizontal_solar = 100\n"),
           std::string("model = \"perez\"\ndirect_normal_solar = 5000\ndiffuse_horizontal_solar = 100\n") + place +
               "time = \"06-21 12:00\"\n",
           std::string("model = \"weather\"\nfile = \"none.epw\"\ntime = \"06-21 12:00\"\n"),
           std::string("model = \"weather\"\n"),
           "model = \"cie\"\ncie_type = 12\n" + place,                              // when?
           "model = \"cie\"\ncie_type = 12\n" + place + "time = \"06-21 25:00\"\n", // no such time
           "model = \"cie\"\ncie_type = 12\n" + place + "time = \"06-21 23:00\"\n", // night
           std::string("model = \"cie\"\ncie_type = 12\ntime = \"06-21 12:00\"\n"), // where?
           "model = \"cie\"\ncie_type = 12\n" + place +
               "time = \"06-21 12:00\"\nsun = { azimuth = 3, normal_irradiance = 1 }\n",
           std::string("model = \"perez\"\ndirect_normal_solar = 1\ndiffuse_horizontal_solar = 1\nsky_colour = 0\nsun "
                       "= { elevation = 5 }\n"),
           std::string("modle = \"cie\"\n"),
       })
    EXPECT_FALSE(sky(text)) << text;
  EXPECT_FALSE(read_sky_description(file("other.toml", "[room]\nmodel = \"x\"\n")));
  EXPECT_FALSE(open_sky({.file = file("s.toml", "[sky]\n"), .time = "06-21 12:00"}));
  EXPECT_FALSE(open_sky({.file = folder_ / "none.exr", .time = "06-21 12:00"}));
  EXPECT_FALSE(open_sky({.file = folder_ / "none.epw", .time = "06-21 12:00"}));
}

// The sun of a description reaches the regions whole: projected on the horizontal the regions carry sky and sun.
TEST_F(SkyDescriptionTest, region_means_keep_the_energy_of_sky_and_sun) {
  const auto d = sky("model = \"cie\"\ncie_type = 12\ndiffuse_horizontal = 30\nground_albedo = 0\n"
                     "sun = { azimuth = 20, elevation = 35, normal_irradiance = 100 }\n");
  const Sky whole(d->model);
  SkyModel without = d->model;
  without.sun->normal_irradiance = Rgb(0.0f);
  const Sky only_sky(without);
  for (const char* name : {"uniform:256", "reinhart:2", "fine:1024"}) {
    const SkyPartition partition = *SkyPartition::parse(name);
    const std::vector<Rgb> with = region_radiance(whole, partition), sky_only = region_radiance(only_sky, partition);
    double power = 0.0, diffuse = 0.0;
    for (int i = 0; i < partition.size(); ++i) {
      const double omega = partition.solid_angle_sr(i);
      power += static_cast<double>(with[i].g - sky_only[i].g) * omega;
      diffuse += static_cast<double>(sky_only[i].g) * omega;
    }
    // Radiance over the disc's solid angle: the normal irradiance, up to the cosine inside the disc (1e-5).
    EXPECT_NEAR(power, 100.0, 2e-3) << name;
    EXPECT_GT(diffuse, 30.0);
  }
}

} // namespace
} // namespace daylit
