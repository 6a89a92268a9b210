#include "radiosity/detail/aperture_beam.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "radiosity/polygon_kernel.h"

namespace daylit::radiosity {

namespace {

constexpr double kCosineRounding = 1e-6; // of cosines in single precision
constexpr double kGrazing = 1e-9;        // cosine below which a patch receives nothing

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// Keeps what lies to the left of the line a -> b (Sutherland & Hodgman 1974).
ApertureBeam::LitPart clip_left(const ApertureBeam::LitPart& p, const glm::dvec2& a, const glm::dvec2& b) {
  ApertureBeam::LitPart out;
  for (int k = 0; k < p.size; ++k) {
    const glm::dvec2 &from = p.corner[k], &to = p.corner[k + 1 < p.size ? k + 1 : 0];
    const double h0 = cross(b - a, from - a), h1 = cross(b - a, to - a);
    if (h0 >= 0.0)
      out.corner[out.size++] = from;
    if ((h0 > 0.0 && h1 < 0.0) || (h0 < 0.0 && h1 > 0.0))
      out.corner[out.size++] = from + (h0 / (h0 - h1)) * (to - from);
  }
  return out;
}

} // namespace

ApertureBeam::ApertureBeam(const Patch& e, const AperturePart& opening)
    : origin_(e.corner[0]), axis_u_(glm::normalize(e.corner[1] - e.corner[0])), axis_v_(glm::cross(e.normal, axis_u_)),
      normal_(e.normal), area_m2_(e.area_m2) {
  for (int k = 0; k < 3; ++k)
    triangle_[k] = {glm::dot(e.corner[k] - origin_, axis_u_), glm::dot(e.corner[k] - origin_, axis_v_)};
  SmallPolygon whole;
  for (const glm::dvec3& c : opening.corner)
    whole.corner[whole.size++] = c;
  const SmallPolygon front = clip_to_front(whole, origin_, normal_);
  glm::dvec3 turn(0.0);
  for (int k = 0; k < front.size; ++k) {
    const glm::dvec3 d = front.corner[k] - origin_;
    corner_.emplace_back(glm::dot(d, axis_u_), glm::dot(d, axis_v_), glm::dot(d, normal_));
    front_.push_back(front.corner[k]);
    if (k > 1)
      turn += glm::cross(front.corner[k - 1] - front.corner[0], front.corner[k] - front.corner[0]);
  }
  // Light that enters falls on the back of the opening and on the front of the patch: its shadow turns as the opening
  // does, seen from inside, whatever the direction.
  if (glm::dot(turn, opening.inward) > 0.0)
    std::ranges::reverse(corner_);
  set_cone(e);
}

/// Every way from patch to opening lies in a cone about the way between their middles: two spheres of radii r and R at
/// distance d see each other within asin((r + R) / d).
void ApertureBeam::set_cone(const Patch& e) {
  const glm::dvec3 centre = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& c : front_)
    middle += c / static_cast<double>(front_.size());
  double own = 0, opening = 0;
  for (const glm::dvec3& c : front_)
    opening = std::max(opening, glm::distance(c, middle));
  for (const glm::dvec3& c : e.corner)
    own = std::max(own, glm::distance(c, centre));
  const double distance = glm::distance(middle, centre), sine = (opening + own) / std::max(distance, 1e-300);
  axis_ = distance > 0 ? (middle - centre) / distance : glm::dvec3(0.0);
  cos_spread_ = sine < 1.0 ? static_cast<float>(std::sqrt(1.0 - sine * sine) - kCosineRounding) : -2.0f;
}

/// All corners of the patch lie to the left of every edge of the shadow.
bool ApertureBeam::covers_patch(const LitPart& shadow) const {
  for (int k = 0; k < shadow.size; ++k) {
    const glm::dvec2 &a = shadow.corner[k], side = shadow.corner[k + 1 < shadow.size ? k + 1 : 0] - a;
    for (const glm::dvec2& t : triangle_)
      if (cross(side, t - a) < 0.0)
        return false;
  }
  return true;
}

/// A corner p of the opening at height h over the patch throws its shadow to p - h w / (n . w). The lit part is the
/// shadow of the outline clipped to the triangle; area = 1/2 sum of the cross products of its fan, m^2.
ApertureBeam::LitPart ApertureBeam::lit(const glm::dvec3& w) const {
  const double wn = glm::dot(w, normal_);
  LitPart part;
  if (wn <= kGrazing)
    return part;
  const glm::dvec2 slope = glm::dvec2(glm::dot(w, axis_u_), glm::dot(w, axis_v_)) / wn;
  glm::dvec2 lo(std::numeric_limits<double>::infinity()), hi(-lo);
  for (const glm::dvec3& c : corner_) {
    const glm::dvec2 p = glm::dvec2(c) - c.z * slope;
    part.corner[part.size++] = p;
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  }
  for (int axis = 0; axis < 2; ++axis)
    if (std::max({triangle_[0][axis], triangle_[1][axis], triangle_[2][axis]}) <= lo[axis] ||
        std::min({triangle_[0][axis], triangle_[1][axis], triangle_[2][axis]}) >= hi[axis])
      return {};
  if (covers_patch(part))
    return {{triangle_[0], triangle_[1], triangle_[2]}, 3, area_m2_};
  for (int k = 0; k < 3 && part.size > 0; ++k)
    part = clip_left(part, triangle_[k], triangle_[(k + 1) % 3]);
  for (int k = 1; k + 1 < part.size; ++k)
    part.area_m2 += cross(part.corner[k] - part.corner[0], part.corner[k + 1] - part.corner[0]);
  part.area_m2 *= 0.5;
  return part;
}

/// A triangle of the fan in proportion to its area, then (1 - sqrt a) p0 + sqrt a ((1 - b) p1 + b p2) within it.
glm::dvec3 ApertureBeam::point(const LitPart& part, glm::dvec2 u) const {
  double pick = u.x * 2.0 * part.area_m2, area = 0;
  int k = 1;
  for (;; ++k) {
    area = cross(part.corner[k] - part.corner[0], part.corner[k + 1] - part.corner[0]);
    if (pick <= area || k + 2 >= part.size)
      break;
    pick -= area;
  }
  const double root = std::sqrt(area > 0 ? std::clamp(pick / area, 0.0, 1.0) : 0.0);
  const glm::dvec2 q = (1.0 - root) * part.corner[0] + root * ((1.0 - u.y) * part.corner[k] + u.y * part.corner[k + 1]);
  return origin_ + q.x * axis_u_ + q.y * axis_v_;
}

} // namespace daylit::radiosity
