#include "simulate/irradiance_command.h"

#include <cmath>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/core/program.h"
#include "scene/room/room_formats.h"
#include "simulate/irradiance.h"

namespace daylit {

namespace {

Error line_error(std::size_t line, const std::string& what, bool with_normal) {
  return {ErrorCode::value_invalid, what, fmt::format("stdin, line {}", line),
          with_normal ? "expected: x y z nx ny nz" : "expected: x y z"};
}

Result<std::vector<Receiver>> read_receivers(std::istream& in, bool with_normal) {
  std::vector<Receiver> receivers;
  std::string text;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    std::istringstream stream(text);
    Receiver r;
    stream >> r.position.x >> r.position.y >> r.position.z;
    if (with_normal)
      stream >> r.normal.x >> r.normal.y >> r.normal.z;
    std::string rest;
    if (!stream || (with_normal && stream >> rest))
      return line_error(line, "not a point", with_normal);
    const double length = glm::length(r.normal);
    if (!std::isfinite(glm::dot(r.position, r.position)) || !std::isfinite(length) || length < 1e-12)
      return line_error(line, "a coordinate is not finite, or the normal has no length", with_normal);
    r.normal /= length;
    receivers.push_back(r);
  }
  return receivers;
}

constexpr double kUsualAlbedo = 0.2;

Result<SkyLight> read_sky_of(const IrradianceArguments& a) {
  SkyArguments arguments = a.sky;
  if (a.ground_albedo >= 0.0)
    arguments.ground_albedo = a.ground_albedo;
  else if (arguments.projection.starts_with("fisheye"))
    arguments.ground_albedo = kUsualAlbedo;
  const auto opened = open_sky(arguments);
  if (!opened)
    return opened.error();
  for (const std::string& note : a.quiet ? std::vector<std::string>{} : opened->notes)
    std::fprintf(stderr, "%s\n", note.c_str());
  const Sky& sky = opened->sky;
  return sky.image() ? SkyLight(sky.image()) : SkyLight(sky.described()->model());
}

Result<TraceScene> read_scene(const IrradianceArguments& a) {
  const auto sky = read_sky_of(a);
  if (!sky)
    return sky.error();
  const auto room = read_room(a.room, a.up == "y" ? UpAxis::y : UpAxis::z);
  if (!room)
    return room.error();
  std::vector<std::string> notes;
  auto scene = TraceScene::of_room(room->room, *sky, nullptr, glm::dmat4(1.0), std::nullopt, &notes);
  for (const std::string& note : a.quiet ? std::vector<std::string>{} : notes)
    std::fprintf(stderr, "%s\n", note.c_str());
  return scene;
}

std::string numbers(std::span<const Rgb> values, const char* separator) {
  std::string out;
  for (const Rgb& v : values)
    out += fmt::format("{}{:.7g}{}{:.7g}{}{:.7g}", out.empty() ? "" : separator, v.r, separator, v.g, separator, v.b);
  return out;
}

void print_values(std::span<const Rgb> value, std::span<const Rgb> error, const char* name, bool json) {
  if (json)
    std::printf("{\"%s\":[%s],\"standard_error\":[%s]}\n", name, numbers(value, ",").c_str(),
                numbers(error, ",").c_str());
  else
    std::printf("%s %s\n", numbers(value, " ").c_str(), numbers(error, " ").c_str());
}

} // namespace

Result<void> run_irradiance(const IrradianceArguments& a) {
  const auto scene = read_scene(a);
  if (!scene)
    return scene.error();
  const auto receivers = read_receivers(std::cin, !a.coefficients);
  if (!receivers)
    return receivers.error();
  ProgressLine line(a.quiet);
  const IrradianceSettings settings{.samples = a.samples, .seed = a.seed, .indirect = true, .direct = a.total};
  if (a.coefficients) {
    const auto result = trace_coefficients(*scene, *receivers, settings, line.callback());
    if (!result)
      return result.error();
    for (const CoefficientEstimate& e : *result)
      print_values(e.value, e.standard_error, "sh", a.json);
    return {};
  }
  const auto result = trace_irradiance(*scene, *receivers, settings, line.callback());
  if (!result)
    return result.error();
  for (const IrradianceEstimate& e : *result)
    print_values(std::span(&e.value, 1), std::span(&e.standard_error, 1), "irradiance", a.json);
  return {};
}

} // namespace daylit
