#include "radiosity/detail/open_paths.h"

#include <algorithm>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

constexpr std::size_t kMostSheets = 2000; // with more, rays are cheaper than looking at every plane
constexpr double kTolerance = 1e-7;       // of the room's size

} // namespace

void OpenPaths::Box::include(const glm::dvec3& p) {
  lo = glm::min(lo, p);
  hi = glm::max(hi, p);
}

OpenPaths::OpenPaths(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures,
                     const std::vector<AperturePart>& parts)
    : parts_(parts) {
  add_sheets(mesh, apertures);
  glm::dvec3 size(0.0);
  for (const Sheet& s : sheets_)
    size = glm::max(size, glm::max(glm::abs(s.box.lo), glm::abs(s.box.hi)));
  tolerance_m_ = kTolerance * glm::length(size);
  for (const AperturePart& part : parts) {
    const auto outside = [&](const glm::dvec3& p) { return glm::dot(p - part.corner[0], part.inward) < -tolerance_m_; };
    const bool facet =
        std::ranges::any_of(mesh.facets, [&](const Facet& p) { return std::ranges::any_of(p.corner, outside); });
    const bool pane = std::ranges::any_of(apertures, [&](const Aperture& a) {
      return std::ranges::any_of(a.corners, [&](const glm::dvec3& c) { return outside(c - mesh.origin); });
    });
    open_outside_.push_back(!facet && !pane);
  }
}

void OpenPaths::add_sheets(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures) {
  const Box nothing{glm::dvec3(std::numeric_limits<double>::infinity()),
                    glm::dvec3(-std::numeric_limits<double>::infinity())};
  sheets_.assign(mesh.planes, {glm::dvec3(0.0), glm::dvec3(0.0), nothing});
  for (const Facet& p : mesh.facets) {
    Sheet& s = sheets_[p.plane];
    s.point = p.corner[0];
    s.normal = p.normal;
    for (const glm::dvec3& c : p.corner)
      s.box.include(c);
  }
  std::erase_if(sheets_, [](const Sheet& s) { return s.box.lo.x > s.box.hi.x; }); // planes of slivers have no facet
  first_opening_ = sheets_.size();
  for (const Aperture& a : apertures) {
    sheets_.push_back({a.corners[0] - mesh.origin, a.inward, nothing});
    for (const glm::dvec3& c : a.corners)
      sheets_.back().box.include(c - mesh.origin);
  }
}

/// The hull lies on one side of the sheet's plane, or away from the sheet's box.
bool OpenPaths::parted(const Sheet& sheet, const Patch& e, const std::vector<glm::dvec3>& front,
                       const Box& hull) const {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto add = [&](const glm::dvec3& p) {
    const double h = glm::dot(p - sheet.point, sheet.normal);
    low = std::min(low, h);
    high = std::max(high, h);
  };
  std::ranges::for_each(e.corner, add);
  std::ranges::for_each(front, add);
  if (low >= -tolerance_m_ || high <= tolerance_m_)
    return true;
  for (int k = 0; k < 3; ++k)
    if (hull.hi[k] <= sheet.box.lo[k] + tolerance_m_ || hull.lo[k] >= sheet.box.hi[k] - tolerance_m_)
      return true;
  return false;
}

/// No sheet but the opening itself cuts the hull of patch and opening: a separating plane or axis for each.
bool OpenPaths::clear(const Patch& e, std::size_t index, const std::vector<glm::dvec3>& front) const {
  if (!open_outside_[index] || sheets_.size() > kMostSheets)
    return false;
  Box hull{e.corner[0], e.corner[0]};
  for (const glm::dvec3& c : e.corner)
    hull.include(c);
  for (const glm::dvec3& c : front)
    hull.include(c);
  for (std::size_t s = 0; s < sheets_.size(); ++s)
    if (s != first_opening_ + parts_[index].aperture && !parted(sheets_[s], e, front, hull))
      return false;
  return true;
}

} // namespace daylit::radiosity
