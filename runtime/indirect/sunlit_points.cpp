#include "runtime/indirect/sunlit_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/room/aperture.h"

namespace daylit {

namespace {

constexpr std::size_t kMost = 128; // away from objects
constexpr double kLeast = 0.5;     // between points, of the radius of the smallest object
constexpr int kMostCuts = 6;       // of a cell
constexpr float kFar = std::numeric_limits<float>::infinity();

/// Of the area A cos that the sun sees on a surface with cosine `there`: its root.
double spacing(double area_m2, double there) { return std::sqrt(area_m2 / std::max(there, 0.05)); }

/// Where the sun through the middle of a cell would meet the room.
struct Landing {
  SunlitPoint point;
  bool met = false, lit = false;
};

class SunThroughCells {
public:
  SunThroughCells(const Room& room, const RayScene& rays, const RoomPlanes& planes, std::span<const Aperture> apertures,
                  const DetectedSun& sun, const PlacedParts& parts)
      : room_(room), rays_(rays), planes_(planes), panes_(apertures.begin(), apertures.end()), sun_(sun),
        parts_(parts) {}

  Landing land(const ApertureCell& cell) const;
  /// Points that are `spacing_m` apart are too far apart there.
  bool is_wide(const Landing& at, double spacing_m) const;
  void cut(const ApertureCell& cell, int cuts, std::vector<SunlitPoint>& points) const;

private:
  const Room& room_;
  const RayScene& rays_;
  const RoomPlanes& planes_;
  std::vector<Aperture> panes_;
  const DetectedSun& sun_;
  const PlacedParts& parts_;
};

/// Power = rho tau E_normal A cos of the cell, divided by the windows in series, each of which has a cell for it.
Landing SunThroughCells::land(const ApertureCell& cell) const {
  Landing landing;
  const double cosine = -glm::dot(cell.inward, sun_.direction);
  RayHit hit;
  const glm::vec3 from = rays_.to_local(cell.centre), down(-sun_.direction);
  landing.met = cosine > 0.0 && rays_.closest(from, down, 0.0f, kFar, hit);
  if (!landing.met)
    return landing;
  const glm::dvec3& n = planes_[planes_.facing_of(hit.triangle, -sun_.direction)].normal;
  const glm::dvec3 x = cell.centre - static_cast<double>(hit.distance) * sun_.direction + kAirGap_m * n;
  landing.point = {x, n, Rgb(0.0f), spacing(cosine * cell.area_m2, glm::dot(n, sun_.direction))};
  int crossed = 0;
  if (rays_.occluded(from, -down, 0.0f, kFar))
    return landing;
  const Rgb pane = aperture_transmittance(panes_, x, sun_.direction, std::numeric_limits<double>::infinity(), &crossed);
  landing.lit = crossed > 0;
  if (landing.lit)
    landing.point.power = static_cast<float>(cosine * cell.area_m2 / crossed) * pane * sun_.normal_irradiance *
                          room_.material(room_.triangles[hit.triangle]).reflectance;
  return landing;
}

/// Wider than its distance from the nearest object, of which it may be half a spacing nearer.
bool SunThroughCells::is_wide(const Landing& at, double spacing_m) const {
  if (!at.met || parts_.size() == 0 || spacing_m <= kLeast * parts_.smallest_radius())
    return false;
  const double within = 1.5 * spacing_m;
  return parts_.distance(at.point.position, within) < within;
}

void SunThroughCells::cut(const ApertureCell& cell, int cuts, std::vector<SunlitPoint>& points) const {
  for (const ApertureCell& part : quarters(cell))
    if (const Landing landing = land(part); cuts > 1 && is_wide(landing, landing.point.spacing_m))
      cut(part, cuts - 1, points);
    else if (landing.lit)
      points.push_back(landing.point);
}

} // namespace

std::vector<SunlitPoint> sunlit_points(const Room& room, const RayScene& rays, const RoomPlanes& planes,
                                       std::span<const Aperture> apertures, std::span<const ApertureCell> cells,
                                       const DetectedSun& sun, const PlacedParts& parts) {
  const SunThroughCells through(room, rays, planes, apertures, sun, parts);
  std::vector<Landing> landings;
  for (const ApertureCell& cell : cells)
    landings.push_back(through.land(cell));
  const auto lit = static_cast<std::size_t>(std::ranges::count_if(landings, &Landing::lit));
  const std::size_t step = (lit + kMost - 1) / kMost;
  const double wider = std::sqrt(static_cast<double>(step));
  std::vector<SunlitPoint> points, far;
  for (std::size_t k = 0; k < cells.size(); ++k)
    if (through.is_wide(landings[k], wider * landings[k].point.spacing_m))
      through.cut(cells[k], kMostCuts, points);
    else if (landings[k].lit)
      far.push_back(landings[k].point);
  for (std::size_t k = 0; k < far.size(); k += step) {
    points.push_back(far[k]);
    points.back().power *= static_cast<float>(std::min(step, far.size() - k));
    points.back().spacing_m *= wider;
  }
  return points;
}

} // namespace daylit
