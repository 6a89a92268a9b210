#include "scene/lens/lens.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;

/// theta_d of Kannala & Brandt (PAMI 2006, eq. 6 with k1 = 1 as in OpenCV and Kalibr), and its derivative.
struct AngleCurve {
  const std::array<double, 8>& k;
  double value(double t) const {
    const double s = t * t;
    return t * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
  }
  double slope(double t) const {
    const double s = t * t;
    return 1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])));
  }
};

/// theta with value(theta) = radius, on [0, max_theta] where the curve rises. Newton, kept inside a bracket.
std::optional<double> invert(const AngleCurve& curve, double radius, double max_theta) {
  double low = 0, high = max_theta;
  if (radius > curve.value(high) * (1 + 1e-14))
    return std::nullopt;
  double t = std::min(radius, high);
  for (int i = 0; i < 100; ++i) {
    const double error = curve.value(t) - radius;
    (error > 0 ? high : low) = t;
    const double slope = curve.slope(t);
    double next = slope > 0 ? t - error / slope : low - 1;
    if (!(next >= low && next <= high))
      next = 0.5 * (low + high);
    if (std::abs(next - t) <= 1e-16 * (1 + t))
      return next;
    t = next;
  }
  return t;
}

struct Distorted {
  glm::dvec2 point;
  double dxx, dxy, dyy; ///< Jacobian, symmetric for this model
};

/// Brown-Conrady / rational model of OpenCV: radial quotient and two tangential terms, order k1 k2 p1 p2 k3 k4 k5 k6.
Distorted distort(const std::array<double, 8>& k, const glm::dvec2& p) {
  const double x = p.x, y = p.y, s = x * x + y * y;
  const double num = 1 + s * (k[0] + s * (k[1] + s * k[4])), den = 1 + s * (k[5] + s * (k[6] + s * k[7]));
  const double num_s = k[0] + s * (2 * k[1] + s * 3 * k[4]), den_s = k[5] + s * (2 * k[6] + s * 3 * k[7]);
  const double radial = num / den, radial_s = (num_s * den - num * den_s) / (den * den);
  const double p1 = k[2], p2 = k[3];
  Distorted d;
  d.point = {x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * radial + p1 * (s + 2 * y * y) + 2 * p2 * x * y};
  d.dxx = radial + 2 * x * x * radial_s + 2 * p1 * y + 6 * p2 * x;
  d.dxy = 2 * x * y * radial_s + 2 * p1 * x + 2 * p2 * y;
  d.dyy = radial + 2 * y * y * radial_s + 6 * p1 * y + 2 * p2 * x;
  return d;
}

/// p with distort(p) = target: Newton steps with the analytic Jacobian, from the target itself; to 1e-15.
std::optional<glm::dvec2> undistort(const std::array<double, 8>& k, const glm::dvec2& target) {
  glm::dvec2 p = target;
  for (int i = 0; i < 50; ++i) {
    const Distorted d = distort(k, p);
    const glm::dvec2 error = d.point - target;
    const double determinant = d.dxx * d.dyy - d.dxy * d.dxy;
    if (!(determinant > 1e-12))
      return std::nullopt;
    const glm::dvec2 step{(d.dyy * error.x - d.dxy * error.y) / determinant,
                          (d.dxx * error.y - d.dxy * error.x) / determinant};
    p -= step;
    if (std::abs(step.x) + std::abs(step.y) < 1e-15 * (1 + std::abs(p.x) + std::abs(p.y)))
      return p;
  }
  const glm::dvec2 error = distort(k, p).point - target;
  return std::abs(error.x) + std::abs(error.y) < 1e-12 ? std::optional(p) : std::nullopt;
}

} // namespace

/// Equidistant: pixel = c + f theta_d(theta) (x, y)/hypot(x, y). Pinhole: pixel = c + f distort(x/z, y/z).
std::optional<glm::dvec2> LensModel::project(const glm::dvec3& d) const {
  const double across = std::hypot(d.x, d.y), theta = std::atan2(across, d.z);
  if (!(theta <= max_theta * (1 + 1e-15)))
    return std::nullopt;
  if (kind == LensKind::equidistant) {
    const double radius = AngleCurve{distortion}.value(theta);
    if (across == 0) // straight ahead, or straight back: the whole rim of a full-sphere map, its right end is taken
      return glm::dvec2(cx + (d.z < 0 ? fx * radius : 0.0), cy);
    const double scale = radius / across;
    return glm::dvec2(cx + fx * scale * d.x, cy + fy * scale * d.y);
  }
  if (!(d.z > 0))
    return std::nullopt;
  const glm::dvec2 p = distort(distortion, {d.x / d.z, d.y / d.z}).point;
  return glm::dvec2(cx + fx * p.x, cy + fy * p.y);
}

/// Inverse of project(), by the inverse of theta_d or of the distortion.
std::optional<glm::dvec3> LensModel::unproject(const glm::dvec2& pixel) const {
  const glm::dvec2 m{(pixel.x - cx) / fx, (pixel.y - cy) / fy};
  if (kind == LensKind::equidistant) {
    const double radius = std::sqrt(m.x * m.x + m.y * m.y);
    const std::optional<double> theta = invert(AngleCurve{distortion}, radius, max_theta);
    if (!theta)
      return std::nullopt;
    const double scale = radius > 0 ? std::sin(*theta) / radius : 0.0;
    return glm::dvec3(m.x * scale, m.y * scale, std::cos(*theta));
  }
  const std::optional<glm::dvec2> p = undistort(distortion, m);
  if (!p || std::atan(std::hypot(p->x, p->y)) > max_theta * (1 + 1e-15))
    return std::nullopt;
  const double length = std::sqrt(p->x * p->x + p->y * p->y + 1);
  return glm::dvec3(p->x / length, p->y / length, 1 / length);
}

bool LensModel::covers(const glm::dvec2& pixel) const {
  if (kind != LensKind::equidistant)
    return unproject(pixel).has_value();
  const double x = (pixel.x - cx) / fx, y = (pixel.y - cy) / fy;
  const double rim = AngleCurve{distortion}.value(max_theta) * (1 + 1e-14);
  return x * x + y * y <= rim * rim;
}

/// dOmega / (du dv), sr per square pixel. Equidistant: sin(theta) / (theta_d theta_d' fx fy). Pinhole: cos^3(theta) /
/// (det J fx fy), J the Jacobian of the distortion: cos^3 turns the plane z = 1 into steradians.
double LensModel::solid_angle_density(const glm::dvec2& pixel) const {
  const glm::dvec2 m{(pixel.x - cx) / fx, (pixel.y - cy) / fy};
  if (kind == LensKind::equidistant) {
    const AngleCurve curve{distortion};
    const double radius = std::sqrt(m.x * m.x + m.y * m.y);
    const std::optional<double> theta = invert(curve, radius, max_theta);
    if (!theta)
      return 0;
    const double sine_ratio = radius > 1e-9 ? std::sin(*theta) / radius : 1.0;
    return sine_ratio / (curve.slope(*theta) * fx * fy);
  }
  const std::optional<glm::dvec3> d = unproject(pixel);
  if (!d)
    return 0;
  const Distorted at = distort(distortion, {d->x / d->z, d->y / d->z});
  return d->z * d->z * d->z / ((at.dxx * at.dyy - at.dxy * at.dxy) * fx * fy);
}

/// First of 4096 steps at which the derivative of the radial curve is not positive.
double monotone_field(LensKind kind, const std::array<double, 8>& distortion, double limit) {
  constexpr int kSteps = 4096;
  for (int i = 1; i <= kSteps; ++i) {
    const double theta = limit * i / kSteps;
    if (kind == LensKind::equidistant) {
      if (!(AngleCurve{distortion}.slope(theta) > 0))
        return limit * (i - 1) / kSteps;
      continue;
    }
    if (theta >= 0.5 * kPi)
      return limit * (i - 1) / kSteps;
    std::array<double, 8> radial = distortion;
    radial[2] = radial[3] = 0; // the tangential terms do not turn the radial curve back
    if (!(distort(radial, {std::tan(theta), 0.0}).dxx > 0))
      return limit * (i - 1) / kSteps;
  }
  return limit;
}

/// r = f theta with f = (shorter side / 2) / (field of view / 2), pixels per radian.
LensModel ideal_fisheye(int width_px, int height_px, double field_of_view) {
  LensModel lens;
  lens.kind = LensKind::equidistant;
  lens.width_px = width_px;
  lens.height_px = height_px;
  lens.max_theta = 0.5 * field_of_view;
  lens.fx = lens.fy = 0.5 * std::min(width_px, height_px) / lens.max_theta;
  lens.cx = 0.5 * (width_px - 1);
  lens.cy = 0.5 * (height_px - 1);
  return lens;
}

/// f = (width / 2) / tan(field of view / 2), pixels.
LensModel ideal_pinhole(int width_px, int height_px, double horizontal_fov) {
  LensModel lens;
  lens.width_px = width_px;
  lens.height_px = height_px;
  lens.fx = lens.fy = 0.5 * width_px / std::tan(0.5 * horizontal_fov);
  lens.cx = 0.5 * (width_px - 1);
  lens.cy = 0.5 * (height_px - 1);
  return lens;
}

} // namespace daylit
