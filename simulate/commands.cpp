#include "simulate/commands.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/core/output_file.h"
#include "scene/core/program.h"
#include "scene/image/image_formats.h"
#include "scene/room/room_formats.h"
#include "simulate/irradiance.h"
#include "simulate/picture.h"
#include "simulate/picture_error.h"

namespace daylit {

namespace {

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes)
    std::fprintf(stderr, "%s\n", note.c_str());
}

constexpr float kDifferenceGain = 4.0f;

Result<void> read_into(const std::filesystem::path& path, RgbImage& image) {
  auto file = read_hdr_image(path);
  if (!file)
    return file.error();
  image = std::move(file->radiance);
  return {};
}

/// Left to right, same height.
Rgb8Image side_by_side(const std::vector<Rgb8Image>& pictures) {
  Rgb8Image out;
  out.height = pictures.front().height;
  for (const Rgb8Image& p : pictures)
    out.width += p.width;
  for (int y = 0; y < out.height; ++y)
    for (const Rgb8Image& p : pictures) {
      const auto row = p.bytes.begin() + static_cast<std::ptrdiff_t>(3) * y * p.width;
      out.bytes.insert(out.bytes.end(), row, row + static_cast<std::ptrdiff_t>(3) * p.width);
    }
  return out;
}

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
  if (interrupted())
    return interrupted_error("stdin");
  return {};
}

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
  if (interrupted())
    return interrupted_error("stdin");
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
  print_notes(opened->notes);
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
  print_notes(notes);
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

namespace {

/// The object's pixels and kSurroundings_px around them, each as a square of `zoom` pixels.
RgbImage zoomed(const RgbImage& image, const RgbImage& coverage, int zoom) {
  constexpr int kSurroundings_px = 12;
  int x0 = image.width, y0 = image.height, x1 = 0, y1 = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (coverage.at(x, y).r > 0.0f) {
        x0 = std::min(x0, x), x1 = std::max(x1, x + 1);
        y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
      }
  x0 = std::max(x0 - kSurroundings_px, 0), x1 = std::min(x1 + kSurroundings_px, image.width);
  y0 = std::max(y0 - kSurroundings_px, 0), y1 = std::min(y1 + kSurroundings_px, image.height);
  RgbImage out(zoom * (x1 - x0), zoom * (y1 - y0));
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      out.at(x, y) = image.at(x0 + x / zoom, y0 + y / zoom);
  return out;
}

/// Another comparison may be replaced; a picture of the run, a PNG too, only with --force.
Result<void> check_comparison(const CompareArguments& a, const std::string& frame) {
  std::error_code absent;
  for (const char* name : {"depth", "interior", "mask", "result", "sky", "truth"})
    if (!a.force && std::filesystem::equivalent(a.output, a.folder / (name + frame + ".png"), absent))
      return Error{ErrorCode::value_invalid, "the file to write is a picture of the run that is compared",
                   a.output.string(), "give another name, or --force to replace it"};
  return check_output(a.output, kPngKind, a.force);
}

Result<void> write_comparison(const CompareArguments& a, const PictureErrorInput& in) {
  const float exposure = preview_exposure(in.room);
  const auto shown = [&](const RgbImage& image, float scale) {
    return to_srgb8(a.zoom > 0 ? zoomed(image, in.coverage, a.zoom) : image, scale);
  };
  const std::vector<Rgb8Image> pictures = {shown(in.result, exposure), shown(in.truth, exposure),
                                           shown(difference_picture(in, kDifferenceGain), 1.0f)};
  return write_png(a.output, side_by_side(pictures));
}

/// A picture of the folder; `maker` is the program that writes it.
Result<void> read_of_run(const std::filesystem::path& path, const std::string& maker, RgbImage& image) {
  const auto read = read_into(path, image);
  if (read || read.error().code != ErrorCode::file_missing)
    return read;
  return Error{ErrorCode::file_missing, read.error().what, path.string(), maker};
}

Result<void> read_compared(const CompareArguments& a, const std::string& frame, PictureErrorInput& in) {
  const std::string simulate = "daylit-simulate SCENE.toml -o " + a.folder.string() + " writes it";
  const std::pair<const char*, RgbImage*> truth[] = {
      {"truth", &in.truth}, {"interior", &in.room}, {"mask", &in.coverage}, {"se", &in.standard_error.emplace()}};
  for (const auto& [name, image] : truth)
    if (const auto read = read_of_run(a.folder / (name + frame + ".exr"), simulate, *image); !read)
      return read;
  const auto result = a.result.empty() ? a.folder / ("result" + frame + ".exr") : a.result;
  const auto config = a.folder / ("CONFIG" + frame + ".toml");
  const std::string run = a.result.empty() ? "run daylit-run " + config.string() + " first, or give --result" : "";
  if (const auto read = read_of_run(result, run, in.result); !read)
    return read;
  auto mask = a.result_mask;
  if (const auto beside = a.folder / ("result-mask" + frame + ".exr");
      mask.empty() && a.result.empty() && std::filesystem::exists(beside))
    mask = beside;
  if (!mask.empty())
    if (const auto read = read_into(mask, in.result_coverage.emplace()); !read)
      return read;
  return a.second_truth.empty() ? Result<void>() : read_into(a.second_truth, in.second_truth.emplace());
}

} // namespace

Result<void> run_compare(const CompareArguments& a) {
  if (!a.output.empty() && a.output.extension() != ".png")
    return Error{ErrorCode::usage, "the comparison is a PNG picture", a.output.string(),
                 "give a name that ends in .png"};
  const std::string frame = a.frame == 0 ? "" : fmt::format("_{:04}", a.frame);
  PictureErrorInput in;
  if (const auto read = read_compared(a, frame, in); !read)
    return read;
  const auto error = measure_picture_error(in);
  if (!error)
    return error.error();
  if (!a.output.empty()) {
    if (const auto writable = check_comparison(a, frame); !writable)
      return writable;
    if (const auto written = write_comparison(a, in); !written)
      return written;
  }
  std::printf("%s%s", (a.json ? to_json(*error) : to_text(*error)).c_str(), a.json ? "\n" : "");
  return {};
}

Result<void> run_sky(const SkyCommandArguments& a) {
  SkyArguments arguments = a.sky;
  if (a.ground_albedo >= 0.0)
    arguments.ground_albedo = a.ground_albedo;
  const auto opened = open_sky(arguments);
  if (!opened)
    return opened.error();
  print_notes(opened->notes);
  if (a.output.empty())
    return answer_directions(opened->sky, a.json);
  if (!opened->sky.described())
    return Error{ErrorCode::usage, "this sky is a picture already", a.sky.file.string(),
                 "give a sky in words (.toml) or a weather tape (.epw, .wea)"};
  if (const auto writable = check_output(a.output, kExrKind, a.force); !writable)
    return writable;
  return write_exr(a.output, render_sky_panorama(*opened->sky.described(), a.height_px));
}

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
