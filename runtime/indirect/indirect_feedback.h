#pragma once

// What virtual objects do to the room comes back to them: floor and walls around an object send it less where it
// shades them, and more where it lights them.

#include <span>
#include <vector>

#include "runtime/indirect/box_lattice.h"
#include "runtime/indirect/receiver_lattice.h"

namespace daylit {

/// Nine coefficients of the change at the points of a lattice in each object's box, beside its vertices. Keeps
/// references to everything given.
class IndirectFeedback {
public:
  IndirectFeedback(const LitScene& scene, const ReceiverLattice& receivers) : scene_(scene), receivers_(receivers) {}

  /// Looks around.
  void objects_moved();
  /// After the receivers have another light.
  void light_changed();
  /// Change of the radiance that arrives at a point of a part: trilinear between the points.
  Sh9Rgb change(std::size_t part, const glm::dvec3& x) const;

private:
  struct SeenPoint {
    std::uint32_t direction = 0;
    Rgb reflectance{0.5f};
    std::array<std::uint32_t, 4> node{}; ///< numbers and weights
    std::array<float, 4> weight{};
  };
  struct LatticePoint {
    bool used = false; ///< some vertex lies beside it
    std::vector<SeenPoint> seen;
    std::vector<ReceiverLattice::Node*> nodes; ///< that it sees, until they are listed
    Sh9Rgb change{};
  };
  struct Surround {
    BoxLattice lattice;
    std::vector<LatticePoint> points;
  };
  void look_around(std::size_t part, const glm::dvec3& eye, std::size_t phase, LatticePoint& point) const;
  void see(LatticePoint& point, std::uint32_t direction, const Rgb& reflectance,
           const ReceiverLattice::Link& link) const;
  void list_nodes();
  Sh9Rgb change_of(const std::vector<SeenPoint>& seen) const;
  template <class Work>
  void for_each_used(const Work& work);

  const LitScene& scene_;
  const ReceiverLattice& receivers_;
  std::vector<Surround> surrounds_;
  std::vector<ReceiverLattice::Node*> nodes_; ///< all that some point sees
  std::vector<Rgb> changes_;                  ///< of the irradiance, by the nodes' numbers
};

} // namespace daylit
