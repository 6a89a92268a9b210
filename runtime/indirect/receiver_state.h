#pragma once

// What receiver_lattice.h keeps, for its sources: nodes by level and place, and what is asked of them.

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <tbb/concurrent_unordered_map.h>

#include "runtime/indirect/placement_history.h"
#include "runtime/indirect/receiver_lattice.h"
#include "runtime/indirect/receiver_levels.h"
#include "runtime/indirect/receiver_node.h"

namespace daylit {

/// A square of a level.
struct ReceiverCell {
  bool open = false; ///< its corners lie in the same air
  std::array<ReceiverLattice::Node*, 4> corner{};
};

struct ReceiverLattice::State {
  struct Lattice {
    double cell_m = 0.1;
    std::vector<DirectionPattern> patterns; ///< by phase
    mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<ReceiverCell>, LatticeHash> cells;
    mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Node>, LatticeHash> nodes;
  };
  const LitScene& scene;
  std::uint64_t light_version = 0, sky_version = 1, placement_version = 1, mirrored_version = 1;
  PlacementHistory placements; ///< by placement_version
  std::array<Lattice, kLevels.size()> lattices;
  mutable std::atomic<std::size_t> nodes_made{0};
  mutable LitPoints lit;               ///< of the nodes
  static constexpr int kLampRays = 64; // to what lamps light
  DirectionPattern lamp_pattern{kLampRays};

  explicit State(const LitScene& s) : scene(s), lit(s.light) {
    for (std::size_t k = 0; k < kLevels.size(); ++k)
      for (int phase = 0; phase < DirectionPattern::kPhases; ++phase)
        lattices[k].patterns.emplace_back(kLevels[k].rays, phase);
  }
  Node* node(std::size_t level, const LatticeKey& key, std::uint32_t triangle) const;
  const ReceiverCell& cell(std::size_t level, const LatticeKey& key, std::uint32_t triangle) const;
  void renew(Node& node) const;
  const IndirectChange& current(Node& node) const;
  Rgb whole_change(Node& node, bool sun_too = true) const;
  Rgb reflected_change(std::span<const ChangedSurface> surfaces, const glm::dvec3& air, const glm::dvec3& n,
                       const DirectionPattern& pattern, const RoomPoint& here) const;
  const Rgb& reflected(Node& node) const;
  float current_distance(Node& node) const;
  const RoomPoint& current_light(Node& node) const;
  const Rgb& current_blocked(Node& node) const;
  float window_visibility(Node& node) const;

  /// A point of a plane.
  struct Place {
    std::uint32_t triangle = 0, facing = 0;
    glm::dvec3 x{0.0};
  };
  /// The cell that it lies in.
  struct Found {
    const ReceiverCell* cell = nullptr;
    LatticeSquare square;
    double distance = 0.0; ///< to the nearest surface of an object, radii, where it was looked for
  };
  Found find(std::size_t level, const Place& place) const;
  double distance(const Found& found) const;
  std::array<float, 4> weights(std::size_t level, const Found& found, const Place& place) const;
  Link link(std::size_t level, const Found& found, const Place& place) const;
  Link link(const Place& place, double radii_away) const;
  bool is_even(const ReceiverCell& cell) const;
  /// After current_light().
  static bool is_inside(const Node& node) { return node.open.at.probes.count > 0; }
  Link link_in_even_cell(const Place& place) const;
  std::vector<ChangedSurface> changed_surfaces(const glm::dvec3& air, const glm::dvec3& n,
                                               const DirectionPattern& pattern) const;
  std::array<Found, 4> around(std::size_t level, const Found& found, const Place& place,
                              std::array<float, 4>& share) const;
  std::optional<IndirectChange> between_nodes(std::size_t level, const Found& found, const Place& place) const;
  /// Which level holds at a place, and how much of the next one is mixed in.
  struct Mix : LevelMix {
    std::array<Found, kContactLevels + 1> found{}; ///< of the levels looked at on the way; others have no cell
  };
  Mix mix_at(const Place& place) const;
};

} // namespace daylit
