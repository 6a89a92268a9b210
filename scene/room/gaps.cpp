#include "scene/room/gaps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/geometric.hpp>

#include "scene/core/segment.h"
#include "scene/room/aperture.h"
#include "scene/room/edge_graph.h"
#include "scene/room/polygon.h"
#include "scene/room/ray_scene.h"

namespace daylit {

namespace {

constexpr double kSample_m = 0.1; // along edges
constexpr int kFewestSamples = 2, kMostSamples = 64;
constexpr double kMostAlong = 0.5; // of a gap's width: how far across may lead along the edge
constexpr double kLeastAir = 0.25; // of its width: the middle of a gap is this far from every surface
constexpr int kLines = 128, kFewestLeaks = 2;
constexpr float kFar = std::numeric_limits<float>::infinity();

/// What is across from a point of an edge.
struct Across {
  glm::dvec3 way{0.0}; ///< to the nearest point of another surface
  double width_m = 0;
  std::uint32_t material = 0; ///< of the edge
};

class GapFinder {
public:
  GapFinder(const Room& room, const std::vector<Aperture>& apertures, double widest_m, const RayScene& all,
            const RayScene& reflecting)
      : room_(room), apertures_(apertures), joined_m_(detail::weld_tolerance_m(room)), widest_m_(widest_m + joined_m_),
        all_(all), reflecting_(reflecting) {}

  Gaps run() {
    Gaps found;
    std::optional<detail::EdgeGraph> graph = detail::border_graph(room_, detail::BorderKind::crease);
    if (!graph) {
      found.complete = false;
      graph = detail::border_graph(room_, detail::BorderKind::open);
    }
    if (!graph)
      return found;
    std::vector<Gap> gaps;
    for (const auto& [a, b] : graph->edges)
      follow(graph->points[a], graph->points[b], gaps);
    std::ranges::sort(gaps, [](const Gap& a, const Gap& b) { return a.area_m2 > b.area_m2; });
    for (const Gap& gap : gaps)
      if (!is_known(gap, found.list) && leaks(gap)) {
        found.list.push_back(gap);
        found.widest_m = std::max(found.widest_m, gap.widest_m);
        found.length_m += gap.length_m;
        found.area_m2 += gap.area_m2;
      }
    return found;
  }

private:
  /// Gaps along an edge: runs of samples with another surface across.
  void follow(const glm::dvec3& a, const glm::dvec3& b, std::vector<Gap>& gaps) const {
    const double length = glm::distance(a, b);
    const int n = std::clamp(static_cast<int>(std::ceil(length / kSample_m)), kFewestSamples, kMostSamples);
    const glm::dvec3 along = (b - a) / length, step = (b - a) / double(n);
    std::vector<Across> run;
    for (int i = 0; i <= n; ++i) {
      const auto across = i < n ? look_across(a + (i + 0.5) * step, along) : std::nullopt;
      if (across)
        run.push_back(*across);
      if (across || run.empty())
        continue;
      gaps.push_back(gap_of(run, a + static_cast<double>(i - std::ssize(run)) * step, a + double(i) * step));
      run.clear();
    }
  }

  /// The gap of a run of samples, in the middles of equal parts of an edge; across from its ends lies what the first
  /// two and the last two samples lead to.
  static Gap gap_of(const std::vector<Across>& run, const glm::dvec3& from, const glm::dvec3& to) {
    const std::size_t last = run.size() - 1, second = std::min<std::size_t>(1, last);
    const glm::dvec3 at_from = 1.5 * run[0].way - 0.5 * run[second].way,
                     at_to = 1.5 * run[last].way - 0.5 * run[last - second].way;
    Gap gap{{from, to, to + at_to, from + at_from}, 0, glm::distance(from, to), 0, run[0].material};
    for (const Across& across : run) {
      gap.widest_m = std::max(gap.widest_m, across.width_m);
      gap.area_m2 += across.width_m * gap.length_m / static_cast<double>(run.size());
    }
    return gap;
  }

  glm::dvec3 nearest(const glm::dvec3& p, std::uint32_t triangle) const {
    const RoomTriangle& t = room_.triangles[triangle];
    return detail::nearest_on_triangle(p, room_.corner(t, 0), room_.corner(t, 1), room_.corner(t, 2));
  }

  /// Is `p` on the border of the triangle?
  bool on_border(const glm::dvec3& p, std::uint32_t triangle) const {
    const RoomTriangle& t = room_.triangles[triangle];
    for (int k = 0; k < 3; ++k)
      if (distance_to_segment(p, room_.corner(t, k), room_.corner(t, (k + 1) % 3)) <= joined_m_)
        return true;
    return false;
  }

  /// The nearest surface that does not belong to the edge, if it is across air; empty where the edge touches one.
  std::optional<Across> look_across(const glm::dvec3& p, const glm::dvec3& along) const {
    const std::vector<std::uint32_t> near =
        all_.triangles_within(all_.to_local(p), static_cast<float>(widest_m_ + joined_m_));
    Across best{glm::dvec3(0.0), widest_m_, 0};
    bool found = false;
    for (const std::uint32_t t : near) {
      if (on_border(p, t)) {
        best.material = room_.triangles[t].material;
        continue;
      }
      const glm::dvec3 way = nearest(p, t) - p;
      const double width = glm::length(way);
      if (width <= joined_m_)
        return std::nullopt;
      if (width <= best.width_m) {
        best.way = way;
        best.width_m = width;
        found = true;
      }
    }
    if (!found || std::abs(glm::dot(best.way, along)) > kMostAlong * best.width_m)
      return std::nullopt;
    const glm::dvec3 middle = p + 0.5 * best.way;
    for (const std::uint32_t t : near)
      if (glm::distance(nearest(middle, t), middle) < kLeastAir * best.width_m)
        return std::nullopt;
    return best;
  }

  /// Both sides of a gap have an edge: the second one lies along the first.
  bool is_known(const Gap& gap, const std::vector<Gap>& list) const {
    for (const Gap& known : list) {
      const double reach = 1.5 * known.widest_m + joined_m_;
      if (distance_to_segment(gap.corners[0], known.corners[0], known.corners[1]) <= reach &&
          distance_to_segment(gap.corners[1], known.corners[0], known.corners[1]) <= reach)
        return true;
    }
    return false;
  }

  /// Do lines through the gap join the outside with a surface, and cross no aperture on the way out?
  bool leaks(const Gap& gap) const {
    const glm::dvec3 along = gap.corners[1] - gap.corners[0];
    const glm::dvec3 normal = glm::cross(along, gap.corners[3] - gap.corners[0]);
    if (!(glm::length(normal) > 0.0))
      return false;
    const auto frame = detail::PlaneFrame::make(gap.corners[0], glm::normalize(normal));
    int count = 0;
    for (int i = 0; i < kLines && count < kFewestLeaks; ++i) {
      // Kronecker sequence of the plastic numbers (Roberts 2018), directions by the cosine.
      const auto part = [i](double g) { return std::fmod(0.5 + g * (i + 1), 1.0); };
      const double s = part(0.8566748838545029), t = part(0.733891856627126), u = part(0.6287067210378087),
                   angle = 2.0 * std::numbers::pi * part(0.5385972572236101);
      const glm::dvec3 edge = gap.corners[0] + s * along;
      const glm::dvec3 q = edge + t * glm::mix(gap.corners[3] - gap.corners[0], gap.corners[2] - gap.corners[1], s);
      const glm::dvec3 d =
          std::sqrt(u) * (std::cos(angle) * frame.u + std::sin(angle) * frame.v) + std::sqrt(1.0 - u) * frame.n;
      count += in_air(edge, q) && lets_in(q, d) ? 1 : 0;
    }
    return count >= kFewestLeaks;
  }

  /// The other surface is not flat: beyond it there is no gap.
  bool in_air(const glm::dvec3& edge, const glm::dvec3& q) const {
    const glm::dvec3 way = q - edge;
    return !all_.occluded(all_.to_local(edge + 0.01 * way), glm::vec3(0.99 * way), 0.0f, 1.0f);
  }

  bool lets_in(const glm::dvec3& q, const glm::dvec3& d) const {
    const glm::vec3 from = reflecting_.to_local(q);
    const bool forth = reflecting_.occluded(from, glm::vec3(d), 0.0f, kFar);
    const bool back = reflecting_.occluded(from, -glm::vec3(d), 0.0f, kFar);
    if (forth == back)
      return false;
    int crossed = 0;
    aperture_transmittance(apertures_, q, forth ? -d : d, std::numeric_limits<double>::infinity(), &crossed);
    return crossed == 0;
  }

  const Room& room_;
  const std::vector<Aperture>& apertures_;
  const double joined_m_, widest_m_;
  const RayScene &all_, &reflecting_;
};

} // namespace

Result<Gaps> find_gaps(const Room& room, const std::vector<Aperture>& apertures, double widest_m) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const RoomTriangle& t : room.triangles)
    triangles.push_back(t.vertex);
  const auto all = RayScene::build(room.vertices, triangles);
  if (!all)
    return all.error();
  const auto reflecting = RayScene::build(room);
  if (!reflecting)
    return reflecting.error();
  return GapFinder(room, apertures, widest_m, *all, *reflecting).run();
}

void close_gaps(Room& room, const Gaps& gaps) {
  for (const Gap& gap : gaps.list) {
    const auto first = static_cast<std::uint32_t>(room.vertices.size());
    room.vertices.insert(room.vertices.end(), gap.corners.begin(), gap.corners.end());
    room.triangles.push_back({{first, first + 1, first + 2}, gap.material});
    room.triangles.push_back({{first, first + 2, first + 3}, gap.material});
  }
}

} // namespace daylit
