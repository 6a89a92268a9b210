#include "bench/selftest/reference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit::bench {

namespace {

constexpr double kPi = std::numbers::pi;

double square(double x) { return x * x; }

/// The four signed corners of an antiderivative that is odd in both arguments.
template <class F>
double corners(const F& f, const Span& x, const Span& y) {
  return f(x.high, y.high) - f(x.low, y.high) - f(x.high, y.low) + f(x.low, y.low);
}

GaussRule make_gauss_rule() {
  // Newton iteration on the Legendre polynomial P_64 (Abramowitz & Stegun 25.4.29).
  constexpr int n = 64;
  GaussRule rule;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(kPi * (i + 0.75) / (n + 0.5)), slope = 1.0;
    for (int step = 0; step < 10; ++step) {
      double before = 1.0, now = x;
      for (int k = 2; k <= n; ++k) {
        const double next = ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k;
        before = now;
        now = next;
      }
      slope = n * (x * now - before) / (x * x - 1.0);
      x -= now / slope;
    }
    rule.node[i] = 0.5 * (1.0 - x);
    rule.weight[i] = 1.0 / ((1.0 - x * x) * slope * slope);
  }
  return rule;
}

/// Composite rule over [0, 1]^2.
template <class F>
double integrate(int panels, const F& f) {
  const GaussRule& rule = gauss_rule();
  double sum = 0;
  for (int p = 0; p < panels; ++p)
    for (int q = 0; q < panels; ++q)
      for (std::size_t i = 0; i < rule.node.size(); ++i)
        for (std::size_t j = 0; j < rule.node.size(); ++j)
          sum += rule.weight[i] * rule.weight[j] * f((p + rule.node[i]) / panels, (q + rule.node[j]) / panels);
  return sum / square(panels);
}

} // namespace

const GaussRule& gauss_rule() {
  static const GaussRule rule = make_gauss_rule();
  return rule;
}

double parallel_factor(const Span& x, const Span& y, double c) {
  return corners(
      [c](double a, double b) {
        const double p = std::hypot(a, c), q = std::hypot(b, c);
        return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi);
      },
      x, y);
}

double perpendicular_factor(const Span& along, const Span& across, double d) {
  return corners(
      [d](double h, double w) {
        const double r = std::hypot(d, h);
        return (std::atan(w / d) - d / r * std::atan(w / r)) / (2 * kPi);
      },
      along, across);
}

double opposed_rectangles(double a, double b, double c) {
  const double x = a / c, y = b / c, p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return 2 / (kPi * x * y) *
         (std::log(p * q / std::sqrt(1 + x * x + y * y)) + x * q * std::atan(x / q) + y * p * std::atan(y / p) -
          x * std::atan(x) - y * std::atan(y));
}

double hinged_rectangles(double l, double w, double h) {
  const double W = w / l, H = h / l, w2 = W * W, h2 = H * H, s = w2 + h2;
  const double logs = std::log((1 + w2) * (1 + h2) / (1 + s)) + w2 * std::log(w2 * (1 + s) / ((1 + w2) * s)) +
                      h2 * std::log(h2 * (1 + s) / ((1 + h2) * s));
  return (W * std::atan(1 / W) + H * std::atan(1 / H) - std::sqrt(s) * std::atan(1 / std::sqrt(s)) + 0.25 * logs) /
         (kPi * W);
}

double rectangle_irradiance(const glm::dvec3& point, const glm::dvec3& normal, const glm::dvec3& corner,
                            const glm::dvec3& side_a, const glm::dvec3& side_b, const RadianceOf& radiance) {
  const glm::dvec3 area = glm::cross(side_a, side_b);
  return integrate(4, [&](double s, double t) {
    const glm::dvec3 d = corner + s * side_a + t * side_b - point;
    const double r2 = glm::dot(d, d);
    const glm::dvec3 w = d / std::sqrt(r2);
    return radiance(w) * std::max(0.0, glm::dot(w, normal)) * std::abs(glm::dot(w, area)) / r2;
  });
}

double horizontal_irradiance(const RadianceOf& radiance) {
  // 320 x 320 nodes: six digits beside the cone that a sun makes in the sky.
  return integrate(5, [&](double s, double t) {
    const double z = 0.5 * kPi * s, phi = 2 * kPi * t;
    const glm::dvec3 w(std::sin(z) * std::cos(phi), std::sin(z) * std::sin(phi), std::cos(z));
    return kPi * kPi * std::sin(z) * std::cos(z) * radiance(w);
  });
}

double GeneralSky::radiance(const glm::dvec3& w) const {
  const auto gradation = [this](double cosine) { return cosine > 1e-9 ? 1 + a * std::exp(b / cosine) : 1.0; };
  const auto indicatrix = [this](double cosine) {
    const double x = std::clamp(cosine, -1.0, 1.0);
    return 1 + c * (std::exp(d * std::acos(x)) - std::exp(d * kPi / 2)) + e * x * x;
  };
  if (w.z < 0)
    return 0;
  return indicatrix(glm::dot(w, sun)) * gradation(w.z) / (indicatrix(sun.z) * gradation(1.0));
}

double overcast_radiance(const glm::dvec3& w) { return w.z < 0 ? 0.0 : (1 + 2 * w.z) / 3; }

double overcast_sky_component(double width, double height, double distance) {
  const double g = std::atan(height / distance), b = std::atan(width / distance),
               b1 = std::atan(width / std::hypot(distance, height));
  return 3 / (14 * kPi) * (b - b1 * std::cos(g)) + 2 / (7 * kPi) * std::asin(std::sin(b) * std::sin(g)) -
         1 / (7 * kPi) * std::sin(2 * g) * std::sin(b1);
}

double slab_transmittance_series(double angle, double n) {
  const double ci = std::cos(angle), ct = std::sqrt(1 - square(std::sin(angle) / n));
  double mean = 0;
  for (const double r : {square((ci - n * ct) / (ci + n * ct)), square((n * ci - ct) / (n * ci + ct))}) {
    double order = square(1 - r); // through both faces, then every further pair of internal reflections
    for (int k = 0; k < 100000 && order > 1e-18; ++k, order *= r * r)
      mean += 0.5 * order;
  }
  return mean;
}

} // namespace daylit::bench
