#include "simulate/sky_command.h"

#include <cmath>
#include <cstdio>
#include <iostream>
#include <sstream>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/image/image_formats.h"
#include "simulate/picture.h"

namespace daylit {

namespace {

Result<glm::dvec3> read_direction(const std::string& line, std::size_t number) {
  std::istringstream stream(line);
  glm::dvec3 d(0.0);
  std::string rest;
  const bool three = static_cast<bool>(stream >> d.x >> d.y >> d.z) && !(stream >> rest);
  const double length = glm::length(d);
  if (!three || !std::isfinite(length) || !(length > 1e-12))
    return Error{ErrorCode::value_invalid, "not a direction", fmt::format("stdin, line {}", number), "expected: x y z"};
  return d / length;
}

Result<void> answer_directions(const Sky& sky, bool json) {
  std::string line;
  for (std::size_t number = 1; std::getline(std::cin, line); ++number) {
    const Result<glm::dvec3> d = read_direction(line, number);
    if (!d)
      return d.error();
    Rgb l = sky.radiance(*d);
    if (sky.sun() && sky.sun()->contains(*d))
      l += sky.sun()->radiance();
    std::printf(json ? "{\"radiance\":[%.7g,%.7g,%.7g]}\n" : "%.7g %.7g %.7g\n", static_cast<double>(l.r),
                static_cast<double>(l.g), static_cast<double>(l.b));
  }
  return {};
}

} // namespace

Result<void> run_sky(const SkyCommandArguments& a) {
  SkyArguments arguments = a.sky;
  if (a.ground_albedo >= 0.0)
    arguments.ground_albedo = a.ground_albedo;
  const auto opened = open_sky(arguments);
  if (!opened)
    return opened.error();
  for (const std::string& note : a.quiet ? std::vector<std::string>{} : opened->notes)
    std::fprintf(stderr, "%s\n", note.c_str());
  if (a.output.empty())
    return answer_directions(opened->sky, a.json);
  if (!opened->sky.described())
    return Error{ErrorCode::usage, "this sky is a picture already", a.sky.file.string(),
                 "give a sky in words (.toml) or a weather tape (.epw, .wea)"};
  return write_exr(a.output, render_sky_panorama(*opened->sky.described(), a.height_px));
}

} // namespace daylit
