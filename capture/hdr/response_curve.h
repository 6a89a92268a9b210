#pragma once

// What a camera makes of light: code value against exposure (radiance times exposure time), per channel.

#include <array>
#include <cstdint>
#include <string>

#include "scene/core/result.h"

namespace daylit {

/// Rises monotonically from code 0 to the largest code, which stands for an exposure of 1. Codes of any number of bits
/// are given as fractions of the largest; between the 256 points of the curve it is straight.
class ResponseCurve {
public:
  using Table = std::array<std::array<float, 256>, 3>; ///< exposure, by channel and code

  static ResponseCurve linear();
  static ResponseCurve srgb();
  /// The same curve scaled so that the last entry of each channel is 1. Error value_invalid: it falls, is negative or
  /// does not rise at all.
  static Result<ResponseCurve> from_table(const Table& table, const std::string& name);
  /// Text of 256 lines with one number or three (R G B) each, '#' starts a comment; or the polynomials of Radiance's
  /// hdrgen: three lines, each the degree and then the coefficients from the highest power down. Errors name the line.
  static Result<ResponseCurve> parse(const std::string& text, const std::string& name);
  /// "linear", "srgb", or the path of such a file.
  static Result<ResponseCurve> named(const std::string& name);

  /// Exposure of a code value, both 0..1; what is outside counts as the end of the curve.
  float exposure(float code, int channel) const;
  /// Code of 8 bits whose point on the curve is nearest: the curve between two codes is taken as straight, the border
  /// halfway. What is outside counts as the end of the curve, NaN as 0.
  std::uint8_t encode(float exposure, int channel) const;
  /// d exposure / d code, over the interval of the table in which the code lies.
  float slope(float code, int channel) const;
  /// The largest code, as a fraction, that stands for no light; 0 as a rule, more where a camera adds a pedestal.
  float black(int channel) const;
  const Table& table() const { return table_; }
  bool is_linear() const { return linear_; }
  /// 256 lines of three numbers, as parse() reads.
  std::string text() const;

private:
  Table table_{};
  bool linear_ = false; ///< exact, without the table
};

} // namespace daylit
