// daylit-simulate photographs.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include "scene/core/atomic_file.h"
#include "scene/core/parallel.h"
#include "scene/core/program.h"
#include "scene/image/image_formats.h"
#include "scene/lens/lens.h"
#include "simulate/photograph_command.h"
#include "simulate/sensor_picture.h"

namespace daylit {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kSide = 4;                      ///< rays per pixel, along each axis
constexpr Rgb kWall(0.2f);                    ///< behind the print
constexpr float kPaper = 0.75f, kInk = 0.02f; ///< reflectance of white paper, and at least of ink
constexpr int kTries = 2000;                  ///< poses, until one shows the print as wanted
constexpr int kMostRays = 1 << 26;            ///< corners of pixels

/// A print before the camera: its axes and its top left corner in the camera's frame, metres.
struct PrintPose {
  glm::dvec3 x, y, corner;
};

struct Print {
  RgbImage reflectance;
  glm::dvec2 size_m;
};

Result<Print> read_print(const PhotographsArguments& a) {
  const auto codes = read_ldr_image(a.print);
  if (!codes)
    return codes.error();
  Print print{RgbImage(codes->width, codes->height), {a.width_m, a.width_m * codes->height / codes->width}};
  for (std::size_t i = 0; i < print.reflectance.texels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      print.reflectance.texels[i][c] = std::max(
          kInk, kPaper * srgb_decode(static_cast<float>(codes->bytes[3 * i + static_cast<std::size_t>(c)]) / 255.0f));
  return print;
}

/// Directions through the corners of all pixels, not normalised; zero where the lens sees nothing. In between they are
/// interpolated.
struct RayGrid {
  int columns = 0;
  std::vector<glm::vec3> ray;
  explicit RayGrid(const LensModel& lens)
      : columns(lens.width_px + 1), ray(static_cast<std::size_t>(columns) * (lens.height_px + 1)) {
    parallel_for(0, lens.height_px + 1, [&](int y) {
      for (int x = 0; x < columns; ++x)
        if (const auto d = lens.unproject({x - 0.5, y - 0.5}))
          at(x, y) = glm::vec3(*d);
    });
  }
  glm::vec3& at(int x, int y) { return ray[static_cast<std::size_t>(y) * columns + x]; }
  const glm::vec3& at(int x, int y) const { return ray[static_cast<std::size_t>(y) * columns + x]; }
};

/// The plane's point, in prints, that a ray meets: s and t in 0..1 inside of the print.
class Plane {
public:
  Plane(const PrintPose& pose, const Print& print)
      : print_(print),
        inverse_(glm::inverse(glm::dmat3(pose.x * print.size_m.x, pose.y * print.size_m.y, pose.corner))) {}
  Rgb light(const glm::vec3& ray) const {
    const glm::vec3 h = inverse_ * ray;
    if (!(h.z > 0) || h.x < 0 || h.y < 0 || h.x >= h.z || h.y >= h.z)
      return kWall;
    const auto& r = print_.reflectance;
    return r.at(std::min(static_cast<int>(h.x / h.z * static_cast<float>(r.width)), r.width - 1),
                std::min(static_cast<int>(h.y / h.z * static_cast<float>(r.height)), r.height - 1));
  }

private:
  const Print& print_;
  glm::mat3 inverse_;
};

Rgb pixel_light(const Plane& plane, const RayGrid& rays, int x, int y) {
  const glm::vec3 a = rays.at(x, y), b = rays.at(x + 1, y), c = rays.at(x, y + 1), d = rays.at(x + 1, y + 1);
  const glm::vec3 zero(0.0f);
  if (a == zero || b == zero || c == zero || d == zero)
    return Rgb(0.0f);
  Rgb sum(0.0f);
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const float u = (static_cast<float>(i) + 0.5f) / kSide, v = (static_cast<float>(j) + 0.5f) / kSide;
      sum += plane.light((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d));
    }
  return sum / static_cast<float>(kSide * kSide);
}

/// The print in the direction (theta, phi), tilted; its upper edge is up in the picture apart from `turn`.
PrintPose pose_at(const Print& print, double theta, double phi, double distance, double tilt, double axis,
                  double turn) {
  const glm::dquat aside = glm::angleAxis(phi, glm::dvec3(0, 0, 1)) * glm::angleAxis(theta, glm::dvec3(0, 1, 0)) *
                           glm::angleAxis(-phi, glm::dvec3(0, 0, 1));
  const glm::dquat q = aside * glm::angleAxis(tilt, glm::dvec3(std::cos(axis), std::sin(axis), 0)) *
                       glm::angleAxis(turn, glm::dvec3(0, 0, 1));
  PrintPose pose{q * glm::dvec3(1, 0, 0), q * glm::dvec3(0, 1, 0), {}};
  pose.corner = aside * glm::dvec3(0, 0, distance) - 0.5 * (print.size_m.x * pose.x + print.size_m.y * pose.y);
  return pose;
}

/// The view that a picture has: its half angle, and whether a direction lies in it.
class Field {
public:
  explicit Field(const LensModel& lens) : lens_(lens), round_(lens.kind == LensKind::equidistant) {
    const double x = 0.5 * lens.width_px / lens.fx, y = 0.5 * lens.height_px / lens.fy;
    half_ = round_ ? lens.max_theta : std::atan(std::hypot(x, y));
    narrow_ = round_ ? lens.max_theta : std::atan(std::min(x, y));
  }
  bool round() const { return round_; }
  double half() const { return half_; }
  double narrow() const { return narrow_; }
  bool holds(const glm::dvec3& p, double reach) const {
    const auto at = lens_.project(p);
    if (!at || at->x < 2 || at->y < 2 || at->x > lens_.width_px - 3 || at->y > lens_.height_px - 3)
      return false;
    return !round_ || std::acos(p.z / glm::length(p)) <= reach * half_;
  }

private:
  const LensModel& lens_;
  bool round_;
  double half_ = 0, narrow_ = 0;
};

/// Directions spread over the field, poses at random, until all of the print (or its middle) is in the picture.
std::optional<PrintPose> find_pose(const PhotographsArguments& a, const Print& print, const Field& field, int view,
                                   std::mt19937& random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double radius = 0.5 * glm::length(print.size_m);
  for (int k = 0; k < kTries; ++k) {
    const double theta = a.reach * field.half() * std::sqrt((view + u(random)) / a.views) * (1.0 - 0.5 * k / kTries),
                 phi = 2.39996 * view + 0.6 * (u(random) - 0.5) + 6.28 * u(random) * k / kTries;
    const double part = a.part > 0      ? a.part
                        : field.round() ? 0.4
                                        : 1.0,
                 fitting = radius / std::tan(std::min(part * field.narrow(), 1.2));
    const double distance = a.distance_m.size() == 2 ? a.distance_m[0] + (a.distance_m[1] - a.distance_m[0]) * u(random)
                                                     : fitting * (0.85 + 0.5 * u(random));
    const PrintPose pose = pose_at(print, theta, phi, distance, a.tilt_deg * kDegree * (0.5 + 0.5 * u(random)),
                                   6.28 * u(random), 0.4 * (u(random) - 0.5));
    bool seen = glm::dot(glm::cross(pose.x, pose.y), pose.corner) > 0.2 * glm::length(pose.corner);
    for (const glm::dvec2& at : {glm::dvec2(0, 0), {1, 0}, {0, 1}, {1, 1}, {0.5, 0.5}})
      if (!a.partly || at.x == 0.5)
        seen =
            seen && field.holds(pose.corner + at.x * print.size_m.x * pose.x + at.y * print.size_m.y * pose.y, a.reach);
    if (seen)
      return pose;
  }
  return std::nullopt;
}

RgbImage photograph(const PhotographsArguments& a, const Print& print, const LensModel& lens, const RayGrid& rays,
                    const PrintPose& pose, std::uint32_t seed) {
  RgbImage light(lens.width_px, lens.height_px);
  const Plane plane(pose, print);
  parallel_for(0, light.height, [&](int y) {
    for (int x = 0; x < light.width; ++x)
      light.at(x, y) = pixel_light(plane, rays, x, y);
  });
  glm::mat3 camera;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      camera[c][r] = static_cast<float>(a.exposure * a.camera_from_rec709[static_cast<std::size_t>(3 * r + c)]);
  for (Rgb& texel : light.texels)
    texel = camera * texel;
  blur(light, a.blur_px);
  add_noise(light, {a.noise, 0.0, 0.0}, seed);
  return light;
}

} // namespace

Result<void> run_photographs(const PhotographsArguments& a) {
  const auto print = read_print(a);
  if (!print)
    return print.error();
  const auto lens = read_lens(a.lens);
  if (!lens)
    return lens.error();
  if (lens->width_px == 0 || static_cast<double>(lens->width_px) * lens->height_px > kMostRays)
    return Error{ErrorCode::value_invalid, "a simulated camera needs image_width and image_height, at most 67 Mpixels",
                 a.lens.string(), "add both to the lens file"};
  const Field field(*lens);
  const RayGrid rays(*lens);
  std::mt19937 random(a.seed);
  ProgressLine progress(a.quiet || a.json);
  std::string truth;
  for (int v = 0; v < a.views; ++v) {
    if (!progress.update("photographs", static_cast<double>(v) / a.views))
      return interrupted_error("photographs");
    const auto pose = find_pose(a, *print, field, v, random);
    if (!pose)
      return Error{ErrorCode::value_invalid, "the print does not fit into the picture", a.print.string(),
                   "a smaller --part, or a larger --distance"};
    const std::string name = fmt::format("photograph-{:02}{}", v, extension_of(a.format));
    const RgbImage light = photograph(a, *print, *lens, rays, *pose, a.seed + static_cast<std::uint32_t>(v));
    std::error_code failed; // of a folder that cannot be made, writing says why
    std::filesystem::create_directories(a.folder, failed);
    if (const Result<void> written = write_camera_file(a.folder / name, light, a.format); !written)
      return written;
    const auto row = [](const glm::dvec3& p) { return fmt::format("[{:.9g},{:.9g},{:.9g}]", p.x, p.y, p.z); };
    truth += fmt::format("{}{{\"file\":\"{}\",\"x\":{},\"y\":{},\"corner_m\":{}}}", v ? ",\n" : "", name, row(pose->x),
                         row(pose->y), row(pose->corner));
  }
  return write_file_atomically(a.folder / "truth.json", "[" + truth + "]\n");
}

} // namespace daylit
