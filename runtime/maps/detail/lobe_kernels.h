#pragma once

// The inner loops of blurred maps: sums of a Phong lobe over charges. Vector code by Highway, chosen when the program
// runs; sums depend on the instruction set, not on the number of threads.

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::detail {

/// Numbers that fill any vector: arrays of charges are padded to a multiple with charges of 0.
inline constexpr std::size_t kChargePad = 16;

/// Directions with a colour and a weight each, as arrays. Texels have weight 1 and their radiance.
struct Charges {
  std::vector<float> x, y, z, red, green, blue, weight;

  std::size_t size() const { return x.size(); }
  void resize(std::size_t count);
  void set(std::size_t i, const glm::dvec3& direction, const glm::dvec3& colour, double of_weight);
};

/// Colour and weight under a lobe.
struct LobeSum {
  double red = 0.0, green = 0.0, blue = 0.0, weight = 0.0;
};

/// Charges [first, first + count): multiples of kChargePad.
struct ChargeRange {
  std::size_t first = 0, count = 0;
};

/// sums[p] += sum over the charges i of the ranges of max(0, w_i . point_p)^exponent x (colour, weight)_i, for unit
/// directions. Relative error of a term: about 1e-7 sqrt(exponent) within the lobe's standard deviation, of either sign
/// from term to term.
void add_lobe(const Charges& charges, std::span<const ChargeRange> ranges, std::span<const glm::vec3> points,
              float exponent, std::span<LobeSum> sums);

/// powers[i] = cosine[i]^exponent for cosines in [0, 1], to 1e-6 (exponent + 1) of it; 0 below 1e-37.
void lobe_powers(std::span<const float> cosine, float exponent, std::span<float> powers);

} // namespace daylit::detail
