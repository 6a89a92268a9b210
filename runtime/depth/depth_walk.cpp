#include "runtime/depth/depth_walk.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit {

namespace {

/// Part of the ray inside the box of the things; empty where it passes it.
struct Stretch {
  double from = 0.0, to = 0.0; ///< metres
};

std::optional<Stretch> in_box(const RealThings& things, const glm::dvec3& origin, const glm::dvec3& direction,
                              double most_m) {
  constexpr double kMargin_m = 0.01;
  Stretch s{0.0, most_m};
  for (int k = 0; k < 3; ++k) {
    const double deep = things.thickest_m() + kMargin_m; // and so much wider behind their fronts
    const double low = k == 2 ? std::max(things.low().z - kMargin_m, 0.5 * kNearPlane_m) : things.low()[k] - deep;
    const double high = things.high()[k] + deep;
    if (direction[k] == 0.0) {
      if (origin[k] < low || origin[k] > high)
        return std::nullopt;
      continue;
    }
    const double a = (low - origin[k]) / direction[k], b = (high - origin[k]) / direction[k];
    s.from = std::max(s.from, std::min(a, b));
    s.to = std::min(s.to, std::max(a, b));
  }
  return s.from < s.to ? std::optional(s) : std::nullopt;
}

/// The way of a ray through the picture: pixels and 1 / z are linear in it.
class Walk {
public:
  Walk(const RealThings& things, const glm::dvec3& origin, const glm::dvec3& direction, const Stretch& s)
      : things_(things), origin_(origin), direction_(direction), first_(at(s.from)), step_(at(s.to) - first_),
        from_origin_(s.from == 0.0),
        count_(std::max(static_cast<int>(std::ceil(std::max(std::fabs(step_.x), std::fabs(step_.y)))), 1)) {
    step_ /= count_;
  }

  /// Distance to the first pixel in which the ray is behind a front, no deeper than things are, and was not before.
  std::optional<double> first_hit() const {
    bool inside = false;
    for (int k = 0; k <= count_; ++k) {
      const glm::dvec3 p = first_ + static_cast<double>(k) * step_;
      const int x = static_cast<int>(std::floor(p.x + 0.5)), y = static_cast<int>(std::floor(p.y + 0.5));
      if (x < 0 || y < 0 || x >= things_.width_px() || y >= things_.height_px() || !things_.tile_has_inner(x, y)) {
        k += steps_to_leave_tile(p, x, y);
        inside = false;
        continue;
      }
      const double enters = z(k - 0.5), leaves = z(k + 0.5);
      const double front = static_cast<double>(things_.z(x, y)),
                   back = front + static_cast<double>(things_.thickness_m(x, y));
      if (k == 0)
        inside = from_origin_ && enters >= front && enters <= back;
      const bool meets =
          things_.is_inner(x, y) && std::min(enters, leaves) <= back && std::max(enters, leaves) >= front;
      if (meets && !inside)
        return distance(p, enters < front ? front : enters > back ? back : z(k)); // through front, back or side
      inside = meets && leaves >= front && leaves <= back;
    }
    return std::nullopt;
  }

private:
  /// Pixel position and 1 / z of the point so far along the ray.
  glm::dvec3 at(double t) const {
    const glm::dvec3 p = origin_ + t * direction_;
    const PinholeCamera& c = things_.camera();
    return {c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy, 1.0 / p.z};
  }
  /// Depth after so many steps, in the stretch.
  double z(double k) const { return 1.0 / (first_.z + std::clamp(k, 0.0, static_cast<double>(count_)) * step_.z); }
  int steps_to_leave_tile(const glm::dvec3& p, int x, int y) const {
    const auto steps = [](double from, double step, int pixel) {
      constexpr int kTile = RealThings::kTile;
      if (step == 0.0)
        return 1e9;
      const int tile = (pixel >= 0 ? pixel : pixel - kTile + 1) / kTile;
      const double border = (step > 0.0 ? tile + 1 : tile) * kTile - 0.5;
      return (border - from) / step;
    };
    return static_cast<int>(std::clamp(std::min(steps(p.x, step_.x, x), steps(p.y, step_.y, y)), 0.0, 1e6));
  }
  /// Of depth z, where the pixel is p: along the axis in which the ray is longest.
  double distance(const glm::dvec3& p, double z) const {
    if (std::fabs(direction_.z) > 0.1)
      return (z - origin_.z) / direction_.z;
    const PinholeCamera& c = things_.camera();
    const glm::dvec3 on((p.x - c.cx) / c.fx / p.z, (p.y - c.cy) / c.fy / p.z, 1.0 / p.z);
    return glm::dot(on - origin_, direction_);
  }

  const RealThings& things_;
  glm::dvec3 origin_, direction_;
  glm::dvec3 first_, step_;
  bool from_origin_;
  int count_;
};

} // namespace

std::optional<double> first_thing(const RealThings& things, const WorldRay& ray, double most_m) {
  if (!things.any())
    return std::nullopt;
  const glm::dvec3 origin = things.to_camera(ray.origin),
                   direction = things.camera_from_world() * glm::dvec3(ray.direction);
  const auto stretch = in_box(things, origin, direction, most_m);
  if (!stretch)
    return std::nullopt;
  const auto hit = Walk(things, origin, direction, *stretch).first_hit();
  return hit && *hit < most_m ? hit : std::nullopt;
}

} // namespace daylit
