#pragma once

// Which directions the vertices that send light see past their own object: a bit for each ray. Nine coefficients tell
// how much light a vertex gets, but not from where: a dark floor before a fold spreads over what the fold hides.

#include <algorithm>
#include <cstdint>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "runtime/object/vertex_rays.h"

namespace daylit {

class SelfVisibility {
public:
  /// Of an object that hides nothing from itself.
  SelfVisibility() = default;
  /// Of the vertices that `rays` will look from, all of them open so far.
  SelfVisibility(const VertexRays& rays, std::size_t senders);
  /// From different threads for different senders.
  void set(std::size_t sender, bool back, const SideView& view);

  /// `w`: a unit vector above the side of the surface, in VertexRays::frame() of its normal. The nearest ray speaks for
  /// it.
  bool sees(std::size_t sender, bool back, const glm::vec3& w) const {
    if (hidden_.empty())
      return true;
    const std::size_t ray = nearest_[static_cast<std::size_t>(cell_of(w.y) * kCells + cell_of(w.x))];
    return !(hidden_[(2 * sender + back) * fans_ + ray / VertexRays::kFan] >> ray % VertexRays::kFan & 1u);
  }

private:
  static constexpr int kCells = 32; ///< a side of the square around the unit disc
  static int cell_of(float x) { return std::clamp(static_cast<int>((0.5f * x + 0.5f) * kCells), 0, kCells - 1); }

  std::size_t fans_ = 0;               ///< of rays, per side
  std::vector<std::uint16_t> hidden_;  ///< fans of each side of each sender
  std::vector<std::uint16_t> nearest_; ///< ray to each cell of the disc, on which cos dw is area (Nusselt 1928)
};

/// One side of a sender where its object stands.
struct SenderSide {
  const SelfVisibility* visibility;
  std::size_t sender; ///< of its object
  bool back;
  glm::mat3 world_from_local; ///< VertexRays::frame()

  /// Of a unit vector with the normal of the side; 0 of what the object hides.
  float visible_cosine(const glm::vec3& world) const {
    const float cosine = glm::dot(world_from_local[2], world);
    if (cosine <= 0.0f)
      return 0.0f;
    const glm::vec3 w(glm::dot(world_from_local[0], world), glm::dot(world_from_local[1], world), cosine);
    return sees(w) ? cosine : 0.0f;
  }
  /// A unit vector above the side, in its frame.
  bool sees(const glm::vec3& w) const { return visibility->sees(sender, back, w); }
};

} // namespace daylit
