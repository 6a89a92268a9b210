#include "radiosity/polygon_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

struct Edge {
  glm::dvec3 from, unit;
  double length;
};

// Gauss-Legendre on [0, 1], 12 nodes: half of the symmetric rule.
constexpr std::array<double, 6> kNode = {0.1252334085114689, 0.3678314989981802, 0.5873179542866175,
                                         0.7699026741943047, 0.9041172563704749, 0.9815606342467192};
constexpr std::array<double, 6> kWeight = {0.2491470458134028, 0.2334925365383548, 0.2031674267230659,
                                           0.1600783285433462, 0.1069393259953184, 0.0471753363865118};

/// Antiderivative in s of ln sqrt(s^2 + h^2): s/2 ln(s^2 + h^2) - s + h atan(s / h).
double log_distance_integral(double s, double h) {
  const double r2 = s * s + h * h;
  if (r2 <= 0.0)
    return 0.0;
  const double angle = h > 1e-150 ? h * std::atan(s / h) : 0.0;
  return 0.5 * s * std::log(r2) - s + angle;
}

/// Integral of ln |x - p| for x along the edge: closed, with the distance of p from the line as h.
double inner(const Edge& e, const glm::dvec3& p) {
  const glm::dvec3 d = p - e.from;
  const double along = glm::dot(d, e.unit);
  const double off = glm::length(d - along * e.unit);
  return log_distance_integral(e.length - along, off) - log_distance_integral(-along, off);
}

/// K with K'' = ln |x|: K = x^2 (ln |x| / 2 - 3/4).
double second_antiderivative(double x) { return x == 0.0 ? 0.0 : x * x * (0.5 * std::log(std::abs(x)) - 0.75); }

/// Both edges on one line: int int ln |s - t| ds dt = K(p - c) + K(-d) - K(p - d) - K(-c), exact. c, d: positions of
/// q's ends on p's axis.
double collinear(const Edge& p, double c, double d) {
  const double integral = second_antiderivative(p.length - c) + second_antiderivative(-d) -
                          second_antiderivative(p.length - d) - second_antiderivative(-c);
  return d >= c ? integral : -integral; // |dt| along q
}

/// Integral over [a, b] of p's parameter. Cubic clustering s = a + (b - a)(3u^2 - 2u^3) flattens the s ln s kinks that
/// touching edges put at a and b.
double outer_clustered(const Edge& p, const Edge& q, double a, double b) {
  double sum = 0;
  for (std::size_t k = 0; k < kNode.size(); ++k)
    for (const double side : {-1.0, 1.0}) {
      const double u = 0.5 * (1.0 + side * kNode[k]);
      const double s = u * u * (3.0 - 2.0 * u), ds = 6.0 * u * (1.0 - u);
      sum += 0.5 * kWeight[k] * ds * inner(q, p.from + (a + (b - a) * s) * p.unit);
    }
  return sum * (b - a);
}

/// Plain Gauss-Legendre, for edges that keep a distance.
template <std::size_t N>
double outer_gauss(const Edge& p, const Edge& q, const std::array<double, N>& node,
                   const std::array<double, N>& weight) {
  double sum = 0;
  for (std::size_t k = 0; k < N; ++k)
    sum += weight[k] * inner(q, p.from + node[k] * p.length * p.unit);
  return sum * p.length;
}
constexpr std::array<double, 3> kNode3 = {0.1127016653792583, 0.5, 0.8872983346207417};
constexpr std::array<double, 3> kWeight3 = {5.0 / 18, 8.0 / 18, 5.0 / 18};
constexpr std::array<double, 5> kNode5 = {0.0469100770306680, 0.2307653449471585, 0.5, 0.7692346550528415,
                                          0.9530899229693320};
constexpr std::array<double, 5> kWeight5 = {0.1184634425280945, 0.2393143352496832, 0.2844444444444444,
                                            0.2393143352496832, 0.1184634425280945};

/// Gap between the bounding spheres of the edges, in units of the longer one.
double relative_gap(const Edge& p, const Edge& q) {
  const double centres = glm::distance(p.from + 0.5 * p.length * p.unit, q.from + 0.5 * q.length * q.unit);
  return (centres - 0.5 * (p.length + q.length)) / std::max(p.length, q.length);
}

/// int int ln |x - y| over both edges, m^2: the inner integral along q is closed, the outer one along p by a rule that
/// follows the distance of the two.
double log_double_integral(const Edge& p, const Edge& q) {
  const double gap = relative_gap(p, q);
  if (gap > 1.5)
    return outer_gauss(p, q, kNode3, kWeight3);
  if (gap > 0.3)
    return outer_gauss(p, q, kNode5, kWeight5);
  const glm::dvec3 d0 = q.from - p.from, d1 = d0 + q.length * q.unit;
  const double c = glm::dot(d0, p.unit), d = glm::dot(d1, p.unit);
  const double tolerance = 1e-9 * (p.length + q.length);
  if (glm::length(d0 - c * p.unit) < tolerance && glm::length(d1 - d * p.unit) < tolerance)
    return collinear(p, c, d);
  // Break where q's ends come closest: there the integrand may have a kink.
  std::array<double, 4> cut = {0.0, std::clamp(std::min(c, d), 0.0, p.length),
                               std::clamp(std::max(c, d), 0.0, p.length), p.length};
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    if (cut[k + 1] - cut[k] > 1e-12 * p.length)
      sum += outer_clustered(p, q, cut[k], cut[k + 1]);
  return sum;
}

Edge edge_of(const SmallPolygon& polygon, int k) {
  const glm::dvec3 from = polygon.corner[k], d = polygon.corner[(k + 1) % polygon.size] - from;
  const double length = glm::length(d);
  return {from, length > 0.0 ? d / length : glm::dvec3(0.0), length};
}

/// The polygon with its corners counter-clockwise about `normal`: the contour integral changes sign with the order.
SmallPolygon oriented(std::span<const glm::dvec3> corners, const glm::dvec3& normal) {
  SmallPolygon p;
  glm::dvec3 area(0.0);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    p.corner[p.size++] = corners[k];
    area += glm::cross(corners[k] - corners[0], corners[(k + 1) % corners.size()] - corners[0]);
  }
  if (glm::dot(area, normal) < 0.0)
    std::reverse(p.corner.begin(), p.corner.begin() + p.size);
  return p;
}

} // namespace

/// One plane of the clip of Sutherland & Hodgman (1974).
SmallPolygon clip_to_front(const SmallPolygon& polygon, const glm::dvec3& point, const glm::dvec3& normal) {
  SmallPolygon out;
  for (int k = 0; k < polygon.size; ++k) {
    const glm::dvec3 &a = polygon.corner[k], &b = polygon.corner[(k + 1) % polygon.size];
    const double ha = glm::dot(a - point, normal), hb = glm::dot(b - point, normal);
    if (ha >= 0.0)
      out.corner[out.size++] = a;
    if ((ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0))
      out.corner[out.size++] = a + (ha / (ha - hb)) * (b - a);
  }
  return out;
}

/// F = 1/(2 pi) sum_k gamma_k (a x b / |a x b|) . n over the edges a -> b seen from the point, gamma_k = atan2(|a x b|,
/// a . b) the angle that an edge spans (Lambert 1760; Cohen & Wallace 1993, ch. 4).
double point_to_polygon(const glm::dvec3& point, const glm::dvec3& normal, std::span<const glm::dvec3> polygon) {
  SmallPolygon whole;
  for (const glm::dvec3& c : polygon)
    whole.corner[whole.size++] = c;
  const SmallPolygon visible = clip_to_front(whole, point, normal);
  double sum = 0;
  for (int k = 0; k < visible.size; ++k) {
    const glm::dvec3 a = visible.corner[k] - point, b = visible.corner[(k + 1) % visible.size] - point;
    const glm::dvec3 axis = glm::cross(a, b);
    const double sine = glm::length(axis);
    if (sine > 0.0)
      sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(axis, normal) / sine;
  }
  return std::abs(sum) / (2.0 * std::numbers::pi);
}

/// G = A_i F_ij = 1/(2 pi) sum_pq (u_p . u_q) int int ln r ds dt over all pairs of edges, m^2 (Sparrow 1963; Cohen &
/// Wallace 1993, ch. 4): Stokes' theorem applied to both areas.
double exchange_area_unoccluded(const SmallPolygon& a, const SmallPolygon& b) {
  double sum = 0;
  for (int i = 0; i < a.size; ++i) {
    const Edge p = edge_of(a, i);
    if (p.length <= 0.0)
      continue;
    for (int j = 0; j < b.size; ++j) {
      const Edge q = edge_of(b, j);
      const double cosine = glm::dot(p.unit, q.unit);
      if (q.length <= 0.0 || cosine == 0.0)
        continue;
      // The longer edge carries the closed inner integral; ties keep the order, so that (a, b) and (b, a) agree.
      sum += cosine * (p.length <= q.length ? log_double_integral(p, q) : log_double_integral(q, p));
    }
  }
  return std::max(0.0, sum / (2.0 * std::numbers::pi));
}

double exchange_area_unoccluded(std::span<const glm::dvec3> a, const glm::dvec3& normal_a,
                                std::span<const glm::dvec3> b, const glm::dvec3& normal_b) {
  const SmallPolygon front_a = clip_to_front(oriented(a, normal_a), b[0], normal_b);
  const SmallPolygon front_b = clip_to_front(oriented(b, normal_b), a[0], normal_a);
  if (front_a.size < 3 || front_b.size < 3)
    return 0.0;
  return exchange_area_unoccluded(front_a, front_b);
}

} // namespace daylit::radiosity
