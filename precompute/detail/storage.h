#pragma once

// How the numbers of factors are stored: as what each component is worth. A strong one is kept as words, most as
// bytes, and what is weaker still is left out.

#include <cstdint>
#include <span>
#include <vector>

namespace daylit::precompute::detail {

/// Cheapest first.
enum class Stored : std::uint8_t { nothing, bytes, words };

/// A factor of one component as it is stored: unit * number.
struct Rounded {
  float unit = 1;
  std::vector<std::int8_t> byte; ///< of a word its high byte: number = 256 byte + low
  std::vector<std::int8_t> low;  ///< of words

  /// Each to the nearest.
  static Rounded row_factor(std::span<const float> numbers, Stored stored);
  /// The error of each is carried on to the next: a sun lights many neighbours, and takes the sum of their errors.
  /// Nothing stays nothing: no light comes from the other side of a wall.
  static Rounded source_factor(std::span<const float> numbers, Stored stored);

  std::vector<float> values() const;
};

/// Mean square of what row_factor() does to bytes, relative to that of the numbers.
double row_rounding2(std::span<const float> numbers);

/// One component of all bricks': its squared error when left out, and as bytes. Words err by nothing.
struct Component {
  double power, byte_error2;
  std::size_t numbers; ///< of both factors
};

/// The least bytes whose errors add up to at most `allowed`: what saves most bytes for its error comes first (along the
/// lower convex hull of each component's choices; optimal but for the last step).
/// `per_byte`: the largest error per byte that was accepted.
std::vector<Stored> cheapest(std::span<const Component> components, double allowed, double* per_byte = nullptr);
/// What that trade does with further components: all savings up to the same error per byte.
std::vector<Stored> cheapest_at(std::span<const Component> components, double per_byte);

} // namespace daylit::precompute::detail
