#pragma once

// Indirect light in the box of a dense object, whose vertices are too many to look it up at each: it is known at some,
// and changes little between them.

#include <vector>

#include <glm/mat3x3.hpp>

#include "runtime/indirect/box_lattice.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// Coefficients at the points of a lattice, each the mean of the known ones around by their distance.
class LightInBox {
public:
  explicit LightInBox(const Bounds& box) : lattice_(box, kSide, 0.0), points_(lattice_.point_count()) {}

  /// Positions in the frame of the box, light in the world's.
  void add(const glm::dvec3& x, const Sh9Rgb& light);
  /// Turns the light into the frame of the box, once all is added.
  void turn(const glm::mat3& world_from_box);
  /// Trilinear; zero where none was added nearby.
  Sh9Rgb at(const glm::dvec3& x) const;

private:
  static constexpr int kSide = 12;
  struct Point {
    Sh9Rgb sum{}; ///< after turn() the mean
    float weight = 0.0f;
  };
  BoxLattice lattice_;
  std::vector<Point> points_;
};

} // namespace daylit
