#include "radiosity/detail/obstacles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

constexpr std::size_t kMostCorners = 8;
constexpr double kFlat = 1e-7; // of the room's size: distance of a corner from its neighbour's plane or edge

/// Triangle corners that are equal become one index.
std::vector<std::uint32_t> weld(const std::vector<glm::dvec3>& vertices) {
  std::vector<std::uint32_t> order(vertices.size()), name(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) { return std::array<double, 3>{vertices[i].x, vertices[i].y, vertices[i].z}; };
  std::ranges::sort(order,
                    [&](std::uint32_t a, std::uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  for (std::size_t k = 0; k < order.size(); ++k)
    name[order[k]] = k > 0 && key(order[k]) == key(order[k - 1]) ? name[order[k - 1]] : order[k];
  return name;
}

class Merger {
public:
  Merger(const Room& room, const glm::dvec3& origin) {
    double size = 0;
    for (const glm::dvec3& v : room.vertices) {
      vertex_.push_back(v - origin);
      size = std::max(size, glm::length(vertex_.back()));
    }
    flat_m_ = kFlat * size;
    const std::vector<std::uint32_t> name = weld(vertex_);
    for (const auto& t : room.triangles) {
      if (room.is_window(t))
        continue;
      Polygon p{{name[t.vertex[0]], name[t.vertex[1]], name[t.vertex[2]]}, glm::dvec3(0.0)};
      const glm::dvec3 &a = vertex_[p.corner[0]], &b = vertex_[p.corner[1]], &c = vertex_[p.corner[2]];
      const glm::dvec3 n = glm::cross(b - a, c - a);
      const double length = glm::length(n);
      if (!(length > 0.0))
        continue;
      p.normal = n / length;
      polygon_.push_back(std::move(p));
    }
  }

  std::vector<Obstacle> run() {
    for (std::uint32_t p = 0; p < polygon_.size(); ++p)
      absorb_neighbours(p);
    std::vector<Obstacle> result;
    for (const Polygon& p : polygon_) {
      if (p.corner.empty())
        continue;
      Obstacle o{{}, p.normal};
      for (const std::uint32_t c : p.corner)
        o.corner.push_back(vertex_[c]);
      result.push_back(std::move(o));
    }
    return result;
  }

private:
  struct Polygon {
    std::vector<std::uint32_t> corner;
    glm::dvec3 normal;
  };
  using EdgeKey = std::pair<std::uint32_t, std::uint32_t>;

  /// Takes in neighbours seen before p (their edges are in the table) until none fits, then enters p's own edges.
  void absorb_neighbours(std::uint32_t p) {
    for (bool changed = true; changed;) {
      changed = false;
      const std::size_t n = polygon_[p].corner.size();
      for (std::size_t k = 0; k < n && !changed; ++k) {
        const auto found = owner_.find({polygon_[p].corner[(k + 1) % n], polygon_[p].corner[k]});
        if (found != owner_.end() && found->second != p)
          changed = merge(p, k, found->second);
      }
    }
    const Polygon& whole = polygon_[p];
    for (std::size_t k = 0; k < whole.corner.size(); ++k)
      owner_[{whole.corner[k], whole.corner[(k + 1) % whole.corner.size()]}] = p;
  }

  /// Edge k of p and its twin in q fall away.
  bool merge(std::uint32_t p, std::size_t k, std::uint32_t q) {
    const Polygon &a = polygon_[p], &b = polygon_[q];
    const std::size_t n = a.corner.size(), m = b.corner.size();
    if (n + m - 2 > kMostCorners || glm::dot(a.normal, b.normal) <= 0.5)
      return false;
    for (const std::uint32_t c : b.corner)
      if (std::abs(glm::dot(vertex_[c] - vertex_[a.corner[0]], a.normal)) > flat_m_)
        return false;
    const auto at = std::ranges::find(b.corner, a.corner[k]) - b.corner.begin(); // q runs from corner k + 1 to corner k
    std::vector<std::uint32_t> joined;
    for (std::size_t i = 1; i <= n; ++i)
      joined.push_back(a.corner[(k + i) % n]); // k + 1 ... k
    for (std::size_t i = 1; i + 1 < m; ++i)
      joined.push_back(b.corner[(static_cast<std::size_t>(at) + i) % m]);
    auto sorted = joined; // polygons that share more than one edge would leave a spike
    std::ranges::sort(sorted);
    if (std::ranges::adjacent_find(sorted) != sorted.end() || !convex(joined, a.normal))
      return false;
    for (std::size_t i = 0; i < m; ++i)
      owner_.erase({b.corner[i], b.corner[(i + 1) % m]});
    polygon_[p].corner = std::move(joined);
    polygon_[q].corner.clear();
    return true;
  }

  bool convex(const std::vector<std::uint32_t>& corner, const glm::dvec3& normal) const {
    const std::size_t n = corner.size();
    for (std::size_t k = 0; k < n; ++k) {
      const glm::dvec3 &a = vertex_[corner[k]], &b = vertex_[corner[(k + 1) % n]], &c = vertex_[corner[(k + 2) % n]];
      const double length = glm::distance(a, c);
      if (glm::dot(glm::cross(b - a, c - b), normal) < -flat_m_ * length)
        return false;
    }
    return true;
  }

  std::vector<glm::dvec3> vertex_;
  double flat_m_ = 0;
  std::vector<Polygon> polygon_;
  std::map<EdgeKey, std::uint32_t> owner_;
};

} // namespace

std::vector<Obstacle> convex_obstacles(const Room& room, const glm::dvec3& origin) {
  return Merger(room, origin).run();
}

} // namespace daylit::radiosity
