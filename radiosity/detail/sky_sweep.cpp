#include "radiosity/detail/sky_sweep.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

constexpr std::size_t kMostCorners = 8; // of a part

} // namespace

std::vector<float> EnteringDirections::cosines(const glm::dvec3& axis) const {
  const glm::vec3 a(axis);
  std::vector<float> result(index.size());
  for (std::size_t k = 0; k < result.size(); ++k)
    result[k] = a.x * x[k] + a.y * y[k] + a.z * z[k];
  return result;
}

SkySweep::SkySweep(const SkyPartition& partition, const std::vector<AperturePart>& parts, int count)
    : sky(SkyDirections::make(partition, count)), entering(parts.size()) {
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (std::uint32_t k = 0; k < sky.w.size(); ++k)
      if (glm::dot(sky.w[k], parts[p].inward) < 0.0) {
        entering[p].x.push_back(static_cast<float>(sky.w[k].x));
        entering[p].y.push_back(static_cast<float>(sky.w[k].y));
        entering[p].z.push_back(static_cast<float>(sky.w[k].z));
        entering[p].index.push_back(k);
      }
}

namespace {

/// k -> k m mod n with m prime to n and near n / golden ratio: neighbours become far apart.
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
  // Regions of unequal size have directions for each of their cells: equal parts of the sphere, however large the
  // region. A large region with few directions would be off by tens of per cent.
  int cells = 0;
  for (int r = 0; r < partition.size(); ++r)
    cells += partition.extent(r).bands * partition.extent(r).cells;
  const int side = std::max(partition.interpolated() || cells > count ? 1 : 2,
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

std::vector<AperturePart> aperture_parts(const std::vector<Aperture>& apertures, const glm::dvec3& origin) {
  std::vector<AperturePart> parts;
  for (std::uint32_t a = 0; a < apertures.size(); ++a) {
    const std::vector<glm::dvec3>& c = apertures[a].corners;
    for (std::size_t first = 1; first + 1 < c.size(); first += kMostCorners - 2) {
      AperturePart part{{c[0] - origin}, apertures[a].inward, a};
      for (std::size_t k = first; k < std::min(first + kMostCorners - 1, c.size()); ++k)
        part.corner.push_back(c[k] - origin);
      parts.push_back(std::move(part));
    }
  }
  return parts;
}

} // namespace daylit::radiosity
