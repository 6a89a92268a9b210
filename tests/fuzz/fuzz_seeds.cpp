// Writes valid inputs to start from: fuzz_seeds FOLDER makes FOLDER/volume, /sky, /transfer, /weather, /rad, /hbjson,
// /gltf and /obj.

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

/// One triangle with every extension and an image that is not one.
void write_models(const std::filesystem::path& folder) {
  const std::string texture = R"({"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.1,0.2],"rotation":1,)"
                              R"("scale":[2,3]}}})";
  write(folder / "gltf/materials.gltf",
        R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{)"
        R"("attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],"materials":[{"emissiveFactor":[1,1,1],)"
        R"("pbrMetallicRoughness":{"roughnessFactor":0.5,"metallicFactor":0.5,"baseColorTexture":)" +
            texture + R"(},"normalTexture":)" + texture +
            R"(,"extensions":{"KHR_materials_ior":{"ior":1.4},"KHR_materials_transmission":{"transmissionFactor":0.5,)"
            R"("transmissionTexture":{"index":0}},"KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2,)"
            R"("attenuationColor":[1,0.5,0.2]},"KHR_materials_clearcoat":{"clearcoatFactor":1},)"
            R"("KHR_materials_anisotropy":{"anisotropyStrength":0.5}}}],"textures":[{"source":0,"sampler":0}],)"
            R"("samplers":[{"wrapS":33071}],"images":[{"uri":"a.png"}],"accessors":[{"bufferView":0,)"
            R"("componentType":5126,"count":3,"type":"VEC3"},{"bufferView":0,"componentType":5126,"count":3,)"
            R"("type":"VEC2"}],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":)"
            R"("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
  std::string obj = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
  obj += '\0';
  write(folder / "obj/material.obj", obj + "newmtl a\nKd 0.5 0.5 0.5\nKs 0.5 0.5 0.5\nNs 250\nNi 1.5\nd 0.5\nillum 7\n"
                                           "Ke 1 1 1\nPr 0.2\nPm 1\nmap_Kd -s 2 2 1 -clamp on a.png\n");
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
  write_models(folder);
  std::vector<std::uint8_t> transfer(48 + 2 * 112);
  const char magic[] = "daylitTV";
  std::copy(magic, magic + 8, transfer.begin());
  transfer[8] = 3;
  transfer[12] = 27;
  transfer[16] = 2;
  write(folder / "transfer/two", transfer);
}
