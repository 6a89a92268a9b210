#include "radiosity/detail/plane_mesher.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <glm/geometric.hpp>

#include "radiosity/detail/cover_grid.h"

namespace daylit::radiosity {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Structure = CGAL::Triangulation_data_structure_2<CGAL::Triangulation_vertex_base_2<Kernel>,
                                                       CGAL::Constrained_triangulation_face_base_2<Kernel>>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::Exact_predicates_tag>;
using Point = Kernel::Point_2;
using Face = Triangulation::Face_handle;
using Vertex = Triangulation::Vertex_handle;

// Circumradius over shortest edge, 1 / (2 sin 20.7 degrees): the bound for which Ruppert's refinement is proved to end.
constexpr double kShapeBound = 1.4142;
// Part of the longest allowed edge below which no shape is improved and no new vertex comes near another.
constexpr double kFineShare = 0.1;
constexpr double kFlatTolerance = 1e-9; // height over longest side of a triangle that rounding made
constexpr int kOutlinePasses = 4;
constexpr int kSamples = 8; // of the edge length along a segment

Point to_point(const glm::dvec2& p) { return {p.x, p.y}; }
glm::dvec2 to_vec(const Point& p) { return {p.x(), p.y()}; }

std::array<glm::dvec2, 3> corners(const Face& f) {
  return {to_vec(f->vertex(0)->point()), to_vec(f->vertex(1)->point()), to_vec(f->vertex(2)->point())};
}

glm::dvec2 centroid(const Face& f) {
  const auto [a, b, c] = corners(f);
  return (a + b + c) / 3.0;
}

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// Three points of one line after rounding: the midpoint of a slanted border segment is never quite on it.
bool is_flat(const std::array<glm::dvec2, 3>& t) {
  double longest2 = 0;
  for (int k = 0; k < 3; ++k)
    longest2 = std::max(longest2, glm::dot(t[(k + 1) % 3] - t[k], t[(k + 1) % 3] - t[k]));
  return std::abs(cross(t[1] - t[0], t[2] - t[0])) <= kFlatTolerance * longest2;
}

std::optional<glm::dvec2> circumcentre(const std::array<glm::dvec2, 3>& t) {
  const glm::dvec2 b = t[1] - t[0], c = t[2] - t[0];
  const double d = 2.0 * cross(b, c), bb = glm::dot(b, b), cc = glm::dot(c, c);
  const glm::dvec2 r = glm::dvec2(c.y * bb - b.y * cc, b.x * cc - c.x * bb) / d;
  if (!std::isfinite(r.x) || !std::isfinite(r.y))
    return std::nullopt;
  return t[0] + r;
}

/// CGAL lists edges in the order of addresses: the same segments must give the same mesh in every run.
std::vector<Segment2> in_order(std::vector<Segment2> segments) {
  const auto key = [](const glm::dvec2& p) { return std::pair(p.x, p.y); };
  for (Segment2& s : segments)
    if (key(s[1]) < key(s[0]))
      std::swap(s[0], s[1]);
  std::ranges::sort(segments, {}, [&](const Segment2& s) { return std::pair(key(s[0]), key(s[1])); });
  return segments;
}

/// Constraints of a triangulation as segments, crossings resolved.
std::vector<Segment2> constraints(const std::vector<Segment2>& segments) {
  Triangulation cdt;
  for (const Segment2& s : segments)
    cdt.insert_constraint(to_point(s[0]), to_point(s[1]));
  std::vector<Segment2> result;
  for (auto e = cdt.finite_edges_begin(); e != cdt.finite_edges_end(); ++e)
    if (cdt.is_constrained(*e))
      result.push_back({to_vec(e->first->vertex(cdt.cw(e->second))->point()),
                        to_vec(e->first->vertex(cdt.ccw(e->second))->point())});
  return in_order(std::move(result));
}

/// The surface of a group: its triangles without what another group covers.
class Cover {
public:
  explicit Cover(const PlaneGroup& g) : own_(g.triangles), covered_(g.covered) {}
  bool covers(const glm::dvec2& p) const { return own_.covers(p) && !covered_.covers(p); }

private:
  CoverGrid own_, covered_;
};

std::vector<Segment2> border(const PlaneGroup& g, double tolerance_m) {
  const CoverGrid cover(g.triangles);
  std::vector<Segment2> sides;
  for (const auto& t : g.triangles)
    for (int k = 0; k < 3; ++k)
      sides.push_back({t[k], t[(k + 1) % 3]});
  Triangulation cdt;
  for (const Segment2& s : snap_segments(sides, tolerance_m))
    cdt.insert_constraint(to_point(s[0]), to_point(s[1]));
  if (cdt.dimension() < 2) // narrower than the tolerance: nothing to cover
    return {};
  const auto filled = [&](const Face& f) { return !cdt.is_infinite(f) && cover.covers(centroid(f)); };
  std::vector<Segment2> result;
  for (auto e = cdt.finite_edges_begin(); e != cdt.finite_edges_end(); ++e)
    if (cdt.is_constrained(*e) && filled(e->first) != filled(e->first->neighbor(e->second)))
      result.push_back({to_vec(e->first->vertex(cdt.cw(e->second))->point()),
                        to_vec(e->first->vertex(cdt.ccw(e->second))->point())});
  return in_order(std::move(result));
}

class Refiner {
public:
  Refiner(const PlaneGroup& group, const std::vector<Segment2>& outline, const EdgeLength2& edge_m)
      : cover_(group), edge_m_(edge_m) {
    for (const Segment2& s : outline)
      insert_in_pieces(s);
  }

  /// Worst triangles first, until none can be improved.
  void refine(std::size_t limit) {
    for (bool changed = true; changed;) {
      changed = false;
      for (const Bad& bad : worst_first()) {
        Face f;
        if (cdt_.is_face(bad.vertex[0], bad.vertex[1], bad.vertex[2], f))
          changed = improve(f) || changed;
        if (cdt_.number_of_faces() > limit)
          return;
      }
    }
  }

  std::vector<Triangle2> triangles() const {
    std::vector<Triangle2> result;
    for (auto f = cdt_.finite_faces_begin(); f != cdt_.finite_faces_end(); ++f)
      if (!is_flat(corners(f)) && cover_.covers(centroid(f)))
        result.push_back(corners(f));
    return result;
  }

private:
  struct Bad {
    double badness;
    std::array<Vertex, 3> vertex;
  };

  /// As many as the shortest edge allowed along the segment asks for.
  void insert_in_pieces(const Segment2& s) {
    double edge_m = edge_m_(s[0]);
    for (int k = 1; k <= kSamples; ++k)
      edge_m = std::min(edge_m, edge_m_(glm::mix(s[0], s[1], double(k) / kSamples)));
    const int pieces = std::max(1, static_cast<int>(std::ceil(glm::distance(s[0], s[1]) / edge_m - 1e-9)));
    Vertex last = cdt_.insert(to_point(s[0]));
    for (int k = 1; k <= pieces; ++k) {
      const Vertex next = cdt_.insert(to_point(k == pieces ? s[1] : glm::mix(s[0], s[1], double(k) / pieces)));
      if (next != last)
        cdt_.insert_constraint(last, next);
      last = next;
    }
  }

  /// Above 1: too long, or too flat and large enough to be improved.
  double badness(const std::array<glm::dvec2, 3>& t) const {
    std::array<double, 3> side{};
    for (int k = 0; k < 3; ++k)
      side[k] = glm::distance(t[(k + 1) % 3], t[(k + 2) % 3]);
    const auto [shortest, longest] = std::ranges::minmax(side);
    const double edge_m = edge_m_((t[0] + t[1] + t[2]) / 3.0), too_long = longest / (edge_m * (1.0 + 1e-9));
    if (is_flat(t))
      return 0.0;
    if (too_long > 1.0)
      return 1.0 + too_long;
    const double area2 = std::abs(cross(t[1] - t[0], t[2] - t[0]));
    const double circumradius = side[0] * side[1] * side[2] / (2.0 * area2);
    return shortest < kFineShare * edge_m ? 0.0 : circumradius / (shortest * kShapeBound);
  }

  std::vector<Bad> worst_first() const {
    std::vector<Bad> bad;
    for (auto f = cdt_.finite_faces_begin(); f != cdt_.finite_faces_end(); ++f) {
      const double value = badness(corners(f));
      if (value > 1.0 && cover_.covers(centroid(f)))
        bad.push_back({value, {f->vertex(0), f->vertex(1), f->vertex(2)}});
    }
    std::ranges::stable_sort(bad, std::greater<>{}, &Bad::badness);
    return bad;
  }

  bool improve(const Face& f) {
    const auto t = corners(f);
    const std::optional<glm::dvec2> centre = circumcentre(t);
    if (!centre)
      return split_longest(f);
    // Straight to the circumcentre; a constrained edge in the way, or one that it would come too near, is split.
    Face at = f;
    const glm::dvec2 from = centroid(f), way = *centre - from;
    int entered = -1;
    for (std::size_t step = 0; step < cdt_.number_of_faces(); ++step) {
      const int exit = exit_edge(at, entered, from, way);
      if (exit < 0)
        break;
      if (at->is_constrained(exit))
        return split(at, exit) || split_longest(f);
      const Face next = at->neighbor(exit);
      if (cdt_.is_infinite(next))
        return split_longest(f);
      entered = next->index(at);
      at = next;
    }
    for (int k = 0; k < 3; ++k)
      if (at->is_constrained(k) && encroaches(*centre, at, k))
        return split(at, k) || split_longest(f);
    Triangulation::Locate_type where;
    int index = 0;
    const Face home = cdt_.locate(to_point(*centre), where, index, at);
    const bool in_air = where == Triangulation::FACE || (where == Triangulation::EDGE && !home->is_constrained(index));
    if (!in_air || cdt_.is_infinite(home) || !far_from_corners(*centre, home))
      return split_longest(f);
    cdt_.insert(to_point(*centre), where, home, index);
    return true;
  }

  /// Edge of `at` through which the way leaves before its end; -1: it ends here.
  static int exit_edge(const Face& at, int entered, const glm::dvec2& from, const glm::dvec2& way) {
    const auto t = corners(at);
    for (int k = 0; k < 3; ++k) {
      const glm::dvec2 &a = t[(k + 1) % 3], &b = t[(k + 2) % 3];
      if (k != entered && cross(b - a, from + way - a) < 0.0 && cross(way, a - from) <= 0.0 &&
          cross(way, b - from) >= 0.0)
        return k;
    }
    return -1;
  }

  static bool encroaches(const glm::dvec2& p, const Face& f, int k) {
    const auto t = corners(f);
    return glm::dot(t[(k + 1) % 3] - p, t[(k + 2) % 3] - p) < 0.0;
  }

  bool far_from_corners(const glm::dvec2& p, const Face& f) const {
    const double fine_m = kFineShare * edge_m_(p);
    return std::ranges::all_of(corners(f), [&](const glm::dvec2& c) { return glm::distance(c, p) >= fine_m; });
  }

  /// Splits an edge in the middle unless vertices would crowd there.
  bool split(const Face& f, int k) {
    const auto t = corners(f);
    const glm::dvec2 middle = 0.5 * (t[(k + 1) % 3] + t[(k + 2) % 3]);
    const Face n = f->neighbor(k);
    const bool near = !far_from_corners(middle, f) || (!cdt_.is_infinite(n) && !far_from_corners(middle, n));
    if (near)
      return false;
    cdt_.insert(to_point(middle), Triangulation::EDGE, f, k);
    return true;
  }

  bool split_longest(const Face& f) {
    const auto t = corners(f);
    int longest = 0;
    for (int k = 1; k < 3; ++k)
      if (glm::distance(t[(k + 1) % 3], t[(k + 2) % 3]) > glm::distance(t[(longest + 1) % 3], t[(longest + 2) % 3]))
        longest = k;
    return split(f, longest);
  }

  Triangulation cdt_;
  Cover cover_;
  const EdgeLength2& edge_m_;
};

} // namespace

std::vector<Segment2> find_outline(const PlaneGroup& g, double tolerance_m) {
  const Cover cover(g);
  std::vector<Segment2> outline = border(g, tolerance_m);
  outline.insert(outline.end(), g.contacts.begin(), g.contacts.end());
  outline = snap_segments(outline, tolerance_m);
  // Crossings add points, and points may lie close to other lines: both until nothing is new.
  for (int pass = 0; pass < kOutlinePasses; ++pass) {
    std::vector<Segment2> next = snap_segments(constraints(outline), tolerance_m);
    const bool same = next.size() == outline.size();
    outline = std::move(next);
    if (same)
      break;
  }
  const auto outside = [&](const Segment2& s) {
    // A little to either side of the middle.
    const glm::dvec2 middle = 0.5 * (s[0] + s[1]), along = s[1] - s[0];
    const glm::dvec2 beside = 2.0 * tolerance_m * glm::dvec2(-along.y, along.x) / glm::length(along);
    return !cover.covers(middle) && !cover.covers(middle + beside) && !cover.covers(middle - beside);
  };
  std::erase_if(outline, outside);
  return outline;
}

std::vector<Triangle2> mesh_plane(const PlaneGroup& group, const std::vector<Segment2>& outline,
                                  const EdgeLength2& edge_m, std::size_t limit) {
  Refiner refiner(group, outline, edge_m);
  refiner.refine(limit);
  return refiner.triangles();
}

} // namespace daylit::radiosity
