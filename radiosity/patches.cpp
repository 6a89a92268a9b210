#include "radiosity/patches.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_mesh_face_base_2.h>
#include <CGAL/Delaunay_mesh_size_criteria_2.h>
#include <CGAL/Delaunay_mesh_vertex_base_2.h>
#include <CGAL/Delaunay_mesher_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <glm/geometric.hpp>

#include "radiosity/detail/plane_groups.h"
#include "radiosity/detail/snap_segments.h"

namespace daylit::radiosity {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Delaunay_mesh_vertex_base_2<Kernel>;
using FaceBase = CGAL::Delaunay_mesh_face_base_2<Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::Exact_predicates_tag>;
using Criteria = CGAL::Delaunay_mesh_size_criteria_2<Triangulation>;
using Mesher = CGAL::Delaunay_mesher_2<Triangulation, Criteria>;
using Point = Kernel::Point_2;

// sin^2 of the smallest angle: 20.7 degrees, the bound for which Ruppert's refinement is proved to end.
constexpr double kShapeBound = 0.125;
// End points closer than this share of the room are one point: above coordinate rounding, below any real feature.
constexpr double kSnapTolerance = 1e-6;

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// On or in the triangle. A point on the seam of two triangles must be in one of them whatever the rounding.
bool inside(const std::array<glm::dvec2, 3>& t, const glm::dvec2& p) {
  const double s0 = cross(t[1] - t[0], p - t[0]), s1 = cross(t[2] - t[1], p - t[1]), s2 = cross(t[0] - t[2], p - t[2]);
  const double slack = 1e-9 * (std::abs(s0) + std::abs(s1) + std::abs(s2));
  return (s0 >= -slack && s1 >= -slack && s2 >= -slack) || (s0 <= slack && s1 <= slack && s2 <= slack);
}

glm::dvec2 centroid(const Triangulation::Face_handle& f) {
  glm::dvec2 sum(0.0);
  for (int k = 0; k < 3; ++k)
    sum += glm::dvec2(CGAL::to_double(f->vertex(k)->point().x()), CGAL::to_double(f->vertex(k)->point().y()));
  return sum / 3.0;
}

Point to_point(const glm::dvec2& p) { return {p.x, p.y}; }
glm::dvec2 to_vec(const Point& p) { return {p.x(), p.y()}; }

bool covered(const PlaneGroup& g, const glm::dvec2& p) {
  return std::ranges::any_of(g.triangles, [&](const auto& t) { return inside(t, p); });
}

/// Outline of the union of the group's triangles, overlaps and T-junctions resolved, plus the contact lines.
std::vector<Segment2> find_outline(const PlaneGroup& g, double tolerance_m) {
  std::vector<Segment2> sides;
  for (const auto& t : g.triangles)
    for (int k = 0; k < 3; ++k)
      sides.push_back({t[k], t[(k + 1) % 3]});
  Triangulation cdt;
  for (const Segment2& s : snap_segments(sides, tolerance_m))
    cdt.insert_constraint(to_point(s[0]), to_point(s[1]));
  std::map<Triangulation::Face_handle, bool> filled;
  for (auto f = cdt.finite_faces_begin(); f != cdt.finite_faces_end(); ++f)
    filled[f] = covered(g, centroid(f));

  std::vector<Segment2> outline;
  for (auto e = cdt.finite_edges_begin(); e != cdt.finite_edges_end(); ++e) {
    const auto f = e->first, n = f->neighbor(e->second);
    const bool a = !cdt.is_infinite(f) && filled[f], b = !cdt.is_infinite(n) && filled[n];
    if (a != b)
      outline.push_back(
          {to_vec(f->vertex(cdt.cw(e->second))->point()), to_vec(f->vertex(cdt.ccw(e->second))->point())});
  }
  outline.insert(outline.end(), g.contacts.begin(), g.contacts.end());
  outline = snap_segments(outline, tolerance_m);
  return outline;
}

/// CGAL refines everything that no seed point excludes: one seed in every triangle that the group does not cover.
void refine(Triangulation& cdt, const PlaneGroup& g, double edge_m) {
  std::vector<Point> seeds;
  for (auto f = cdt.finite_faces_begin(); f != cdt.finite_faces_end(); ++f)
    if (!covered(g, centroid(f)))
      seeds.push_back(to_point(centroid(f)));
  Mesher mesher(cdt, Criteria(kShapeBound, edge_m));
  mesher.set_seeds(seeds.begin(), seeds.end(), false);
  mesher.refine_mesh();
}

void append_patches(const Triangulation& cdt, const PlaneGroup& g, std::uint32_t plane, std::vector<Patch>& out) {
  for (auto f = cdt.finite_faces_begin(); f != cdt.finite_faces_end(); ++f) {
    if (!f->is_in_domain())
      continue;
    Patch p;
    for (int k = 0; k < 3; ++k)
      p.corner[k] = g.lift(to_vec(f->vertex(k)->point()));
    p.normal = g.normal;
    p.area_m2 = 0.5 * glm::length(glm::cross(p.corner[1] - p.corner[0], p.corner[2] - p.corner[0]));
    p.plane = plane;
    p.material = g.material;
    if (p.area_m2 > 0.0)
      out.push_back(p);
  }
}

std::vector<Patch> mesh_groups(const std::vector<PlaneGroup>& groups,
                               const std::vector<std::vector<Segment2>>& outlines, double edge_m) {
  std::vector<Patch> patches;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    Triangulation cdt;
    for (const Segment2& s : outlines[i])
      cdt.insert_constraint(to_point(s[0]), to_point(s[1]));
    refine(cdt, groups[i], edge_m);
    append_patches(cdt, groups[i], static_cast<std::uint32_t>(i), patches);
  }
  return patches;
}

/// Interleaves the low ten bits of three numbers.
std::uint32_t morton_code(const glm::dvec3& unit) {
  std::uint32_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::uint32_t>(std::clamp(unit[axis], 0.0, 1.0) * 1023.0);
    for (int bit = 0; bit < 10; ++bit)
      code |= (cell >> bit & 1u) << (3 * bit + axis);
  }
  return code;
}

/// Neighbours in space become neighbours in number: blocks of patches are compact, which visibility tests use.
void sort_by_place(std::vector<Patch>& patches, const glm::dvec3& half_size) {
  const double extent = 2.0 * std::max({half_size.x, half_size.y, half_size.z});
  const auto key = [&](const Patch& p) {
    const glm::dvec3 middle = (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0;
    return std::pair(p.plane, morton_code(middle / extent + 0.5));
  };
  std::ranges::stable_sort(patches, {}, key);
}

double total_area(const std::vector<PlaneGroup>& groups) {
  double sum = 0;
  for (const PlaneGroup& g : groups)
    for (const auto& t : g.triangles)
      sum += 0.5 * std::abs(cross(t[1] - t[0], t[2] - t[0]));
  return sum;
}

} // namespace

Result<PatchMesh> mesh_patches(const Room& room, const PatchOptions& options) {
  PatchMesh mesh;
  mesh.origin = room.bounds().centre();
  const std::vector<PlaneGroup> groups = group_planes(room, mesh.origin);
  if (groups.empty())
    return Error{ErrorCode::geometry_invalid, "the room has no reflecting face", "room",
                 "give the walls a material whose name does not start with window"};
  const glm::dvec3 size = room.bounds().size();
  const double tolerance_m = kSnapTolerance * std::max({size.x, size.y, size.z});
  std::vector<std::vector<Segment2>> outlines;
  outlines.reserve(groups.size());
  for (const PlaneGroup& g : groups)
    outlines.push_back(find_outline(g, tolerance_m));
  mesh.planes = static_cast<std::uint32_t>(groups.size());

  // A refined mesh has edges of about 0.7 of the bound; two or three corrections bring the count within 5 %.
  mesh.edge_m = options.edge_m > 0 ? options.edge_m : std::sqrt(4.5 * total_area(groups) / options.target_patches);
  for (int attempt = 0; attempt < 6; ++attempt) {
    if (total_area(groups) / (0.5 * mesh.edge_m * mesh.edge_m) > options.max_patches)
      return Error{ErrorCode::limit_exceeded, "more patches than the limit", "patch size", "use a larger --patch-size"};
    mesh.patches = mesh_groups(groups, outlines, mesh.edge_m);
    const double ratio = static_cast<double>(mesh.patches.size()) / options.target_patches;
    if (options.edge_m > 0 || (ratio > 0.95 && ratio < 1.05))
      break;
    mesh.edge_m *= std::pow(ratio, ratio > 1.0 ? 0.6 : 0.45);
  }
  sort_by_place(mesh.patches, 0.5 * size);
  return mesh;
}

} // namespace daylit::radiosity
