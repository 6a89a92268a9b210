#pragma once

// The reference rooms and values of tests/fixtures/truth, and their skies from the formulas they were made with.

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "scene/room/room_formats.h"
#include "simulate/irradiance.h"

namespace daylit::test {

inline const std::filesystem::path kTruthFolder = DAYLIT_SOURCE_DIR "/tests/fixtures/truth";

struct TruthRow {
  Receiver receiver;
  Rgb value{0.0f}, standard_error{0.0f};
};

/// Rows of one scene, sky and kind ("indirect", "total"); the six axes of a probe follow one another.
inline std::vector<TruthRow> truth_rows(const std::string& scene, const std::string& sky, const std::string& kind) {
  std::ifstream file(kTruthFolder / "truth_irradiance.csv");
  std::vector<TruthRow> rows;
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> cell;
    std::stringstream stream(line);
    for (std::string c; std::getline(stream, c, ',');)
      cell.push_back(c);
    if (cell.size() != 14 || cell[0] != scene || cell[1] != sky || cell[6] != kind)
      continue;
    const auto number = [&](std::size_t i) { return std::strtod(cell[i].c_str(), nullptr); };
    TruthRow row;
    row.receiver = {{number(3), number(4), number(5)}, glm::dvec3(0.0)};
    row.receiver.normal[cell[7][1] - 'x'] = cell[7][0] == '+' ? 1.0 : -1.0;
    row.value = Rgb(glm::dvec3(number(8), number(9), number(10)));
    row.standard_error = Rgb(glm::dvec3(number(11), number(12), number(13)));
    rows.push_back(row);
  }
  return rows;
}

/// E1: radiance 1 everywhere. E2: 10 (1 + 2 sin g) / 3 above the horizon, 0.6 below. Each pixel is the solid-angle
/// mean, which for a function linear in z is its value at the middle height of the pixel's band.
inline Result<SkyImage> truth_sky(const std::string& name) {
  RgbImage image(512, 256, Rgb(1.0f));
  for (int y = 0; name == "E2" && y < image.height; ++y) {
    const double high = std::cos(std::numbers::pi * y / image.height);
    const double low = std::cos(std::numbers::pi * (y + 1) / image.height);
    const double middle = 0.5 * (high + low);
    for (int x = 0; x < image.width; ++x)
      image.at(x, y) = Rgb(static_cast<float>(middle > 0.0 ? 10.0 * (1.0 + 2.0 * middle) / 3.0 : 0.6));
  }
  return SkyImage::make(std::move(image), EquirectProjection{}, {}, name);
}

inline Result<TraceScene> truth_scene(const std::string& scene, const std::string& sky_name) {
  auto sky = truth_sky(sky_name);
  if (!sky)
    return sky.error();
  const auto room = read_room(kTruthFolder / (scene == "S1" ? "s1_daylit_cornell.obj" : "s3_furnace.obj"));
  if (!room)
    return room.error();
  return TraceScene::of_room(room->room, SkyLight(std::make_shared<const SkyImage>(*std::move(sky))));
}

/// sqrt(mean (a - t)^2) / sqrt(mean t^2) over receivers and channels.
template <class Value, class Reference>
double nrms(std::size_t count, Value value, Reference reference) {
  double error = 0.0, power = 0.0;
  for (std::size_t i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c) {
      const double t = static_cast<double>(reference(i)[c]), d = static_cast<double>(value(i)[c]) - t;
      error += d * d;
      power += t * t;
    }
  return std::sqrt(error / power);
}

} // namespace daylit::test
