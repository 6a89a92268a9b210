#pragma once

// What virtual objects do to the room comes back to them: floor and walls around an object send it less where it
// shades them, and more where it lights them.

#include <span>
#include <vector>

#include "runtime/indirect/box_lattice.h"
#include "runtime/indirect/feedback_term.h"
#include "runtime/indirect/receiver_lattice.h"
#include "runtime/object/self_visibility.h"

namespace daylit {

/// Nine coefficients of the change at points of a lattice in each object's box, beside its vertices. Where these are
/// close to a surface of the room the light changes within millimetres, and each few of them have a point of their own.
/// Keeps references to everything given.
class IndirectFeedback {
public:
  IndirectFeedback(const LitScene& scene, const ReceiverLattice& receivers) : scene_(scene), receivers_(receivers) {}

  /// Looks around.
  void objects_moved();
  /// After the receivers have another light. `sun_too`: what the objects keep of the sun from the room counts.
  void light_changed(bool sun_too);
  /// Change of the radiance that arrives at a vertex of a part that sends light: trilinear between the points of the
  /// lattice, or that of its own.
  Sh9Rgb change(std::size_t part, std::size_t vertex) const;
  /// What a side of the vertex sees of it, until an object moves; and the change of its irradiance by that.
  std::vector<FeedbackTerm> terms(std::size_t part, std::size_t vertex, const SenderSide& side) const;
  Rgb change(std::span<const FeedbackTerm> terms) const;

private:
  struct SeenPoint {
    std::uint32_t direction = 0;
    Rgb reflectance{0.5f};
    std::array<std::uint32_t, 4> node{}; ///< numbers and weights
    std::array<float, 4> weight{};
  };
  /// From where it is looked around.
  struct Eye {
    std::size_t part = 0;
    glm::dvec3 position{0.0}; ///< world metres
    int phase = 0;            ///< of the directions
    bool at_contact = false;
    std::vector<SeenPoint> seen;
    std::vector<ReceiverLattice::Node*> nodes; ///< that it sees, until they are listed
    std::size_t first = 0;                     ///< of the light that arrives from what it sees
    Sh9Rgb change{};
  };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  /// Of a vertex close to the room: its eye, and how much that counts beside the lattice.
  struct Contact {
    std::uint32_t eye = kNone;
    float weight = 0.0f;
  };
  struct Surround {
    BoxLattice lattice;
    std::vector<std::uint32_t> eye; ///< of each point of the lattice that lies beside a vertex
    std::vector<Contact> contact;   ///< of each vertex
  };
  void add_lattice(std::size_t part, Surround& surround);
  void add_contact(std::size_t part, Surround& surround);
  void look_around(Eye& eye) const;
  void see(Eye& eye, std::uint32_t direction, const Rgb& reflectance, const ReceiverLattice::Link& link) const;
  void list_nodes();
  void find_change(Eye& eye);
  /// add(eye, weight) of those that stand for a vertex.
  template <class Add>
  void for_each_eye(std::size_t part, std::size_t vertex, const Add& add) const;

  const LitScene& scene_;
  const ReceiverLattice& receivers_;
  std::vector<Surround> surrounds_; ///< of each part
  std::vector<Eye> eyes_;
  std::vector<ReceiverLattice::Node*> nodes_; ///< all that some eye sees
  std::vector<Rgb> changes_;                  ///< of the irradiance, by the nodes' numbers
  std::vector<Rgb> arriving_;                 ///< change of the radiance from each point seen, times its solid angle
};

} // namespace daylit
