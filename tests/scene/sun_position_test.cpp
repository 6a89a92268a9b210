#include "scene/sky/sun_position.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace daylit {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

double angle_deg(const SunPosition& sun, double azimuth_deg, double altitude_deg) {
  const double a = azimuth_deg / kDegrees, h = altitude_deg / kDegrees;
  const glm::dvec3 expected(std::cos(h) * std::sin(a), std::cos(h) * std::cos(a), std::sin(h));
  return 2.0 * std::asin(0.5 * glm::distance(expected, sun.direction)) * kDegrees;
}

// Reda & Andreas, "Solar position algorithm for solar radiation applications", NREL/TP-560-34302 (2008), table A5.1.
TEST(SunPosition, agrees_with_the_worked_example_of_the_solar_position_algorithm) {
  const SunPosition sun =
      sun_position({39.742476, -105.1786, -7.0}, {.year = 2003, .month = 10, .day = 17, .hour = 12.0 + 30.5 / 60.0});
  EXPECT_LT(angle_deg(sun, 194.34024, 39.872046), 1e-4); // measured 7e-5
  EXPECT_NEAR(sun.distance, 0.9965422, 3e-7);            // measured 2e-7
}

// Made by another chain of the IAU SOFA routines (Earth by epv00, precession and nutation by pnm06a, sidereal time by
// gst06a, aberration, parallax on the WGS 84 ellipsoid), time scale UTC. Measured 3e-5 to 7e-5 degrees.
TEST(SunPosition, agrees_with_a_full_ephemeris) {
  struct Row {
    double latitude, longitude;
    int year, month, day;
    double hour, azimuth, altitude;
  };
  for (const Row& r : {Row{54.012, 20.324, 2057, 8, 10, 26 / 60.0, 25.70644, -17.19986},
                       Row{34.578, -93.662, 2028, 10, 7, 1047 / 60.0, 166.65624, 48.67690},
                       Row{45.568, 107.367, 2035, 8, 27, 1016 / 60.0, 1.17736, -34.48460},
                       Row{-4.497, -89.802, 2029, 6, 7, 8 / 60.0, 292.54662, -4.03160},
                       Row{70.819, -140.511, 2045, 5, 16, 530 / 60.0, 353.28534, 0.18364},
                       Row{-19.011, -49.006, 1982, 11, 7, 785 / 60.0, 88.83650, 62.56299}}) {
    const SunPosition sun =
        sun_position({r.latitude, r.longitude, 0.0}, {.year = r.year, .month = r.month, .day = r.day, .hour = r.hour});
    EXPECT_LT(angle_deg(sun, r.azimuth, r.altitude), 1e-4) << r.year;
  }
}

// Instants of the equinoxes and solstices, to the minute, as published by the US Naval Observatory ("Earth's seasons").
// Seen from the north pole the altitude is the declination, less the parallax of 0.0024 degrees. At the equinoxes the
// declination changes by 0.00014 degrees in the half minute of rounding; measured 0.0002, at the solstices 0.0005.
TEST(SunPosition, declination_is_zero_at_the_equinoxes_and_turns_at_the_solstices) {
  const auto declination = [](int year, int month, int day, double hour) {
    return sun_position({90.0, 0.0, 0.0}, {.year = year, .month = month, .day = day, .hour = hour}).altitude *
               kDegrees +
           0.0024;
  };
  EXPECT_NEAR(declination(2000, 3, 20, 7 + 35 / 60.0), 0.0, 0.0003);
  EXPECT_NEAR(declination(2010, 9, 23, 3 + 9 / 60.0), 0.0, 0.0003);
  EXPECT_NEAR(declination(2020, 3, 20, 3 + 50 / 60.0), 0.0, 0.0003);
  EXPECT_NEAR(declination(2020, 6, 20, 21 + 44 / 60.0), 23.4365, 0.0007); // obliquity of the date
  EXPECT_NEAR(declination(2020, 12, 21, 10 + 2 / 60.0), -23.4365, 0.0007);
}

TEST(SunPosition, local_standard_time_and_longitude_turn_together) {
  const SunPosition here = sun_position({40.0, -75.0, -5.0}, {.year = 2021, .month = 5, .day = 3, .hour = 9.25});
  const SunPosition utc = sun_position({40.0, -75.0, 0.0}, {.year = 2021, .month = 5, .day = 3, .hour = 14.25});
  EXPECT_NEAR(glm::distance(here.direction, utc.direction), 0.0, 1e-12);
  EXPECT_GT(here.direction.x, 0.5) << "in the morning the sun is in the east, +x";
  const SunPosition late = sun_position({40.0, -75.0, -5.0}, {.year = 2021, .month = 12, .day = 31, .hour = 23.9});
  const SunPosition early = sun_position({40.0, -75.0, -5.0}, {.year = 2022, .month = 1, .day = 1, .hour = 0.0});
  EXPECT_NEAR(glm::distance(late.direction, early.direction), 0.1 * 15.0 / kDegrees, 0.02) << "no step at midnight";
}

TEST(LocalTime, is_read_with_and_without_a_year) {
  const auto full = parse_local_time("2021-06-21T12:30:36");
  ASSERT_TRUE(full) << full.error().message();
  EXPECT_EQ(full->year, 2021);
  EXPECT_NEAR(full->hour, 12.51, 1e-12);
  EXPECT_FALSE(full->any_year);
  EXPECT_EQ(time_text(*full), "2021-06-21 12:30:36");
  const auto tape = parse_local_time("02-29 00:00");
  ASSERT_TRUE(tape) << tape.error().message();
  EXPECT_TRUE(tape->any_year);
  EXPECT_EQ(tape->year, 2000);
}

TEST(LocalTime, refuses_what_is_no_time) {
  for (const char* text :
       {"", "12:30", "2021-06-21", "2021-02-29 12:00", "2021-13-01 12:00", "06-31 12:00", "06-21 24:00", "06-21 12:60",
        "06-21 12", "06-21 -1:00", "1e3-06-21 12:00", "06-21 12:30:61", "1899-06-21 12:00", "2021-06-21 12:30 ",
        "2021-06-21 12:30:00:00", "nan-06-21 12:00", "2021.5-06-21 12:00", "06-21 inf:00"})
    EXPECT_FALSE(parse_local_time(text)) << text;
}

} // namespace
} // namespace daylit
