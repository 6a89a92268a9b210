#include "radiosity/detail/slats.h"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/room/ray_scene.h"

namespace daylit::radiosity {

namespace {

constexpr int kStrips = 4, kSamples = 4;
constexpr double kLong = 4;          ///< length / width, at least
constexpr double kRightAngle = 1e-3; ///< cosine
constexpr double kOpen = 2;          ///< widths from the middle of a gap to what closes it, at least

/// A right-angled triangle with a short and a long side there.
struct HalfSlat {
  glm::dvec2 corner, across, along; ///< both from the corner, metres

  static std::optional<HalfSlat> of(const std::array<glm::dvec2, 3>& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      HalfSlat s{t[k], t[(k + 1) % 3] - t[k], t[(k + 2) % 3] - t[k]};
      if (glm::length(s.across) > glm::length(s.along))
        std::swap(s.across, s.along);
      const double width = glm::length(s.across), length = glm::length(s.along);
      if (width > 0.0 && length >= kLong * width &&
          std::abs(glm::dot(s.across, s.along)) <= kRightAngle * width * length)
        return s;
    }
    return std::nullopt;
  }
  /// Along the middle of the half: 0 at the corner, 1 where it ends.
  glm::dvec2 at(double u) const { return corner + 0.25 * across + 0.7 * u * along; }
};

class Gaps {
public:
  Gaps(const RayScene& rays, const glm::dvec3& origin) : rays_(rays), origin_(origin) {}

  /// Most of the slat has a narrow gap on this side of it.
  bool before(const PlaneGroup& g, const HalfSlat& s, double side) const {
    int narrow = 0;
    for (int k = 0; k < kSamples; ++k)
      narrow += is_narrow(g, s, g.lift(s.at((k + 0.5) / kSamples)), side) ? 1 : 0;
    return 2 * narrow > kSamples;
  }

private:
  bool is_narrow(const PlaneGroup& g, const HalfSlat& s, const glm::dvec3& from, double side) const {
    const double width = glm::length(s.across);
    const std::optional<double> gap = distance(from, side * g.normal, width);
    if (!gap)
      return false;
    const glm::dvec3 middle = from + 0.5 * *gap * side * g.normal,
                     across = (s.across.x * g.axis_u + s.across.y * g.axis_v) / width;
    return !distance(middle, across, kOpen * width) || !distance(middle, -across, kOpen * width);
  }

  /// To the first surface within reach.
  std::optional<double> distance(const glm::dvec3& from, const glm::dvec3& way, double reach) const {
    RayHit hit;
    if (!rays_.closest(rays_.to_local(from + origin_), glm::vec3(way), 4.0f * rays_.surface_offset(),
                       static_cast<float>(reach), hit))
      return std::nullopt;
    return static_cast<double>(hit.distance);
  }

  const RayScene& rays_;
  glm::dvec3 origin_;
};

} // namespace

/// Lines parallel to the long side, from the short one to the third: those of the other half go on from there.
Result<void> cut_slats(const Room& room, const glm::dvec3& origin, std::vector<PlaneGroup>& groups) {
  const Result<RayScene> rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const Gaps gaps(*rays, origin);
  for (PlaneGroup& g : groups)
    for (const std::array<glm::dvec2, 3>& t : g.triangles)
      if (const auto slat = HalfSlat::of(t); slat && (gaps.before(g, *slat, 1.0) || gaps.before(g, *slat, -1.0)))
        for (int k = 1; k < kStrips; ++k) {
          const double f = static_cast<double>(k) / kStrips;
          const glm::dvec2 from = slat->corner + f * slat->across;
          g.contacts.push_back({from, from + (1.0 - f) * slat->along});
        }
  return {};
}

} // namespace daylit::radiosity
