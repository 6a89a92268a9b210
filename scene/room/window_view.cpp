#include "scene/room/window_view.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/room/aperture.h"
#include "scene/room/cone.h"

namespace daylit {

namespace {

using detail::Cone;

constexpr double kLeave_m = 1e-4;         // the element stands this far above its surface
constexpr std::size_t kTrianglesCut = 12; // as many are cut away one by one
constexpr double kDecidedByRay_sr = 1e-7; // of the hemisphere's 2 pi
constexpr int kDeepest = 48;              // halvings

/// Two halves, across the longest side.
std::pair<Cone, Cone> halves(const Cone& cone) {
  std::size_t longest = 0;
  double least = 2.0;
  for (std::size_t k = 0; k < cone.size(); ++k)
    if (const double cosine = glm::dot(cone[k], cone[(k + 1) % cone.size()]); cosine < least) {
      least = cosine;
      longest = k;
    }
  const glm::dvec3 middle = glm::normalize(cone[longest] + cone[(longest + 1) % cone.size()]);
  // The cut goes from the middle of that side through the middle of the cone.
  const glm::dvec3 plane = glm::cross(middle, detail::centroid(cone));
  return {detail::clipped(cone, plane), detail::clipped(cone, -plane)};
}

struct Triangle {
  std::array<glm::dvec3, 3> corner;
  int depth = 0;
};

std::array<Triangle, 2> halves(const Triangle& triangle) {
  const auto& t = triangle.corner;
  const double ab = glm::dot(t[0], t[1]), bc = glm::dot(t[1], t[2]), ca = glm::dot(t[2], t[0]);
  const std::size_t first = ab <= bc && ab <= ca ? 0 : bc <= ca ? 1 : 2;
  const glm::dvec3 &a = t[first], &b = t[(first + 1) % 3], &c = t[(first + 2) % 3];
  const glm::dvec3 middle = glm::normalize(a + b);
  return {Triangle{{a, middle, c}, triangle.depth + 1}, Triangle{{middle, b, c}, triangle.depth + 1}};
}

} // namespace

struct WindowView::Work {
  std::vector<Cone> open, next; ///< visible so far
  std::vector<SkyCell> cells;
  int depth = 0;
};

WindowView::WindowView(const Room& room, const std::vector<Aperture>& apertures, const RayScene& scene,
                       const glm::dvec3& point, const glm::dvec3& unit_normal)
    : apertures_(apertures), scene_(scene), normal_(unit_normal) {
  eye_ = point + std::max(kLeave_m, 4.0 * static_cast<double>(scene.surface_offset())) * unit_normal;
  for (const Aperture& a : apertures_)
    aperture_.push_back(detail::cone_of(a.corners, eye_));
  see_triangles(room);
}

/// Triangles with a corner above the plane of the surface, and whose cone overlaps that of an aperture.
void WindowView::see_triangles(const Room& room) {
  for (const RoomTriangle& t : room.triangles) {
    if (room.is_window(t))
      continue;
    const std::vector<glm::dvec3> corners{room.corner(t, 0), room.corner(t, 1), room.corner(t, 2)};
    if (std::none_of(corners.begin(), corners.end(),
                     [&](const glm::dvec3& c) { return glm::dot(c - eye_, normal_) > 0.0; }))
      continue;
    Cone cone = detail::cone_of(corners, eye_);
    const bool hides = !cone.empty() && std::any_of(aperture_.begin(), aperture_.end(), [&](const Cone& a) {
      return !a.empty() && detail::may_overlap(a, cone);
    });
    if (hides)
      hiding_.push_back(std::move(cone));
  }
}

/// Visible part of a cone: what remains after the cones of the triangles are subtracted. Where many overlap, the cone
/// is halved first; below 1e-7 sr one ray to its middle decides.
void WindowView::cut_by_triangles(Cone cone, std::vector<std::uint32_t> triangles, Work& work) const {
  std::erase_if(triangles, [&](std::uint32_t t) { return !detail::may_overlap(cone, hiding_[t]); });
  for (const std::uint32_t t : triangles)
    if (detail::contains(hiding_[t], cone))
      return;
  if (triangles.size() <= kTrianglesCut) {
    std::vector<Cone> parts{std::move(cone)}, rest;
    for (const std::uint32_t t : triangles) {
      rest.clear();
      for (const Cone& part : parts)
        detail::subtract(part, hiding_[t], rest);
      parts.swap(rest);
    }
    work.open.insert(work.open.end(), parts.begin(), parts.end());
    return;
  }
  if (detail::solid_angle_sr(cone) < kDecidedByRay_sr || work.depth >= kDeepest) {
    const glm::vec3 d(detail::centroid(cone));
    if (!scene_.occluded(scene_.to_local(eye_), d, 0.0f, std::numeric_limits<float>::infinity()))
      work.open.push_back(std::move(cone));
    return;
  }
  auto [left, right] = halves(cone);
  ++work.depth;
  for (Cone* half : {&left, &right})
    if (!half->empty())
      cut_by_triangles(std::move(*half), triangles, work);
  --work.depth;
}

/// Light counts where it first enters, seen from the point: behind another aperture it is that one's; in front of
/// another one it is cut along its rim, so that the panes on the way are the same for a whole part.
void WindowView::cut_by_apertures(std::size_t aperture, Work& work) const {
  const auto distance = [&](std::size_t k, const glm::dvec3& d) {
    return glm::dot(apertures_[k].corners[0] - eye_, apertures_[k].inward) / glm::dot(d, apertures_[k].inward);
  };
  for (std::size_t k = 0; k < apertures_.size(); ++k) {
    if (k == aperture || aperture_[k].empty())
      continue;
    work.next.clear();
    for (const Cone& part : work.open) {
      if (!detail::may_overlap(part, aperture_[k])) {
        work.next.push_back(part);
        continue;
      }
      Cone both = detail::subtract(part, aperture_[k], work.next);
      if (both.empty())
        continue;
      const glm::dvec3 d = detail::centroid(both);
      const double own = distance(aperture, d), other = distance(k, d);
      // Two apertures at one position: the first of the list counts.
      if (own < other || (own == other && aperture < k))
        work.next.push_back(std::move(both));
    }
    work.open.swap(work.next);
  }
}

/// The part of a cone above the plane of the surface that neither triangles nor nearer apertures hide.
void WindowView::open_part(std::size_t aperture, Cone cone, Work& work) const {
  work.open.clear();
  cone = detail::clipped(cone, normal_);
  if (cone.empty())
    return;
  std::vector<std::uint32_t> all(hiding_.size());
  for (std::size_t t = 0; t < all.size(); ++t)
    all[t] = static_cast<std::uint32_t>(t);
  cut_by_triangles(std::move(cone), std::move(all), work);
  cut_by_apertures(aperture, work);
}

/// weight = transmittance times the vector area of the cell dotted with the normal: cosine-weighted steradians, exact.
void WindowView::add_cell(std::span<const glm::dvec3> cone, Work& work) const {
  const double cosine_sr = glm::dot(detail::vector_area(cone), normal_);
  if (!(cosine_sr > 0.0))
    return; // a sliver of rounding
  const glm::dvec3 d = detail::centroid(cone);
  const Rgb through = aperture_transmittance(apertures_, eye_, d, std::numeric_limits<double>::infinity());
  work.cells.push_back({d, cosine_sr * glm::dvec3(through)});
}

void WindowView::add_cells(const Cone& part, double largest_sr, Work& work) const {
  std::vector<Triangle> stack;
  for (std::size_t k = 1; k + 1 < part.size(); ++k)
    stack.push_back({{part[0], part[k], part[k + 1]}, 0});
  while (!stack.empty()) {
    const Triangle t = stack.back();
    stack.pop_back();
    if (t.depth < kDeepest && detail::solid_angle_sr(t.corner) > largest_sr) {
      const std::array<Triangle, 2> parts = halves(t);
      stack.insert(stack.end(), parts.begin(), parts.end());
    } else {
      add_cell(t.corner, work);
    }
  }
}

/// Each aperture above and below the horizon by itself: skies have an edge there.
std::vector<SkyCell> WindowView::cells(double largest_sr) const {
  Work work;
  for (std::size_t k = 0; k < apertures_.size(); ++k)
    for (const double side : {1.0, -1.0}) {
      open_part(k, detail::clipped(aperture_[k], {0.0, 0.0, side}), work);
      for (const Cone& part : work.open)
        add_cells(part, largest_sr, work);
    }
  return std::move(work.cells);
}

std::vector<SkyCell> WindowView::cells_within(const Cone& cone) const {
  Work work;
  for (std::size_t k = 0; k < apertures_.size(); ++k) {
    if (aperture_[k].empty() || !detail::may_overlap(cone, aperture_[k]))
      continue;
    open_part(k, detail::intersection(cone, aperture_[k]), work);
    for (const Cone& part : work.open)
      add_cell(part, work);
  }
  return std::move(work.cells);
}

} // namespace daylit
