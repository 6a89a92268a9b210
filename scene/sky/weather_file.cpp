#include "scene/sky/weather_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"

namespace daylit {

namespace {

constexpr std::size_t kMostBytes = std::size_t{256} << 20;
constexpr double kMissing = 9999.0, kMissingDewPoint = 99.9; // EnergyPlus: Auxiliary Programs, EPW data dictionary
constexpr double kMostValue = 200000.0;                      // W/m2 or lx; no daylight has more

std::optional<double> number_in(std::string_view text, double low, double high) {
  const std::optional<double> value = parse_number(trimmed(text));
  return value && *value >= low && *value <= high ? value : std::nullopt;
}

std::optional<int> integer_in(std::string_view text, int low, int high) {
  const std::optional<double> value = number_in(text, low, high);
  if (!value || *value != std::floor(*value))
    return std::nullopt;
  return static_cast<int>(*value);
}

/// The first fields of a line; missing ones are empty.
template <std::size_t N>
std::array<std::string_view, N> fields(std::string_view line, char separator) {
  std::array<std::string_view, N> out{};
  for (std::size_t k = 0; k < N; ++k) {
    if (separator == ' ')
      line = trimmed(line);
    const std::size_t end = line.find(separator);
    out[k] = line.substr(0, end);
    if (end == std::string_view::npos)
      break;
    line.remove_prefix(end + 1);
  }
  return out;
}

Error bad_line(const std::string& name, int line, std::string what) {
  return {ErrorCode::file_malformed, std::move(what), fmt::format("{}, line {}", name, line),
          "take the file from its publisher again"};
}

/// .epw, field numbers of the data dictionary from 0.
enum EpwField : std::size_t { kYear, kMonth, kDay, kHour, kMinute, kDewPoint = 7, kDirect = 14, kDiffuse = 15 };

/// Hour 1 is the interval from 0 to 1 h: its middle is hour - 1/2, or with n rows per hour the end less half an
/// interval (EnergyPlus, Auxiliary Programs, EPW data dictionary).
std::optional<std::string> epw_row(const std::array<std::string_view, 16>& f, int per_hour, WeatherRow& row) {
  const auto year = integer_in(f[kYear], 1900, 2100), month = integer_in(f[kMonth], 1, 12),
             day = integer_in(f[kDay], 1, 31), hour = integer_in(f[kHour], 1, 24),
             minute = integer_in(f[kMinute], 0, 60);
  if (!year || !month || !day || !hour || !minute)
    return "a row starts with year, month, day, hour 1..24 and minute 0..60";
  row.time = {.year = *year, .month = *month, .day = *day};
  // One row per hour: the minute is 0 or 60 and says nothing. Else it ends the interval.
  const double end = per_hour == 1 ? *hour : *hour - 1 + *minute / 60.0;
  row.time.hour = end - 0.5 / per_hour;
  if (!is_day(row.time) || row.time.hour < 0.0)
    return "there is no such time";
  const auto direct = number_in(f[kDirect], 0.0, kMostValue), diffuse = number_in(f[kDiffuse], 0.0, kMostValue);
  const auto dew = number_in(f[kDewPoint], -100.0, 1000.0);
  if (!direct || !diffuse || !dew)
    return "dew point (field 8), direct normal (15) or diffuse horizontal radiation (16) is not a number of its kind";
  row.missing = *direct >= kMissing || *diffuse >= kMissing;
  row.direct = *direct;
  row.diffuse = *diffuse;
  row.dew_point_C = *dew >= kMissingDewPoint ? std::numeric_limits<double>::quiet_NaN() : *dew;
  return std::nullopt;
}

/// The six header lines of a .wea.
std::optional<std::string> wea_header(TextLines& lines, WeatherFile& weather) {
  struct Entry {
    std::string_view key;
    double low, high;
    double value = 0.0;
  };
  std::array<Entry, 5> entries{{{"latitude", -90, 90},
                                {"longitude", -180, 180},
                                {"time_zone", -225, 225},
                                {"site_elevation", -1000, 10000},
                                {"weather_data_file_units", 1, 3}}};
  std::string_view line;
  if (!lines.next(line) || !line.starts_with("place"))
    return "a .wea file starts with: place NAME";
  for (Entry& entry : entries) {
    std::optional<double> value;
    if (lines.next(line) && line.starts_with(entry.key))
      value = number_in(line.substr(entry.key.size()), entry.low, entry.high);
    if (!value)
      return fmt::format("expected: {} NUMBER, {} to {}", entry.key, entry.low, entry.high);
    entry.value = *value;
  }
  // West positive, and the time zone as degrees of longitude of its meridian.
  weather.place = {entries[0].value, -entries[1].value, -entries[2].value / 15.0};
  weather.elevation_m = entries[3].value;
  if (entries[4].value != std::floor(entries[4].value))
    return "weather_data_file_units is 1, 2 or 3";
  weather.unit = static_cast<WeatherUnit>(static_cast<int>(entries[4].value) - 1);
  return std::nullopt;
}

/// month day hour direct diffuse; the hour is the middle of the interval.
std::optional<std::string> wea_row(std::string_view line, WeatherRow& row) {
  const auto f = fields<6>(line, ' ');
  const auto month = integer_in(f[0], 1, 12), day = integer_in(f[1], 1, 31);
  const auto hour = number_in(f[2], 0.0, 24.0), direct = number_in(f[3], 0.0, kMostValue),
             diffuse = number_in(f[4], 0.0, kMostValue);
  if (!month || !day || !hour || !direct || !diffuse || !f[5].empty() || *hour >= 24.0)
    return "a row is: month day hour direct diffuse";
  row.time = {.month = *month, .day = *day, .hour = *hour, .any_year = true};
  if (row.time.month == 2 && row.time.day == 29)
    row.time.year = 2000;
  if (!is_day(row.time))
    return "there is no such day";
  row.direct = *direct;
  row.diffuse = *diffuse;
  row.dew_point_C = std::numeric_limits<double>::quiet_NaN();
  return std::nullopt;
}

/// Rows of a .wea do not say how long they last: the shortest step within a day.
/// Intervals of an .epw end at the written hour; .wea hours are middles (Radiance, epw2wea).
double shortest_step(const std::vector<WeatherRow>& rows) {
  double step = 1.0;
  for (std::size_t k = 1; k < rows.size(); ++k)
    if (const double dt = rows[k].time.hour - rows[k - 1].time.hour; dt > 1e-3)
      step = std::min(step, dt);
  return step;
}

/// Reads the rest of the lines, each that is not blank by `read_row`, which returns what is wrong with it.
template <class ReadRow>
Result<WeatherFile> with_rows(TextLines& lines, WeatherFile weather, const ReadRow& read_row) {
  std::string_view line;
  while (lines.next(line)) {
    if (trimmed(line).empty())
      continue;
    WeatherRow row;
    row.line = lines.number();
    if (const auto problem = read_row(line, row))
      return bad_line(weather.name, row.line, *problem);
    weather.rows.push_back(row);
  }
  if (weather.rows.empty())
    return bad_line(weather.name, lines.number(), "no rows of data");
  return weather;
}

} // namespace

Result<WeatherFile> parse_epw(std::string_view text, const std::string& name) {
  WeatherFile weather;
  weather.name = name;
  TextLines lines(text);
  std::string_view line;
  if (!lines.next(line) || !line.starts_with("LOCATION,"))
    return bad_line(name, 1, "an .epw file starts with: LOCATION,");
  const auto place = fields<10>(line, ',');
  const auto latitude = number_in(place[6], -90, 90), longitude = number_in(place[7], -180, 180),
             zone = number_in(place[8], -15, 15), elevation = number_in(place[9], -1000, 10000);
  if (!latitude || !longitude || !zone || !elevation)
    return bad_line(name, 1, "latitude, longitude, time zone or elevation is not a number of its kind");
  weather.place = {*latitude, *longitude, *zone};
  weather.elevation_m = *elevation;
  std::optional<int> per_hour;
  while (!per_hour && lines.next(line))
    if (line.starts_with("DATA PERIODS,")) {
      per_hour = integer_in(fields<3>(line, ',')[2], 1, 60);
      if (!per_hour || 60 % *per_hour != 0)
        return bad_line(name, lines.number(), "records per hour must divide 60");
    }
  if (!per_hour)
    return bad_line(name, lines.number(), "no line DATA PERIODS");
  weather.step_h = 1.0 / *per_hour;
  return with_rows(lines, std::move(weather), [&](std::string_view data, WeatherRow& row) {
    return epw_row(fields<16>(data, ','), *per_hour, row);
  });
}

Result<WeatherFile> parse_wea(std::string_view text, const std::string& name) {
  WeatherFile weather;
  weather.name = name;
  TextLines lines(text);
  if (const auto problem = wea_header(lines, weather))
    return bad_line(name, lines.number(), *problem);
  auto read = with_rows(lines, std::move(weather), wea_row);
  if (read)
    read->step_h = shortest_step(read->rows);
  return read;
}

Result<WeatherFile> read_weather(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, kMostBytes);
  if (!bytes)
    return bytes.error();
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  return path.extension() == ".wea" ? parse_wea(text, path.string()) : parse_epw(text, path.string());
}

/// The first row with |time - middle| <= half an interval, the end excluded.
Result<WeatherRow> weather_at(const WeatherFile& weather, const LocalTime& time) {
  const double half = 0.5 * weather.step_h;
  for (const WeatherRow& row : weather.rows) {
    if (row.time.month != time.month || row.time.day != time.day ||
        !(time.hour >= row.time.hour - half - 1e-9 && time.hour < row.time.hour + half - 1e-9))
      continue;
    if (!time.any_year && !row.time.any_year && row.time.year != time.year)
      continue;
    if (row.missing)
      return Error{ErrorCode::value_invalid, "the radiation of this hour is missing (9999)",
                   fmt::format("{}, line {}", weather.name, row.line), "choose another hour"};
    return row;
  }
  return Error{ErrorCode::not_found, "no row for " + time_text(time), weather.name,
               fmt::format("it has {} to {}, local standard time", time_text(weather.rows.front().time),
                           time_text(weather.rows.back().time))};
}

} // namespace daylit
