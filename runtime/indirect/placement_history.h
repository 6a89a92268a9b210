#pragma once

// Where objects stood: what a point saw of one that stayed where it was holds, unless another one moved before it.

#include <cstdint>
#include <deque>
#include <vector>

#include "runtime/object/placed_parts.h"

namespace daylit {

class PlacementHistory {
public:
  /// How many of the latest placements are known.
  static constexpr std::size_t kKept = 64;
  /// The objects stand so from that version on. Other objects than before: nothing that was seen holds.
  void add(std::uint64_t version, const PlacedParts& parts);
  /// What x saw of a part at that version it sees now: the part stands where it stood, and no other that stood or
  /// stands elsewhere lies before its sphere, then or now.
  bool holds(std::size_t part, const glm::dvec3& x, std::uint64_t since) const;

private:
  struct Stood {
    glm::dmat4 world_from_object{1.0};
    BoundingSphere sphere;
  };
  struct Placement {
    std::uint64_t version = 0;
    std::vector<Stood> parts;
  };
  const Placement* at(std::uint64_t version) const;
  std::deque<Placement> placements_; ///< the latest last
  std::vector<PlacedPart> objects_;  ///< that they are of
};

} // namespace daylit
