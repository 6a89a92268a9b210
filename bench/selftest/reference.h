#pragma once

// Closed forms of daylighting and radiative transfer that the selftest compares with. Lengths in metres, angles in
// radians; receivers and rectangles are axis-aligned. Nothing here uses the code that is tested.

#include <array>
#include <functional>

#include <glm/vec3.hpp>

namespace daylit::bench {

/// An interval along one axis.
struct Span {
  double low = 0, high = 0;
};

/// Form factor from an element to a parallel rectangle `x` by `y` (relative to the foot of the element's normal) at
/// distance c: corners of F = (1/2pi)[A/sqrt(1+A^2) atan(B/sqrt(1+A^2)) + B/sqrt(1+B^2) atan(A/sqrt(1+B^2))] with
/// A = a/c, B = b/c (Howell C-11), added and subtracted.
double parallel_factor(const Span& x, const Span& y, double c);

/// Form factor from an element to a perpendicular rectangle at distance d: `along` the element's normal (>= 0),
/// `across` it. Corners of F = (1/2pi)[atan(w/d) - d/sqrt(d^2+h^2) atan(w/sqrt(d^2+h^2))] (Howell C-12).
double perpendicular_factor(const Span& along, const Span& across, double d);

/// Directly opposed rectangles a x b at distance c (Howell C-11 integrated; Siegel & Howell configuration 4).
double opposed_rectangles(double a, double b, double c);
/// Rectangles of common edge l at a right angle, from the one of width w to the one of height h (configuration 5).
double hinged_rectangles(double l, double w, double h);

/// Nodes on (0, 1) and weights of the Gauss-Legendre rule with 64 points.
struct GaussRule {
  std::array<double, 64> node{}, weight{};
};
const GaussRule& gauss_rule();

using RadianceOf = std::function<double(const glm::dvec3& unit_direction)>;

/// Integral over the rectangle corner + s side_a + t side_b, seen from `point` facing `normal`, of
/// L(w) (n . w) dw, by 4 x 4 panels of the Gauss rule. The whole rectangle lies in front of the element; a step of the
/// radiance (the horizon) has to fall on a border of the panels.
double rectangle_irradiance(const glm::dvec3& point, const glm::dvec3& normal, const glm::dvec3& corner,
                            const glm::dvec3& side_a, const glm::dvec3& side_b, const RadianceOf& radiance);

/// Irradiance of a horizontal element by the whole upper hemisphere.
double horizontal_irradiance(const RadianceOf& radiance);

/// CIE general sky (ISO 15469) relative to the zenith: f(chi) phi(Z) / (f(Zs) phi(0)).
struct GeneralSky {
  double a, b, c, d, e;
  glm::dvec3 sun{0.0, 0.0, 1.0}; ///< unit
  double radiance(const glm::dvec3& unit_direction) const;
};
constexpr std::array<double, 5> kCieType1 = {4.0, -0.70, 0.0, -1.0, 0.0};     ///< overcast, steep gradation
constexpr std::array<double, 5> kCieType12 = {-1.0, -0.32, 10.0, -3.0, 0.45}; ///< clear, low turbidity

/// Overcast sky (1 + 2 sin g) / 3 of zenith 1.
double overcast_radiance(const glm::dvec3& unit_direction);
/// Sky component (share of the unobstructed horizontal irradiance) at distance D of a window W wide and H high whose
/// lower corner is level with the horizontal element and opposite it: under the overcast sky
/// 3/(14pi)(b - b' cos g) + 2/(7pi) asin(sin b sin g) - 1/(7pi) sin 2g sin b',
/// g = atan(H/D), b = atan(W/D), b' = atan(W/sqrt(D^2+H^2)) (split-flux tables; CIE 171:2006, 5.11).
double overcast_sky_component(double width, double height, double distance);

/// Fresnel slab in air, unpolarised, all internal orders: the sum of the series of reflections, term by term.
double slab_transmittance_series(double angle_of_incidence, double refractive_index);

} // namespace daylit::bench
