#include "scene/room/aperture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/core/orthonormal.h"
#include "scene/room/courtyard.h"
#include "scene/room/glass.h"
#include "scene/room/outlines.h"
#include "scene/room/polygon.h"

namespace daylit {

namespace {

// Test lines through a candidate for a hole, of which the first ones decide an early no; and through a pane, which may
// see the sky over a deep court alone.
constexpr int kLines = 512, kFirstLines = 64, kPaneLines = 4096;
constexpr double kHoleFraction = 0.01;     // of the lines must join the outside and a surface; through a pane, hit one
constexpr double kShutFraction = 0.1;      // a surface in its plane on more of it: the rim of a wall that has openings
constexpr double kExplainedFraction = 0.5; // more lines than this through a known aperture: not another one
constexpr double kTightEscape = 1e-3;      // more unexplained escape than this: look for rims of thick walls
constexpr int kWalks = 1024, kWalkRays = 8;
constexpr float kFar = std::numeric_limits<float>::infinity();

/// Additive recurrence of the plastic numbers (Roberts 2018): four-dimensional low-discrepancy points.
std::array<double, 4> quasi_random(int i) {
  constexpr double g = 1.1673039782614187; // x^5 = x + 1
  std::array<double, 4> p{};
  double a = 1.0;
  for (double& x : p) {
    a /= g;
    x = 0.5 + a * (i + 1);
    x -= std::floor(x);
  }
  return p;
}

/// Uniform points of a convex polygon.
class ConvexSampler {
public:
  explicit ConvexSampler(const std::vector<glm::dvec3>& corners) : corners_(corners) {
    for (std::size_t k = 1; k + 1 < corners.size(); ++k)
      cumulative_.push_back((cumulative_.empty() ? 0.0 : cumulative_.back()) +
                            0.5 * glm::length(glm::cross(corners[k] - corners[0], corners[k + 1] - corners[0])));
  }
  double area_m2() const { return cumulative_.back(); }
  glm::dvec3 sample(double s, double t) const {
    const double x = s * cumulative_.back();
    const auto fan = std::min<std::size_t>(
        static_cast<std::size_t>(std::upper_bound(cumulative_.begin(), cumulative_.end(), x) - cumulative_.begin()),
        cumulative_.size() - 1);
    const double low = fan == 0 ? 0.0 : cumulative_[fan - 1];
    const double r = std::sqrt(std::clamp((x - low) / (cumulative_[fan] - low), 0.0, 1.0));
    return (1.0 - r) * corners_[0] + r * (1.0 - t) * corners_[fan + 1] + r * t * corners_[fan + 2];
  }

private:
  const std::vector<glm::dvec3>& corners_;
  std::vector<double> cumulative_;
};

/// What happens to lines through a candidate opening. Side 0: the half-line along the normal, side 1: against it.
struct LineCount {
  int lines = 0;
  std::array<int, 2> escapes{};   ///< half-lines that reach infinity
  std::array<int, 2> joins{};     ///< the line escapes on this side and hits a surface on the other
  std::array<int, 2> explained{}; ///< of these, lines whose escaping half crosses a listed aperture
  std::array<int, 2> glazed{};    ///< of these, lines that cross a listed aperture on the other half
  int shut = 0;                   ///< a surface lies directly on the opening
  int outside() const { return joins[1] > joins[0] ? 1 : 0; }
};

class ApertureFinder {
public:
  ApertureFinder(const Room& room, const RayScene& scene) : room_(room), scene_(scene) {
    start_m_ = 8.0 * static_cast<double>(scene.surface_offset());
  }

  Result<Apertures> run() {
    add_windows();
    add_holes(detail::BorderKind::open);
    measure_escape();
    if (found_.list.empty() || found_.report.unexplained_escape > kTightEscape) {
      add_holes(detail::BorderKind::crease);
      measure_escape();
    }
    if (found_.list.empty())
      return Error{ErrorCode::geometry_invalid, "no window and no hole: no daylight can enter", reasons(),
                   "give the panes a material named window, or leave the openings open"};
    if (found_.report.unexplained_escape > kTightEscape)
      found_.report.notes.push_back(fmt::format("{:.2g} % of the test rays leave through no listed opening: model it "
                                                "as faces of a material named window",
                                                100.0 * found_.report.unexplained_escape));
    return std::move(found_);
  }

private:
  std::string reasons() const {
    std::string text = "room";
    for (const std::string& note : found_.report.notes)
      text += "; " + note;
    return text;
  }

  bool escapes(const glm::dvec3& from, const glm::dvec3& direction) const {
    return !scene_.occluded(scene_.to_local(from), glm::vec3(direction), 0.0f, kFar);
  }

  int crossed(const glm::dvec3& from, const glm::dvec3& direction,
              double distance = std::numeric_limits<double>::infinity()) const {
    int count = 0;
    aperture_transmittance(found_.list, from, direction, distance, &count);
    return count;
  }

  LineCount test(const detail::Outline& part, int lines = kLines, int first_lines = kFirstLines) const {
    const ConvexSampler sampler(part.corners);
    LineCount count;
    for (int i = 0; i < lines; ++i) {
      if (i == first_lines && count.joins[0] + count.joins[1] == 0)
        break;
      const std::array<double, 4> x = quasi_random(i);
      add_line(sampler.sample(x[0], x[1]), cosine_direction(part.normal, {x[2], x[3]}), part.normal, count);
    }
    return count;
  }

  void add_line(const glm::dvec3& q, const glm::dvec3& d, const glm::dvec3& normal, LineCount& count) const {
    // Both halves start a little behind the plane, so that a surface on it stops them.
    const double back = start_m_ / std::max(glm::dot(d, normal), 0.05);
    const std::array<glm::dvec3, 2> way{d, -d};
    std::array<bool, 2> free{};
    for (int side = 0; side < 2; ++side)
      free[side] = escapes(q - back * way[side], way[side]);
    ++count.lines;
    const auto near = static_cast<float>(2.0 * back);
    count.shut += scene_.occluded(scene_.to_local(q - back * d), glm::vec3(d), 0.0f, near) ? 1 : 0;
    for (int side = 0; side < 2; ++side) {
      count.escapes[side] += free[side] ? 1 : 0;
      if (!free[side] || free[1 - side])
        continue;
      ++count.joins[side];
      if (crossed(q - back * way[side], way[side]) > 0)
        ++count.explained[side];
      else if (glazed_before_hit(q, way[1 - side], back))
        ++count.glazed[side];
    }
  }

  bool glazed_before_hit(const glm::dvec3& q, const glm::dvec3& d, double back) const {
    RayHit hit;
    if (!scene_.closest(scene_.to_local(q - back * d), glm::vec3(d), 0.0f, kFar, hit))
      return false;
    int count = 0;
    aperture_transmittance(windows_only_, q, d, static_cast<double>(hit.distance), &count);
    return count > 0;
  }

  static glm::dvec3 middle(const std::vector<glm::dvec3>& corners) {
    glm::dvec3 sum(0.0);
    for (const glm::dvec3& p : corners)
      sum += p;
    return sum / static_cast<double>(corners.size());
  }

  void add_windows() {
    for (const detail::Pane& pane : detail::window_panes(room_)) {
      const LineCount count = test(pane.outline, kPaneLines, kPaneLines);
      const glm::dvec3 m = middle(pane.outline.corners);
      const std::string name =
          fmt::format("pane of \"{}\" at ({:.3g}, {:.3g}, {:.3g})", room_.materials[pane.material].name, m.x, m.y, m.z);
      if (lies_on_another(pane.outline)) {
        found_.report.notes.push_back(name + " is drawn twice: it counts once");
        continue;
      }
      if (count.shut > 0.99 * count.lines) {
        found_.report.notes.push_back(name + " lies on a wall and lets nothing through: cut the wall open there");
        continue;
      }
      if (std::min(count.escapes[0], count.escapes[1]) > (1.0 - kHoleFraction) * count.lines) {
        found_.report.notes.push_back(name + " has no room on either side and is left out");
        continue;
      }
      if (count.joins[0] + count.joins[1] == 0)
        found_.report.notes.push_back(name + " sees no sky: it is taken as glass between rooms");
      ++found_.report.window_polygons;
      found_.report.window_area_m2 += ConvexSampler(pane.outline.corners).area_m2();
      found_.list.push_back({pane.outline.corners, inward_of(pane.outline, count),
                             room_.materials[pane.material].transmittance,
                             room_.materials[pane.material].refractive_index});
    }
    windows_only_ = found_.list;
  }

  /// Inside a pane that is in the list, in the same plane.
  bool lies_on_another(const detail::Outline& pane) const {
    return std::ranges::any_of(found_.list, [&](const Aperture& known) {
      const double tolerance = 1e-6 * detail::extent(known.corners);
      const glm::dvec3 turn = glm::normalize(detail::newell_normal(known.corners));
      return std::ranges::all_of(pane.corners, [&](const glm::dvec3& p) {
        return std::abs(glm::dot(p - known.corners[0], turn)) <= tolerance &&
               detail::inside_convex(known.corners, turn, p, tolerance);
      });
    });
  }

  glm::dvec3 inward_of(const detail::Outline& part, const LineCount& count) const {
    if (count.escapes[0] != count.escapes[1])
      return count.escapes[0] < count.escapes[1] ? part.normal : -part.normal;
    const glm::dvec3 to_middle = room_.bounds().centre() - middle(part.corners);
    return glm::dot(part.normal, to_middle) >= 0.0 ? part.normal : -part.normal;
  }

  void add_holes(detail::BorderKind kind) {
    const detail::HoleOutlines candidates = detail::hole_outlines(room_, kind);
    if (!candidates.complete)
      found_.report.notes.push_back("too many open edges to look for holes everywhere: only some were followed");
    std::vector<std::vector<Aperture>> holes;
    for (const detail::Outline& outline : candidates.outlines)
      if (std::vector<Aperture> hole = open_parts(outline); !hole.empty())
        holes.push_back(std::move(hole));
    keep_outermost(holes);
    drop_courtyards(holes);
    for (const std::vector<Aperture>& hole : holes)
      for (const Aperture& part : hole) {
        ++found_.report.hole_polygons;
        found_.report.hole_area_m2 += ConvexSampler(part.corners).area_m2();
        found_.list.push_back(part);
      }
  }

  /// The convex parts of an outline when it is an opening that the list does not explain; else empty.
  std::vector<Aperture> open_parts(const detail::Outline& outline) const {
    std::vector<LineCount> counts;
    std::vector<Aperture> parts;
    for (const detail::Outline& part : detail::convex_parts(outline)) {
      counts.push_back(test(part));
      parts.push_back({part.corners, inward_of(part, counts.back()), Rgb(1.0f)});
    }
    return is_opening(counts) ? parts : std::vector<Aperture>{};
  }

  /// A tunnel has a rim at either end and light passes both: the outer one counts, the light of its walls is inside.
  void keep_outermost(std::vector<std::vector<Aperture>>& holes) {
    const std::vector<Aperture> known = found_.list;
    for (std::size_t i = 0; i < holes.size();) {
      found_.list = known;
      for (std::size_t k = 0; k < holes.size(); ++k)
        if (k != i)
          found_.list.insert(found_.list.end(), holes[k].begin(), holes[k].end());
      std::vector<LineCount> counts;
      for (const Aperture& part : holes[i])
        counts.push_back(test({part.corners, part.inward}));
      if (is_opening(counts))
        ++i;
      else
        holes.erase(holes.begin() + static_cast<std::ptrdiff_t>(i));
    }
    found_.list = known;
  }

  void drop_courtyards(std::vector<std::vector<Aperture>>& holes) {
    std::erase_if(holes, [&](const std::vector<Aperture>& hole) {
      if (!detail::is_over_courtyard(hole, windows_only_, scene_))
        return false;
      const glm::dvec3 m = middle(hole[0].corners);
      found_.report.notes.push_back(fmt::format(
          "windows look at the sky through the opening at ({:.3g}, {:.3g}, {:.3g}): it is over a courtyard, "
          "which counts as outdoors",
          m.x, m.y, m.z));
      return true;
    });
  }

  static bool is_opening(const std::vector<LineCount>& counts) {
    double lines = 0.0, shut = 0.0, joins = 0.0, known = 0.0;
    for (const LineCount& count : counts) {
      const int out = count.outside();
      lines += count.lines;
      shut += count.shut;
      joins += count.joins[out];
      known += count.explained[out] + count.glazed[out];
    }
    return shut <= kShutFraction * lines && joins >= kHoleFraction * lines && joins > 0.0 &&
           known <= kExplainedFraction * joins;
  }

  /// Diffuse walks that start behind the apertures: every ray that leaves must have crossed one of them. A walk ends
  /// where it goes out: from the ground before the house it may leave as it likes.
  void measure_escape() {
    if (found_.list.empty())
      return;
    int rays = 0, unexplained = 0;
    for (int i = 0; i < kWalks; ++i) {
      const Aperture& start = found_.list[static_cast<std::size_t>(i) % found_.list.size()];
      std::array<double, 4> x = quasi_random(i);
      glm::dvec3 p = ConvexSampler(start.corners).sample(x[0], x[1]) + start_m_ * start.inward, normal = start.inward;
      for (int bounce = 0; bounce < kWalkRays; ++bounce) {
        x = quasi_random(kWalkRays * i + bounce);
        const glm::dvec3 d = cosine_direction(normal, {x[2], x[3]});
        RayHit hit;
        ++rays;
        if (!scene_.closest(scene_.to_local(p), glm::vec3(d), 0.0f, kFar, hit)) {
          unexplained += crossed(p, d) == 0 ? 1 : 0;
          break;
        }
        if (crossed(p, d, static_cast<double>(hit.distance)) > 0)
          break; // outdoors, or in a room behind glass
        normal = glm::normalize(area_normal(room_, room_.triangles[hit.triangle]));
        normal = glm::dot(normal, d) < 0.0 ? normal : -normal;
        p += static_cast<double>(hit.distance) * d + start_m_ * normal;
      }
    }
    found_.report.unexplained_escape = static_cast<double>(unexplained) / rays;
  }

  const Room& room_;
  const RayScene& scene_;
  double start_m_ = 0.0; // ray offset
  Apertures found_;
  std::vector<Aperture> windows_only_;
};

} // namespace

Result<Apertures> find_apertures(const Room& room, const RayScene& scene) { return ApertureFinder(room, scene).run(); }

namespace {

constexpr double kRim = 1e-9; // of an aperture's extent: a ray that passes so close to its edge crosses it

/// Distance along d to the aperture's plane; outside (0, distance) it is not met.
double distance_to_plane(const Aperture& a, const glm::dvec3& p, double speed) {
  return glm::dot(a.corners[0] - p, a.inward) / speed;
}

/// Corners may be listed either way round: the normal about which they turn left.
glm::dvec3 turning_normal(const Aperture& a) {
  return glm::dot(detail::newell_normal(a.corners), a.inward) >= 0.0 ? a.inward : -a.inward;
}

} // namespace

Rgb aperture_transmittance(const std::vector<Aperture>& apertures, const glm::dvec3& p, const glm::dvec3& d,
                           double distance, int* crossed) {
  Rgb product(1.0f);
  int count = 0;
  for (const Aperture& a : apertures) {
    const double speed = glm::dot(d, a.inward), t = distance_to_plane(a, p, speed);
    if (!(t > 0.0 && t < distance) ||
        !detail::inside_convex(a.corners, turning_normal(a), p + t * d, kRim * detail::extent(a.corners)))
      continue;
    product *= pane_transmittance(a, speed);
    ++count;
  }
  if (crossed)
    *crossed = count;
  return product;
}

ApertureCrossings::ApertureCrossings(const std::vector<Aperture>& apertures) : apertures_(apertures) {
  for (const Aperture& a : apertures_) {
    Outline o{.turn = turning_normal(a), .tolerance_m = kRim * detail::extent(a.corners)};
    for (const glm::dvec3& c : a.corners)
      o.middle += c / static_cast<double>(a.corners.size());
    for (const glm::dvec3& c : a.corners)
      o.radius_m = std::max(o.radius_m, glm::distance(c, o.middle) + 2.0 * o.tolerance_m);
    outline_.push_back(o);
  }
}

ApertureCrossings::Met ApertureCrossings::met(const glm::dvec3& p, const glm::dvec3& d, double distance) const {
  Met met;
  for (std::size_t k = 0; k < apertures_.size(); ++k) {
    const Aperture& a = apertures_[k];
    const Outline& o = outline_[k];
    const double speed = glm::dot(d, a.inward), t = distance_to_plane(a, p, speed);
    if (!(t > 0.0 && t < distance))
      continue;
    const glm::dvec3 at = p + t * d, off = at - o.middle;
    if (glm::dot(off, off) > o.radius_m * o.radius_m || !detail::inside_convex(a.corners, o.turn, at, o.tolerance_m))
      continue;
    met.transmittance *= pane_transmittance(a, speed);
    met.nearest_m = std::min(met.nearest_m, t);
    ++met.count;
  }
  return met;
}

} // namespace daylit
