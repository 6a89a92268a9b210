#pragma once

// How the numbers of factors are stored, by what each component is worth: a strong one with 16 bits a number, most with
// 8, and what is weaker still is left out.

#include <cstdint>
#include <span>
#include <vector>

namespace daylit::precompute::detail {

/// The value is the number of bytes that a number takes.
enum class Stored : std::uint8_t { nothing = 0, weak = 1, strong = 2 };

/// A factor of one component as it is stored: step * integer, the largest of which is 127 or 32767.
struct Rounded {
  float step = 1;
  std::vector<std::int16_t> integer;

  /// Each number to the nearest.
  static Rounded row_factor(std::span<const float> values, Stored stored);
  /// The error of each number is carried on to the next (error diffusion): a sun lights many neighbours, and takes the
  /// sum of their errors. Zeros stay zeros: no light comes from the other side of a wall.
  static Rounded source_factor(std::span<const float> values, Stored stored);

  std::vector<float> values() const;
};

/// Mean square of what rounding a row factor to 8 bits adds, relative to that of its numbers: step^2 / 12 for each
/// (uniform in +- half a step).
double row_rounding2(std::span<const float> values);

/// One component of all clusters': its squared error when left out, and with 8 bits. 16 bits err by nothing.
struct Component {
  double power, weak_error2;
  std::size_t size; ///< numbers of both factors
};

/// The least bytes whose errors add up to at most `allowed`: what saves most bytes for its error comes first (along the
/// lower convex hull of each component's choices; optimal but for the last step).
/// `per_byte`: the largest error per byte that was accepted.
std::vector<Stored> cheapest(std::span<const Component> components, double allowed, double* per_byte = nullptr);
/// What that trade does with further components: all savings up to the same error per byte.
std::vector<Stored> cheapest_at(std::span<const Component> components, double per_byte);

} // namespace daylit::precompute::detail
