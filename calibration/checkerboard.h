#pragma once

// Checkerboards in photographs, and what keeps one from being found.

#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "calibration/lens_fit.h"
#include "scene/image/image_formats.h"

namespace daylit::calibration {

/// Inner corners, columns by rows.
struct BoardSize {
  int columns = 0, rows = 0;
};

/// Inner corners of the board in a picture of 8 bits, row by row, subpixel (pixel centres are whole numbers); nothing
/// where the board is not wholly visible.
std::optional<std::vector<glm::dvec2>> find_checkerboard(const Rgb8Image& picture, BoardSize size);

inline constexpr const char *kOtherBoard = "shows a board of ", ///< begins a reason of this kind
    *kNotVisible = "the whole board is not visible";
/// Why a picture shows no such board, in plain words: over-exposed, blurred, too dark, or a board of another size.
std::string why_not_found(const Rgb8Image& picture, BoardSize size);
/// The same of any board: over-exposed, too dark, blurred, or not there.
std::string why_not_visible(const Rgb8Image& picture);
/// Whether most of the white between these corners of a board is at the top of the range.
bool white_is_lost(const Rgb8Image& picture, const std::vector<glm::dvec2>& corner_px);

/// Circle of a fish-eye picture: what is never dark in any of the pictures (their brightest value per pixel).
class CircleFinder {
public:
  /// Pictures of one size; others are left out.
  void add(const Rgb8Image& picture);
  /// Radius 0: the pictures are bright up to their corners.
  ImageCircle find() const;

private:
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> brightest_;
};

} // namespace daylit::calibration
