#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "scene/core/parallel.h"
#include "scene/sky/sky_image.h"

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRimSplit = 16; ///< sub-pixels per side where the rim of the field crosses a pixel

/// Rotation about +z, counter-clockwise as seen from above; angle in radians.
glm::dmat3 turn_about_z(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1);
}

/// An angular map is the picture of an ideal equidistant lens of 360 degrees.
/// r = side/2 * theta/pi with theta the angle from the axis (Debevec, light probe images).
LensModel angular_lens(int side) {
  LensModel lens;
  lens.kind = LensKind::equidistant;
  lens.width_px = lens.height_px = side;
  lens.fx = lens.fy = side / (2 * kPi);
  lens.cx = lens.cy = 0.5 * (side - 1);
  lens.max_theta = kPi;
  return lens;
}

/// Solid angle of a pixel inside the field: Gauss-Legendre, 2 x 2 points.
/// dOmega = J du dv with J the solid-angle density of the lens, sr per pixel (LensModel::solid_angle_density).
double whole_pixel(const LensModel& lens, int x, int y) {
  const double offset = 0.5 / std::sqrt(3.0);
  double sum = 0;
  for (int k = 0; k < 4; ++k)
    sum += lens.solid_angle_density({x + (k % 2 ? offset : -offset), y + (k / 2 ? offset : -offset)});
  return 0.25 * sum;
}

Error geometry_error(const std::string& what, const std::string& name, const std::string& hint) {
  return {ErrorCode::value_invalid, what, name, hint};
}

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

} // namespace

Result<std::shared_ptr<const SkyGeometry>> SkyGeometry::make(int width, int height, const SkyProjection& projection,
                                                             const std::string& name) {
  if (width < 1 || height < 1)
    return geometry_error("the image is empty", name, "");
  std::shared_ptr<SkyGeometry> g(new SkyGeometry);
  g->width_ = width;
  g->height_ = height;
  g->projection_ = projection;
  if (const auto* equirect = std::get_if<EquirectProjection>(&projection)) {
    g->rotation_ = equirect->rotation;
    g->measure_equirect();
    return std::shared_ptr<const SkyGeometry>(g);
  }
  if (const auto* angular = std::get_if<AngularProjection>(&projection)) {
    const glm::dvec3 right = glm::cross(angular->forward, angular->up);
    if (width != height)
      return geometry_error("an angular map must be square, this image is " + size_text(width, height), name,
                            "check --projection");
    if (!(glm::length(right) > 1e-6 * glm::length(angular->forward) * glm::length(angular->up)))
      return geometry_error("the forward axis is parallel to the up axis, or zero", name, "check --forward, --sky-up");
    const glm::dvec3 x = glm::normalize(right), z = glm::normalize(angular->forward);
    g->lens_ = angular_lens(width);
    g->world_from_camera_ = turn_about_z(angular->rotation) * glm::dmat3(x, glm::cross(z, x), z);
  } else {
    const FisheyeProjection& fisheye = std::get<FisheyeProjection>(projection);
    const LensModel& lens = fisheye.lens;
    if ((lens.width_px && lens.width_px != width) || (lens.height_px && lens.height_px != height))
      return geometry_error("the image is " + size_text(width, height) + " but the lens file is for " +
                                size_text(lens.width_px, lens.height_px),
                            name, "use the lens file of this camera mode");
    g->lens_ = lens;
    g->world_from_camera_ = turn_about_z(fisheye.rotation) * lens.world_from_camera;
  }
  g->measure_lens();
  return std::shared_ptr<const SkyGeometry>(g);
}

/// Solid angle of each texel, steradians: the band between colatitudes a < b holds 2 pi (cos a - cos b), split evenly
/// over `width` texels.
void SkyGeometry::measure_equirect() {
  solid_angle_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    // cos a - cos b = 2 sin((a + b)/2) sin((b - a)/2): no cancellation at the poles.
    const double band = 2 * std::sin(kPi * (y + 0.5) / height_) * std::sin(0.5 * kPi / height_);
    std::fill_n(solid_angle_.begin() + static_cast<std::ptrdiff_t>(y) * width_, width_,
                static_cast<float>(2 * kPi / width_ * band));
  }
}

/// Steradians of a pixel's part inside the field: the density of the lens, by Gauss-Legendre where the whole pixel is
/// inside, by 16 x 16 midpoints where the rim crosses it (the density is 0 outside).
double SkyGeometry::pixel_solid_angle(int x, int y) const {
  int inside = 0;
  for (int k = 0; k < 4; ++k)
    inside += lens_->covers({x + (k % 2 ? 0.5 : -0.5), y + (k / 2 ? 0.5 : -0.5)}) ? 1 : 0;
  if (inside == 4) // the field is convex
    return whole_pixel(*lens_, x, y);
  inside = 0;
  for (int k = 0; k < 9; ++k)
    inside += lens_->covers({x + 0.5 * (k % 3 - 1), y + 0.5 * (k / 3 - 1)}) ? 1 : 0;
  if (inside == 0)
    return 0;
  double sum = 0;
  for (int i = 0; i < kRimSplit; ++i)
    for (int j = 0; j < kRimSplit; ++j)
      sum += lens_->solid_angle_density({x - 0.5 + (i + 0.5) / kRimSplit, y - 0.5 + (j + 0.5) / kRimSplit});
  return sum / (kRimSplit * kRimSplit);
}

/// Solid angle of each pixel and, for a picture that does not cover the sphere, the same times the cosine of the zenith
/// angle: the weight in the irradiance of the horizontal.
void SkyGeometry::measure_lens() {
  const std::size_t texels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  solid_angle_.resize(texels);
  covers_sphere_ = std::holds_alternative<AngularProjection>(projection_);
  if (!covers_sphere_)
    projected_solid_angle_.resize(texels);
  parallel_for(0, height_, [&](int y) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
      const double omega = pixel_solid_angle(x, y);
      solid_angle_[i] = static_cast<float>(omega);
      if (covers_sphere_ || omega == 0)
        continue;
      const auto d = direction({double(x), double(y)});
      projected_solid_angle_[i] = d && d->z > 0 ? static_cast<float>(omega * d->z) : 0.0f;
    }
  });
}

/// Equirectangular: u in [0, 1] from left to right is azimuth rotation + pi (1 - 2 u), v from top to bottom is the
/// zenith angle pi v. Else the ray of the lens, turned into the world.
std::optional<glm::dvec3> SkyGeometry::direction(const glm::dvec2& pixel) const {
  if (lens_) {
    const std::optional<glm::dvec3> d = lens_->unproject(pixel);
    return d ? std::optional(world_from_camera_ * *d) : std::nullopt;
  }
  const double u = (pixel.x + 0.5) / width_, v = (pixel.y + 0.5) / height_;
  if (!(v >= 0 && v <= 1))
    return std::nullopt;
  const double azimuth = rotation_ + kPi * (1 - 2 * u), across = std::sin(kPi * v);
  return glm::dvec3(across * std::cos(azimuth), across * std::sin(azimuth), std::cos(kPi * v));
}

/// Inverse of direction(); pixel centres have whole coordinates.
std::optional<glm::dvec2> SkyGeometry::pixel(const glm::dvec3& d) const {
  if (lens_) {
    const std::optional<glm::dvec2> p = lens_->project(glm::transpose(world_from_camera_) * d);
    const bool in_image = p && p->x >= -0.5 && p->y >= -0.5 && p->x <= width_ - 0.5 && p->y <= height_ - 0.5;
    return in_image ? p : std::nullopt;
  }
  double u = 0.5 - (std::atan2(d.y, d.x) - rotation_) / (2 * kPi);
  u -= std::floor(u);
  const double v = std::atan2(std::hypot(d.x, d.y), d.z) / kPi;
  return glm::dvec2(u * width_ - 0.5, v * height_ - 0.5);
}

std::optional<std::size_t> SkyGeometry::texel(const glm::dvec3& d) const {
  const std::optional<glm::dvec2> p = pixel(d);
  if (!p)
    return std::nullopt;
  const int x = std::clamp(static_cast<int>(std::floor(p->x + 0.5)), 0, width_ - 1);
  const int y = std::clamp(static_cast<int>(std::floor(p->y + 0.5)), 0, height_ - 1);
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
}

} // namespace daylit
