#include "radiosity/detail/aperture_beam.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "radiosity/polygon_kernel.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kMostCorners = 8;   // of a piece
constexpr std::size_t kMostSheets = 2000; // with more, rays are cheaper than asking every plane
constexpr double kTolerance = 1e-7;       // of the room's size
constexpr double kCosineRounding = 1e-6;  // of cosines in single precision
constexpr double kGrazing = 1e-9;         // cosine below which a patch receives nothing

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

#define DAYLIT_VECTOR __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

DAYLIT_VECTOR void products(const glm::vec3& a, const float* x, const float* y, const float* z, std::size_t count,
                            float* out) {
  const float ax = a.x, ay = a.y, az = a.z;
  for (std::size_t k = 0; k < count; ++k)
    out[k] = ax * x[k] + ay * y[k] + az * z[k];
}

} // namespace

std::vector<float> EnteringDirections::cosines(const glm::dvec3& axis) const {
  std::vector<float> result(number.size());
  products(glm::vec3(axis), x.data(), y.data(), z.data(), number.size(), result.data());
  return result;
}

SkySweep::SkySweep(const SkyPartition& partition, const std::vector<AperturePiece>& pieces, int count)
    : sky(SkyDirections::make(partition, count)), entering(pieces.size()) {
  for (std::size_t p = 0; p < pieces.size(); ++p)
    for (std::uint32_t k = 0; k < sky.w.size(); ++k)
      if (glm::dot(sky.w[k], pieces[p].inward) < 0.0) {
        entering[p].x.push_back(static_cast<float>(sky.w[k].x));
        entering[p].y.push_back(static_cast<float>(sky.w[k].y));
        entering[p].z.push_back(static_cast<float>(sky.w[k].z));
        entering[p].number.push_back(k);
      }
}

namespace {

/// k -> k m mod n with m prime to n and near the golden section of it: neighbours become far apart.
std::vector<int> scattered(int n) {
  int m = std::max(1, static_cast<int>(std::lround(n / std::numbers::phi)));
  while (std::gcd(m, n) != 1)
    ++m;
  std::vector<int> order(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k)
    order[static_cast<std::size_t>(k)] = k * m % n;
  return order;
}

} // namespace

SkyDirections SkyDirections::make(const SkyPartition& partition, int count) {
  // Regions of unequal size have directions for each of their cells: equal shares of the sphere, however large the
  // region. A large region with few directions would be off by tens of per cent.
  int cells = 0;
  for (int r = 0; r < partition.size(); ++r)
    cells += partition.extent(r).bands * partition.extent(r).cells;
  const int side = std::max(partition.interpolated() ? 1 : 2,
                            static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count) / cells))));
  const std::vector<int> within = scattered(side);
  const auto at = [&](int i, int j) { return (i + (within[static_cast<std::size_t>(j)] + 0.5) / side) / side; };
  SkyDirections d;
  for (int r = 0; r < partition.size(); ++r) {
    const SkyRectangle e = partition.extent(r);
    for (int cell = 0; cell < e.bands * e.cells; ++cell)
      for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j) {
          d.w.push_back(
              partition.sample(r, (cell % e.cells + at(i, j)) / e.cells, (cell / e.cells + at(j, i)) / e.bands));
          d.region.push_back(r);
          d.solid_angle_sr.push_back(partition.solid_angle_sr(r) / (side * side * e.bands * e.cells));
        }
  }
  return d;
}

std::vector<AperturePiece> aperture_pieces(const std::vector<Aperture>& apertures, const glm::dvec3& origin) {
  std::vector<AperturePiece> pieces;
  for (std::uint32_t a = 0; a < apertures.size(); ++a) {
    const std::vector<glm::dvec3>& c = apertures[a].corners;
    for (std::size_t first = 1; first + 1 < c.size(); first += kMostCorners - 2) {
      AperturePiece piece{{c[0] - origin}, apertures[a].inward, a};
      for (std::size_t k = first; k < std::min(first + kMostCorners - 1, c.size()); ++k)
        piece.corner.push_back(c[k] - origin);
      pieces.push_back(std::move(piece));
    }
  }
  return pieces;
}

ApertureBeam::ApertureBeam(const Patch& e, const AperturePiece& piece)
    : origin_(e.corner[0]), axis_u_(glm::normalize(e.corner[1] - e.corner[0])), axis_v_(glm::cross(e.normal, axis_u_)),
      normal_(e.normal), area_m2_(e.area_m2) {
  for (int k = 0; k < 3; ++k)
    triangle_[k] = {glm::dot(e.corner[k] - origin_, axis_u_), glm::dot(e.corner[k] - origin_, axis_v_)};
  SmallPolygon whole;
  for (const glm::dvec3& c : piece.corner)
    whole.corner[whole.size++] = c;
  const SmallPolygon front = clip_to_front(whole, origin_, normal_);
  const glm::dvec3 centre = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
  glm::dvec3 middle(0.0);
  for (int k = 0; k < front.size; ++k) {
    const glm::dvec3 d = front.corner[k] - origin_;
    corner_.emplace_back(glm::dot(d, axis_u_), glm::dot(d, axis_v_), glm::dot(d, normal_));
    front_.push_back(front.corner[k]);
    middle += front.corner[k] / static_cast<double>(front.size);
  }
  // Light that enters falls on the back of the piece and on the front of the patch: its shadow turns as the piece
  // does, seen from inside, whatever the direction.
  glm::dvec3 turn(0.0);
  for (int k = 1; k + 1 < front.size; ++k)
    turn += glm::cross(front.corner[k] - front.corner[0], front.corner[k + 1] - front.corner[0]);
  if (glm::dot(turn, piece.inward) > 0.0)
    std::ranges::reverse(corner_);
  double radius = 0, reach = 0;
  for (int k = 0; k < front.size; ++k)
    radius = std::max(radius, glm::distance(front.corner[k], middle));
  for (const glm::dvec3& c : e.corner)
    reach = std::max(reach, glm::distance(c, centre));
  // Every way from patch to opening lies in this cone around the way between their middles.
  const double distance = glm::distance(middle, centre), sine = (radius + reach) / std::max(distance, 1e-300);
  axis_ = distance > 0 ? (middle - centre) / distance : glm::dvec3(0.0);
  cos_spread_ = sine < 1.0 ? static_cast<float>(std::sqrt(1.0 - sine * sine) - kCosineRounding) : -2.0f;
}

bool ApertureBeam::covers_patch(const LitPart& shadow) const {
  for (int k = 0; k < shadow.size; ++k) {
    const glm::dvec2 &a = shadow.corner[k], side = shadow.corner[k + 1 < shadow.size ? k + 1 : 0] - a;
    for (const glm::dvec2& t : triangle_)
      if (cross(side, t - a) < 0.0)
        return false;
  }
  return true;
}

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

void OpenPaths::Box::include(const glm::dvec3& p) {
  lo = glm::min(lo, p);
  hi = glm::max(hi, p);
}

OpenPaths::OpenPaths(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures,
                     const std::vector<AperturePiece>& pieces)
    : pieces_(pieces) {
  add_sheets(mesh, apertures);
  glm::dvec3 size(0.0);
  for (const Sheet& s : sheets_)
    size = glm::max(size, glm::max(glm::abs(s.box.lo), glm::abs(s.box.hi)));
  tolerance_m_ = kTolerance * glm::length(size);
  for (const AperturePiece& piece : pieces) {
    const auto outside = [&](const glm::dvec3& p) {
      return glm::dot(p - piece.corner[0], piece.inward) < -tolerance_m_;
    };
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

bool OpenPaths::clear(const Patch& e, std::size_t index, const std::vector<glm::dvec3>& front) const {
  if (!open_outside_[index] || sheets_.size() > kMostSheets)
    return false;
  Box hull{e.corner[0], e.corner[0]};
  for (const glm::dvec3& c : e.corner)
    hull.include(c);
  for (const glm::dvec3& c : front)
    hull.include(c);
  for (std::size_t s = 0; s < sheets_.size(); ++s)
    if (s != first_opening_ + pieces_[index].aperture && !parted(sheets_[s], e, front, hull))
      return false;
  return true;
}

} // namespace daylit::radiosity
