#include "scene/sky/weather_file.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

namespace daylit {
namespace {

const std::string kEpwHead = "LOCATION,Test Town,XX,NOWHERE,TMY3,123456,40.78,-73.97,-5.0,40.0\r\n"
                             "DESIGN CONDITIONS,0\r\nDATA PERIODS,1,1,Data,Sunday, 1/ 1,12/31\r\n";
const std::string kWeaHead = "place Test_Town\nlatitude 40.78\nlongitude 73.97\ntime_zone 75\nsite_elevation 40\n"
                             "weather_data_file_units 1\n";

std::string epw_line(const std::string& time, const std::string& direct, const std::string& diffuse,
                     const std::string& dew = "-4.4") {
  return time + ",flags,5.6," + dew + ",49,101300,627,1378,277,399," + direct + "," + diffuse + ",42500,65900\r\n";
}

TEST(WeatherFile, epw_rows_stand_for_the_hour_that_they_end) {
  const auto file =
      parse_epw(kEpwHead + epw_line("1990,3,21,9,0", "675", "95") + epw_line("1991,3,21,24,60", "0", "0"), "test.epw");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->place.latitude_deg, 40.78);
  EXPECT_EQ(file->place.longitude_deg, -73.97);
  EXPECT_EQ(file->place.time_zone_h, -5.0);
  ASSERT_EQ(file->rows.size(), 2u);
  EXPECT_EQ(file->rows[0].time.hour, 8.5);
  EXPECT_EQ(file->rows[1].time.hour, 23.5);
  EXPECT_EQ(file->rows[0].time.year, 1990);
  EXPECT_EQ(file->rows[0].direct, 675);
  EXPECT_EQ(file->rows[0].diffuse, 95);
  EXPECT_EQ(file->rows[0].dew_point_C, -4.4);
  EXPECT_EQ(file->rows[0].line, 4u);
  EXPECT_TRUE(parse_epw("\xEF\xBB\xBF" + std::string(kEpwHead) + epw_line("1990,3,21,9,0", "675", "95"), "marked.epw"));
}

TEST(WeatherFile, wea_counts_longitude_and_meridian_to_the_west_and_gives_the_middle_of_the_hour) {
  const auto file = parse_wea(kWeaHead + "3 21 8.500 675 95\n3 21 9.500 725 136\n2 29 12.5 1 1\n", "test.wea");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->place.longitude_deg, -73.97);
  EXPECT_EQ(file->place.time_zone_h, -5.0);
  EXPECT_EQ(file->unit, WeatherUnit::irradiance);
  EXPECT_EQ(file->rows[1].time.hour, 9.5);
  EXPECT_EQ(file->rows[2].time.year, 2000);
  EXPECT_TRUE(std::isnan(file->rows[0].dew_point_C));
}

TEST(WeatherFile, several_rows_per_hour_end_at_their_minute) {
  std::string head = kEpwHead;
  head.replace(head.find("PERIODS,1,1"), 11, "PERIODS,1,4");
  const auto file = parse_epw(head + epw_line("1990,3,21,9,15", "1", "1") + epw_line("1990,3,21,9,60", "1", "1"), "q");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_NEAR(file->rows[0].time.hour, 8.125, 1e-12);
  EXPECT_NEAR(file->rows[1].time.hour, 8.875, 1e-12);
  const auto wea = parse_wea(kWeaHead + "3 21 8.125 1 1\n3 21 8.375 2 2\n3 21 8.625 3 3\n", "q.wea");
  EXPECT_EQ(weather_at(*wea, *parse_local_time("03-21 08:20"))->direct, 2);
}

TEST(WeatherFile, the_row_is_the_one_whose_interval_holds_the_time) {
  const auto file = parse_epw(kEpwHead + epw_line("1990,3,21,9,0", "675", "95") +
                                  epw_line("1990,3,21,10,0", "725", "136") + epw_line("1991,3,21,10,0", "5", "6"),
                              "test.epw");
  ASSERT_TRUE(file);
  const auto direct = [&](const char* time) {
    const auto row = weather_at(*file, *parse_local_time(time));
    return row ? row->direct : -1.0;
  };
  EXPECT_EQ(direct("03-21 08:00"), 675);
  EXPECT_EQ(direct("03-21 08:59:59"), 675);
  EXPECT_EQ(direct("03-21 09:00"), 725);
  EXPECT_EQ(direct("1991-03-21 09:30"), 5);
  EXPECT_EQ(direct("1992-03-21 09:30"), -1);
  EXPECT_EQ(direct("03-21 10:00"), -1);
  EXPECT_EQ(direct("03-22 08:00"), -1);
}

TEST(WeatherFile, missing_radiation_is_refused_when_it_is_asked_for) {
  const auto file =
      parse_epw(kEpwHead + epw_line("1990,3,21,9,0", "9999", "95") + epw_line("1990,3,21,10,0", "725", "9999.") +
                    epw_line("1990,3,21,11,0", "725", "136", "99.9"),
                "test.epw");
  ASSERT_TRUE(file) << file.error().message();
  const auto first = weather_at(*file, *parse_local_time("03-21 08:30"));
  ASSERT_FALSE(first);
  EXPECT_NE(first.error().message().find("line 4"), std::string::npos) << first.error().message();
  EXPECT_FALSE(weather_at(*file, *parse_local_time("03-21 09:30")));
  EXPECT_TRUE(std::isnan(weather_at(*file, *parse_local_time("03-21 10:30"))->dew_point_C));
}

TEST(WeatherFile, bad_files_are_refused_with_their_line) {
  for (const std::string& text :
       {std::string(), std::string("LOCATION"), std::string("LOCATION,a,b,c,d,e,91,0,0,0\n"), kEpwHead,
        kEpwHead + "1990,3,21,9\n", kEpwHead + epw_line("1990,2,30,9,0", "1", "1"),
        kEpwHead + epw_line("1990,3,21,25,0", "1", "1"), kEpwHead + epw_line("1990,3,21,9,0", "x", "1"),
        kEpwHead + epw_line("1990,3,21,9,0", "-1", "1"), kEpwHead + epw_line("1990,3,21,9,0", "1e9", "1"),
        kEpwHead + epw_line("1990,3,21,9,0", "nan", "1"), kEpwHead + epw_line("1990.5,3,21,9,0", "1", "1"),
        std::string("LOCATION,a,b,c,d,e,1,0,0,0\nDATA PERIODS,1,7,D\n") + epw_line("1990,3,21,9,7", "1", "1")})
    EXPECT_FALSE(parse_epw(text, "bad.epw")) << text;
  for (const std::string& text :
       {std::string(), kWeaHead, kWeaHead + "3 21 8.5 1\n", kWeaHead + "3 21 24 1 1\n", kWeaHead + "2 30 8.5 1 1\n",
        kWeaHead + "3 21 8.5 1 1 1\n", kWeaHead + "3 21 8.5 -1 1\n", std::string("place x\nlatitude 1\n"),
        kWeaHead.substr(0, kWeaHead.size() - 2) + "4\n3 21 8.5 1 1\n"})
    EXPECT_FALSE(parse_wea(text, "bad.wea")) << text;
  const auto error = parse_epw(kEpwHead + epw_line("1990,3,21,9,0", "1", "1") + "rubbish\n", "bad.epw");
  ASSERT_FALSE(error);
  EXPECT_NE(error.error().message().find("bad.epw, line 5"), std::string::npos) << error.error().message();
}

// Radiance's epw2wea of the same file has the hours, places and values that come out here.
TEST(WeatherFile, a_published_tape_is_read_whole) {
  const std::filesystem::path path = std::string(DAYLIT_SOURCE_DIR) +
                                     "/../shared/data/rooms/radtutorial/USA_NY_New.York-Central.Park.725033_TMY3m.epw";
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << path;
  const auto file = read_weather(path);
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_EQ(file->rows.size(), 40u);
  const auto row = weather_at(*file, *parse_local_time("12-22 13:30"));
  ASSERT_TRUE(row) << row.error().message();
  EXPECT_EQ(row->time.year, 1977);
  EXPECT_EQ(row->direct, 412);
  EXPECT_EQ(row->diffuse, 156);
}

} // namespace
} // namespace daylit
