#pragma once

// Where the sun stands, from place and time.

#include <string>

#include <glm/vec3.hpp>

#include "scene/core/result.h"

namespace daylit {

struct Place {
  double latitude_deg = 0.0;  ///< north positive
  double longitude_deg = 0.0; ///< east positive
  double time_zone_h = 0.0;   ///< local standard time minus UTC, hours, east positive; no daylight saving
};

/// Local standard time.
struct LocalTime {
  int year = kTypicalYear, month = 1, day = 1;
  double hour = 0.0;     ///< 0 <= hour < 24
  bool any_year = false; ///< no year was given: `year` is kTypicalYear, or 2000 for February 29

  /// For times without a year (weather tapes): two years after a leap year, where the calendar is least ahead of or
  /// behind the sun. Leaving the year open costs up to 0.2 degrees at the equinoxes.
  static constexpr int kTypicalYear = 2002;
};

/// "2021-06-21 12:30", "2021-06-21T12:30:15", or without the year "06-21 12:30". Error: not such a text, no such day,
/// year outside 1900..2100.
Result<LocalTime> parse_local_time(const std::string& text);
std::string time_text(const LocalTime& time); ///< "2021-06-21 12:30", seconds where there are some
bool is_day(const LocalTime& time);           ///< whether the calendar has year, month and day

struct SunPosition {
  double altitude = 0.0;  ///< radians, of the centre, seen from the ground, without refraction
  double azimuth = 0.0;   ///< radians clockwise from north, 0..2pi
  double distance = 1.0;  ///< astronomical units, from the centre of the earth
  glm::dvec3 direction{}; ///< unit; x east, y north, z up
};

/// By ERFA, the library of the IAU SOFA routines: positions of the observer and of the earth (eraApco13, within a few
/// milliarcseconds), aberration (eraAb), precession and nutation IAU 2006/2000A, horizon (eraAtioq). UTC is taken for
/// UT1: within 0.004 degrees for 1972..today; before and after, where UTC and its leap seconds are not known, within
/// 0.01 degrees for 1900..2100. Refraction, up to 0.5 degrees at the horizon, is left out as in all sky models here.
SunPosition sun_position(const Place& place, const LocalTime& time);

} // namespace daylit
