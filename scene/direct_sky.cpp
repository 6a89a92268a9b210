#include "scene/direct_sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/aperture.h"

namespace daylit {

namespace {

constexpr double kCell_sr = 2e-4;          // one sample per cell: 1.4 hundredths of a radian across
constexpr int kDeepest = 40;               // halvings of one aperture triangle: 2 pi / 2^40 is far below kCell_sr
constexpr float kBrightOverMean = 20.0f;   // the cap; skies without a sun stay below it
constexpr std::size_t kMostBright = 16384; // brightest first; an image with more is no sun
constexpr int kSubTexels = 4;              // per axis, of a bright texel: penumbrae
constexpr double kLeave_m = 1e-4;          // start of rays above the receiving surface

struct SphericalTriangle {
  glm::dvec3 a, b, c; // unit
  int depth = 0;
};

/// Van Oosterom & Strackee 1983, eq. 8; unit corners, positive whatever the orientation.
double solid_angle(const SphericalTriangle& t) {
  const double volume = std::abs(glm::dot(t.a, glm::cross(t.b, t.c)));
  const double sum = 1.0 + glm::dot(t.a, t.b) + glm::dot(t.b, t.c) + glm::dot(t.c, t.a);
  return 2.0 * std::atan2(volume, sum);
}

/// Across the longest side.
std::array<SphericalTriangle, 2> halves(const SphericalTriangle& t) {
  const double ab = glm::dot(t.a, t.b), bc = glm::dot(t.b, t.c), ca = glm::dot(t.c, t.a);
  const SphericalTriangle turned = ab <= bc && ab <= ca ? t
                                   : bc <= ca           ? SphericalTriangle{t.b, t.c, t.a, t.depth}
                                                        : SphericalTriangle{t.c, t.a, t.b, t.depth};
  const glm::dvec3 middle = glm::normalize(turned.a + turned.b);
  return {SphericalTriangle{turned.a, middle, turned.c, t.depth + 1},
          SphericalTriangle{middle, turned.b, turned.c, t.depth + 1}};
}

/// The part of a spherical polygon above (side 1) or below (side -1) the horizon, where skies end: a cell across it
/// would take the radiance of one of the two.
std::vector<glm::dvec3> beyond_horizon(const std::vector<glm::dvec3>& polygon, double side) {
  std::vector<glm::dvec3> part;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const glm::dvec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    const double ha = side * a.z, hb = side * b.z;
    if (ha >= 0.0)
      part.push_back(a);
    if ((ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0))
      part.push_back(glm::normalize(a + ha / (ha - hb) * (b - a)));
  }
  return part;
}

} // namespace

struct DirectSky::Receiver {
  glm::dvec3 point, normal;
  glm::vec3 ray_origin; // local to the ray scene, a little above the surface
};

DirectSky::DirectSky(const std::vector<Aperture>& apertures, const RayScene& scene, const SkyImage& sky)
    : apertures_(apertures), scene_(scene), sky_(sky) {
  double sum = 0.0, area = 0.0;
  const std::vector<Rgb>& texels = sky.image().texels;
  const std::vector<float>& weight = sky.solid_angle_sr();
  for (std::size_t i = 0; i < texels.size(); ++i) {
    sum += static_cast<double>(weight[i]) * static_cast<double>(luminance(texels[i]));
    area += static_cast<double>(weight[i]);
  }
  cap_ = area > 0.0 ? kBrightOverMean * static_cast<float>(sum / area) : 0.0f;
  for (std::size_t i = 0; i < texels.size(); ++i)
    if (weight[i] > 0.0f && luminance(texels[i]) > cap_)
      bright_.push_back({i, texels[i]});
  std::stable_sort(bright_.begin(), bright_.end(), [](const BrightTexel& a, const BrightTexel& b) {
    return luminance(a.excess) > luminance(b.excess);
  });
  if (bright_.size() > kMostBright) {
    cap_ = luminance(bright_[kMostBright].excess);
    bright_.resize(kMostBright);
  }
  for (BrightTexel& t : bright_)
    t.excess *= 1.0f - cap_ / luminance(t.excess);
}

bool DirectSky::sees_sky(const Receiver& at, const glm::dvec3& d) const {
  return !scene_.occluded(at.ray_origin, glm::vec3(d), 0.0f, std::numeric_limits<float>::infinity());
}

// Light counts where it first enters, seen from the point; behind another pane it is that pane's.
bool DirectSky::enters_elsewhere_first(const glm::dvec3& p, const glm::dvec3& d, std::size_t aperture) const {
  if (apertures_.size() < 2)
    return false;
  const Aperture& own = apertures_[aperture];
  const double distance = glm::dot(own.corners[0] - p, own.inward) / glm::dot(d, own.inward);
  int crossed = 0;
  aperture_transmittance(apertures_, p, d, distance * (1.0 - 1e-9), &crossed);
  return crossed > 0;
}

glm::dvec3 DirectSky::polygon_light(const Receiver& at, std::size_t aperture) const {
  glm::dvec3 sum(0.0);
  std::vector<SphericalTriangle> open;
  const std::vector<glm::dvec3>& corners = apertures_[aperture].corners;
  std::vector<glm::dvec3> way;
  for (const glm::dvec3& corner : corners) {
    const double distance = glm::distance(corner, at.point);
    if (!(distance > 0.0))
      return sum;
    way.push_back((corner - at.point) / distance);
  }
  for (const double side : {1.0, -1.0}) {
    const std::vector<glm::dvec3> part = beyond_horizon(way, side);
    for (std::size_t k = 1; k + 1 < part.size(); ++k)
      open.push_back({part[0], part[k], part[k + 1], 0});
  }
  while (!open.empty()) {
    const SphericalTriangle t = open.back();
    open.pop_back();
    if (std::max({glm::dot(t.a, at.normal), glm::dot(t.b, at.normal), glm::dot(t.c, at.normal)}) <= 0.0)
      continue;
    const double size = solid_angle(t);
    if (size > kCell_sr && t.depth < kDeepest) {
      const std::array<SphericalTriangle, 2> parts = halves(t);
      open.insert(open.end(), parts.begin(), parts.end());
      continue;
    }
    const glm::dvec3 d = glm::normalize(t.a + t.b + t.c);
    const double cosine = glm::dot(d, at.normal);
    if (!(cosine > 0.0) || enters_elsewhere_first(at.point, d, aperture) || !sees_sky(at, d))
      continue;
    Rgb radiance = sky_.radiance(d);
    if (const float l = luminance(radiance); l > cap_ && !bright_.empty())
      radiance *= cap_ / l;
    radiance *= aperture_transmittance(apertures_, at.point, d, std::numeric_limits<double>::infinity());
    sum += size * cosine * glm::dvec3(radiance);
  }
  return sum;
}

glm::dvec3 DirectSky::bright_light(const Receiver& at) const {
  glm::dvec3 sum(0.0);
  const int width = sky_.image().width;
  for (const BrightTexel& t : bright_) {
    const double x = static_cast<double>(t.index % width), y = static_cast<double>(t.index / width);
    glm::dvec3 seen(0.0);
    int inside = 0;
    for (int k = 0; k < kSubTexels * kSubTexels; ++k) {
      const glm::dvec2 shift((k % kSubTexels + 0.5) / kSubTexels - 0.5, (k / kSubTexels + 0.5) / kSubTexels - 0.5);
      const std::optional<glm::dvec3> d = sky_.direction(glm::dvec2(x, y) + shift);
      if (!d)
        continue;
      ++inside;
      const double cosine = glm::dot(*d, at.normal);
      int crossed = 0;
      const Rgb through =
          aperture_transmittance(apertures_, at.point, *d, std::numeric_limits<double>::infinity(), &crossed);
      if (cosine > 0.0 && crossed > 0 && sees_sky(at, *d))
        seen += cosine * glm::dvec3(through);
    }
    if (inside > 0)
      sum += static_cast<double>(sky_.solid_angle_sr()[t.index]) / inside * seen * glm::dvec3(t.excess);
  }
  return sum;
}

Rgb DirectSky::irradiance(const glm::dvec3& point, const glm::dvec3& unit_normal) const {
  const double leave = std::max(kLeave_m, 4.0 * static_cast<double>(scene_.surface_offset()));
  const Receiver at{point, unit_normal, scene_.to_local(point + leave * unit_normal)};
  glm::dvec3 sum = bright_light(at);
  for (std::size_t k = 0; k < apertures_.size(); ++k)
    sum += polygon_light(at, k);
  return Rgb(sum);
}

} // namespace daylit
