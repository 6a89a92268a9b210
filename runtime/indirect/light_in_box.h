#pragma once

// Indirect light in the box of a dense object, whose vertices are too many to look it up at each: it is known at some,
// and changes little between them.

#include <vector>

#include <glm/mat3x3.hpp>

#include "runtime/indirect/box_lattice.h"
#include "runtime/object/relight.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// What a vertex sees of its own object.
struct SeenOfObject {
  TwoSided irradiance;                           ///< from there
  float hidden_front = 0.0f, hidden_back = 0.0f; ///< of what each side sees, by its cosine
};

/// Light that reaches a point.
struct LightAtPoint {
  Sh9Rgb from_room{};
  TwoSided of_object; ///< mean radiance of what of its own object each side of a surface there sees
};

/// At the points of a lattice, each the mean of the known ones around by their distance.
class LightInBox {
public:
  explicit LightInBox(const Bounds& box) : lattice_(box, kSide, 0.0), points_(lattice_.point_count()) {}

  /// Positions in the frame of the box, light in the world's.
  void add(const glm::dvec3& x, const Sh9Rgb& from_room, const SeenOfObject& seen);
  /// Turns the light into the frame of the box, once all is added.
  void turn(const glm::mat3& world_from_box);
  /// Trilinear; zero where none was added nearby.
  LightAtPoint at(const glm::dvec3& x) const;

private:
  static constexpr int kSide = 24;
  struct Point {
    Sh9Rgb sum{}; ///< after turn() the mean
    float weight = 0.0f;
    SeenOfObject seen; ///< sums
  };
  BoxLattice lattice_;
  std::vector<Point> points_;
};

} // namespace daylit
