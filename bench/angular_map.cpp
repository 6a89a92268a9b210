#include "bench/angular_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace daylit::bench {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSub = 4; ///< samples per pixel and axis

Rgb bilinear(const RgbImage& image, int x0, int y0, int face, double u, double v) {
  const double x = std::clamp(u * face - 0.5, 0.0, face - 1.0), y = std::clamp(v * face - 0.5, 0.0, face - 1.0);
  const int i = std::min(int(x), face - 2), j = std::min(int(y), face - 2);
  const float fx = float(x - i), fy = float(y - j);
  const auto at = [&](int a, int b) { return image.at(x0 + i + a, y0 + j + b); };
  return (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) + (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
}

} // namespace

Rgb sample_cross(const RgbImage& cross, const glm::dvec3& d) {
  const int face = cross.width / 3;
  const double ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
  const auto on = [&](int column, int row, double s, double t, double depth) {
    return bilinear(cross, column * face, row * face, face, 0.5 + 0.5 * s / depth, 0.5 + 0.5 * t / depth);
  };
  if (az >= ax && az >= ay)
    return d.z > 0 ? on(1, 1, d.x, -d.y, az) : on(1, 3, d.x, d.y, az);
  if (ax >= ay)
    return d.x > 0 ? on(2, 1, -d.z, -d.y, ax) : on(0, 1, d.z, -d.y, ax);
  return d.y > 0 ? on(1, 0, d.x, d.z, ay) : on(1, 2, d.x, -d.z, ay);
}

AngularMap angular_map(const std::function<Rgb(const glm::dvec3&)>& radiance, int side) {
  AngularMap map;
  const auto direction = [](double u, double v) { // u right, v up, in units of the radius
    const double r = std::hypot(u, v), s = r > 0.0 ? std::sin(kPi * r) / r : kPi;
    return glm::dvec3(s * u, s * v, std::cos(kPi * r));
  };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const long a = 2L * j + 1 - side, b = side - 2L * i - 1;
      if (a * a + b * b > long(side) * side)
        continue;
      const double theta = kPi * std::sqrt(double(a * a + b * b)) / side, scale = std::sin(theta) / theta * kPi / side;
      map.x.push_back(scale * double(a));
      map.y.push_back(scale * double(b));
      map.z.push_back(std::cos(theta));
      map.solid_angle.push_back(4.0 * kPi * kPi / (double(side) * side) * std::sin(theta) / theta);
      map.column.push_back(j);
      map.row.push_back(i);
      Rgb sum(0.0f);
      for (int k = 0; k < kSub * kSub; ++k) {
        const double u = (2.0 * (j + (k % kSub + 0.5) / kSub) - side) / side;
        const double v = (side - 2.0 * (i + (k / kSub + 0.5) / kSub)) / side;
        sum += radiance(std::hypot(u, v) < 1.0 ? direction(u, v) : direction(double(a) / side, double(b) / side));
      }
      for (int c = 0; c < 3; ++c)
        map.values.push_back(double(sum[c] / float(kSub * kSub)));
    }
  return map;
}

AngularMap angular_map(const RgbImage& cross, int side) {
  return angular_map([&](const glm::dvec3& w) { return sample_cross(cross, w); }, side);
}

std::vector<float> equirectangular_map(const RgbImage& cross, int width, int height) {
  std::vector<float> image;
  for (int i = 0; i < height; ++i)
    for (int j = 0; j < width; ++j) {
      Rgb sum(0.0f);
      for (int k = 0; k < kSub * kSub; ++k) {
        const double theta = kPi * (i + (k / kSub + 0.5) / kSub) / height;
        const double phi = kPi - 2.0 * kPi * (j + (k % kSub + 0.5) / kSub) / width;
        // forward = centre of the image, azimuth grows to the left
        sum +=
            sample_cross(cross, {-std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi)});
      }
      for (int c = 0; c < 3; ++c)
        image.push_back(sum[c] / float(kSub * kSub));
    }
  return image;
}

} // namespace daylit::bench
