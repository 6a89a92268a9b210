#pragma once

#include <cstdint>
#include <vector>

#include "radiosity/detail/cluster_tree.h"
#include "radiosity/detail/obstacles.h"

namespace daylit::radiosity {

enum class Visibility {
  clear,  ///< no segment from the front of one to the front of the other meets an obstacle, except by touching it
  hidden, ///< every segment between them meets one and the same obstacle
  mixed,  ///< neither could be shown
};

/// Decides for whole clusters whether anything can stand between them: most pairs of a room need no ray. `clear` and
/// `hidden` are proofs.
class BlockVisibility {
public:
  explicit BlockVisibility(std::vector<Obstacle> obstacles);

  const std::vector<Obstacle>& obstacles() const { return obstacles_; }

  /// `a`, `b`: clusters of `tree`, same frame as the obstacles.
  Visibility between_clusters(const ClusterTree& tree, const Cluster& a, const Cluster& b) const;

  /// What may stand between them, as indices of obstacles; at most `limit`, then `complete` is false.
  struct Between {
    std::vector<std::uint32_t> items;
    bool complete = true;
  };
  Between between(const ClusterTree& tree, const Cluster& a, const Cluster& b, std::size_t limit) const;

  /// Heights of a cluster over a plane.
  struct Range {
    double low, high;
  };
  static Range heights(const ClusterTree& tree, const Cluster& c, const glm::dvec3& point, const glm::dvec3& normal);
  double tolerance_m() const { return tolerance_m_; }

  /// All of b lies behind (in front of) the plane of every item of a; sufficient, not necessary: false where a curved
  /// cluster has too many items to look at and the cone of its normals does not decide.
  bool behind(const ClusterTree& tree, const Cluster& a, const Cluster& b) const;
  bool in_front(const ClusterTree& tree, const Cluster& a, const Cluster& b) const;

private:
  /// Calls visit(obstacle, hides) for every obstacle that may stand between; stops when that says false, and says so.
  template <class Visit>
  bool search(const ClusterTree& tree, const Cluster& a, const Cluster& b, const Visit& visit) const;
  /// Every obstacle of o lies behind all planes of c: no segment from the front of an item of c meets it.
  bool shielded(const ClusterTree& tree, const Cluster& c, const Cluster& o) const;
  /// Both clusters lie on one and the same side of the planes of all obstacles of o.
  bool one_side(const Cluster& o, const Cluster& a, const Cluster& b) const;
  Visibility past_obstacle(const ClusterTree& tree, const Cluster& a, const Cluster& b, const Obstacle& o) const;

  std::vector<Obstacle> obstacles_;
  ClusterTree hierarchy_; ///< one obstacle per lowest cluster
  double tolerance_m_ = 0;
};

} // namespace daylit::radiosity
