#pragma once

// Planar polygons in a binary tree of compact clusters. Flat surfaces come apart near the top of the tree, so that most
// clusters lie in one plane: the visibility and rank decisions about pairs of clusters depend on that.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::radiosity {

struct Box {
  glm::dvec3 lo, hi;
};
double distance(const Box& a, const Box& b); ///< 0 where they overlap
double diameter(const Box& box);

struct ClusterItem {
  std::span<const glm::dvec3> corner; ///< metres, one frame for all; must outlive the construction of the tree
  glm::dvec3 normal{0.0};             ///< unit
  std::uint32_t plane = 0;            ///< items of one id lie in one plane and look the same way
};

struct ItemPlane {
  glm::dvec3 point, normal;
};

/// Holds the normals of all items.
struct NormalCone {
  glm::dvec3 axis{0.0}; ///< unit
  double angle = 4.0;   ///< half the opening, radians; above pi: no cone
};

struct Cluster {
  std::uint32_t first = 0, last = 0;           ///< positions [first, last) in ClusterTree::order
  std::int32_t child[2] = {-1, -1};            ///< both -1: not divided
  std::int32_t plane = -1;                     ///< the plane of all items; -1: several
  glm::dvec3 point{0.0}, normal{0.0};          ///< of that plane
  std::uint32_t first_corner = 0, corners = 0; ///< outline: points whose hull holds the cluster; none: use the box
  Box box{};
  NormalCone cone{};

  bool childless() const { return child[0] < 0; }
  std::uint32_t size() const { return last - first; }
};

class ClusterTree {
public:
  ClusterTree(std::span<const ClusterItem> items, std::uint32_t leaf_size);

  const std::vector<std::uint32_t>& order() const { return order_; } ///< tree position -> item
  const std::vector<Cluster>& clusters() const { return clusters_; } ///< [0] is the root
  const Cluster& operator[](std::int32_t i) const { return clusters_[static_cast<std::size_t>(i)]; }
  std::span<const glm::dvec3> outline(const Cluster& c) const { return {corners_.data() + c.first_corner, c.corners}; }
  /// The planes of a cluster's items, in tree order.
  std::span<const ItemPlane> planes(const Cluster& c) const { return {planes_.data() + c.first, c.size()}; }

private:
  /// Extent of the keys of some items.
  struct KeyBox {
    std::array<double, 6> low, high;
  };
  KeyBox measure(std::span<const ClusterItem> items, Cluster& c);
  std::uint32_t divide(std::span<const ClusterItem> items, const Cluster& c, const KeyBox& keys, int depth);
  std::int32_t build(std::span<const ClusterItem> items, std::uint32_t first, std::uint32_t last, int depth);
  void outline_of(std::span<const ClusterItem> items, Cluster& c);

  std::uint32_t leaf_size_;
  double normal_weight_m_ = 0; ///< carries the difference of two normals to metres
  std::vector<std::uint32_t> order_;
  std::vector<Cluster> clusters_;
  std::vector<glm::dvec3> corners_;
  std::vector<ItemPlane> planes_;
  std::vector<std::array<double, 6>> key_; ///< per item: where its plane (large planes) or itself lies
};

} // namespace daylit::radiosity
