// Writes valid inputs to start from: fuzz_seeds FOLDER makes FOLDER/volume, /sky, /transfer, /weather, /rad and
// /hbjson.

#include <cstdio>

#include "scene/core/atomic_file.h"
#include "tests/scene/volume_kinds.h"

namespace {

using namespace daylit;

void write(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  std::filesystem::create_directories(path.parent_path());
  const std::span<const std::byte> part = std::as_bytes(bytes);
  if (const auto written = write_file_atomically(path, std::span(&part, 1)); !written)
    std::fprintf(stderr, "%s\n", written.error().message().c_str());
}

void write(const std::filesystem::path& path, const std::string& text) {
  write(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

void write_skies(const std::filesystem::path& folder) {
  const std::string place =
      "place = { latitude = 52.5, longitude = 13.4, time_zone = 1 }\ntime = \"2021-06-21 12:30\"\n";
  write(folder / "sky/cie.toml", "[sky]\nmodel = \"cie\"\ncie_type = 12\ndiffuse_horizontal = 90.0\n" + place +
                                     "sun = { normal_irradiance = 700.0 }\nground_albedo = 0.2\nrotation = 30.0\n");
  write(folder / "sky/perez.toml", "[sky]\nmodel = \"perez\"\ndirect_normal_solar = 675.0\n"
                                   "diffuse_horizontal_solar = 95.0\ndew_point = 11.0\n" +
                                       place + "sky_colour = [0.96, 1.0, 1.12]\nsun_colour = [1.0, 1.0, 0.9]\n");
  write(folder / "sky/overcast.toml", "[sky]\nmodel = \"overcast\"\nzenith_radiance = 10\nground_radiance = 0.6\n");
  write(folder / "sky/general.toml", "[sky]\nmodel = \"general\"\ndistribution = [-1.0, -0.32, 10.0, -3.0, 0.45, 1.0]\n"
                                     "zenith_radiance = 1\nsun = { azimuth = 10, elevation = 20, diameter = 0.53 }\n");
  write(folder / "weather/tape.wea",
        "place New York\nlatitude 40.78\nlongitude 73.97\ntime_zone 75\nsite_elevation 10\n"
        "weather_data_file_units 1\n3 21 10.5 675 95\n6 21 11.5 100 300\n");
  std::string row = "1990,3,21,10,60,?9";
  for (const char* cell : {"10.0", "5.0", "70", "101325", "0", "0", "300", "500", "675", "95", "0", "0", "0", "0"})
    row += std::string(",") + cell;
  for (int k = 20; k < 35; ++k)
    row += ",0";
  std::string head = "LOCATION,NY,NY,USA,TMY,1,40.78,-73.97,-5.0,57.0\n";
  for (int k = 1; k < 7; ++k)
    head += "DESIGN CONDITIONS,0\n";
  write(folder / "weather/tape.epw", head + "DATA PERIODS,1,1,Data,Sunday,1/1,12/31\n" + row + "\n");
}

void write_rooms(const std::filesystem::path& folder) {
  write(folder / "rad/scene.rad", "void plastic grey 0 0 5 .5 .5 .5 0 0\nvoid glass pane 0 0 3 .9 .9 .9\n"
                                  "!xform -rz 30 -a 3 -t 0 0 2 part.rad\n"
                                  "grey polygon floor 0 0 12 0 0 0 1 0 0 1 1 0 0 1 0\n");
  write(
      folder / "hbjson/model.hbjson",
      R"({"type":"Model","units":"Feet","properties":{"radiance":{"modifiers":[{"type":"Glass","identifier":"g",)"
      R"("r_transmissivity":0.6,"g_transmissivity":0.6,"b_transmissivity":0.6}]}},"rooms":[{"faces":[{"identifier":"f",)"
      R"("face_type":"Wall","geometry":{"boundary":[[0,0,0],[4,0,0],[4,0,3],[0,0,3]]},"apertures":[{"identifier":"a",)"
      R"("properties":{"radiance":{"modifier":"g"}},"geometry":{"boundary":[[1,0,1],[2,0,1],[2,0,2]]}}]}]}]})");
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  for (const test::VolumeKind& v : test::volume_kinds())
    write(folder / "volume" / v.name, *volume_bytes(v.volume, v.precision));
  write_skies(folder);
  write_rooms(folder);
  std::vector<std::uint8_t> transfer(48 + 2 * 112);
  const char magic[] = "daylitTV";
  std::copy(magic, magic + 8, transfer.begin());
  transfer[8] = 3;
  transfer[12] = 27;
  transfer[16] = 2;
  write(folder / "transfer/two", transfer);
}
