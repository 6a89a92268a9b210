#pragma once

// Points of the room around virtual objects at which the objects' effect on its light is known: corners of square cells
// on the room's planes, the smaller the nearer an object's surface is, made when a point nearby is looked up first.
// Rays are traced once per placement; what they carry is renewed with the light.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "runtime/indirect/receiver.h"

namespace daylit {

/// Keeps a reference to the scene. All but the versions is thread-safe.
class ReceiverLattice {
public:
  explicit ReceiverLattice(const LitScene& scene);
  ReceiverLattice(ReceiverLattice&&) noexcept;
  ReceiverLattice& operator=(ReceiverLattice&&) noexcept;
  ~ReceiverLattice();

  /// The scene has other places of its parts, another light of the room, other light of the parts.
  void objects_moved();
  void sky_changed();
  void light_changed();
  /// What metals mirror is another, from the next light_changed() on.
  void mirrored_changed();

  /// At point x of a triangle on the side that `direction` meets; interpolated. Nothing is interpolated past a surface
  /// of the room, and near an object none of its own.
  IndirectChange at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  /// The same without the lattice and with `rays` rays per object: the slow twin.
  IndirectChange evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction, int rays) const;
  /// So close to an object that its effect may be narrower than a few cells further away.
  bool near(const glm::dvec3& x) const;
  /// From x to the nearest surface of an object, metres: to a few centimetres, and never more than it is looked for.
  double surface_distance(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  /// Nearer than that the effect is as narrow as a pixel.
  double contact_distance() const;

  struct Node;
  /// Nodes and weights that stand for a point: looked up once per placement.
  struct Link {
    std::array<Node*, 4> node{};
    std::array<float, 4> weight{};
  };
  /// For one who sees x from that many radii of the object away: nearer than two cells of a contact level, in these.
  Link link(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction, double radii_away) const;
  /// Nodes are numbered from 0 as they are made.
  std::size_t node_count() const;
  static std::size_t number_of(const Node& node);
  /// Irradiance of point x of a triangle, sun excepted; interpolated. Without `with_objects` as if there were none.
  RoomIrradiance irradiance_without_sun(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                        bool with_objects = true) const;
  /// Change of the irradiance there, direct light included, that of the sun if `sun_too`.
  Rgb whole_change(Node& node, bool sun_too) const;
  /// After that: the part of its hemisphere, by the cosine, that objects cover.
  static float covered(const Node& node);

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace daylit
