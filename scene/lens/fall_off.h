#pragma once

// Fall-off of a lens towards the edge of its picture.

#include <filesystem>
#include <span>
#include <vector>

#include "scene/core/output_file.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/lens.h"

namespace daylit {

/// Relative sensitivity at an angle t (radians) from the axis: 1 + a1 t^2 + a2 t^4 + a3 t^6 ...
struct FallOff {
  std::vector<double> coefficient;
  double at(double theta) const;
};

/// Text: "coefficients a1 a2 ...", '#' starts a comment. Error value_invalid: not that.
Result<FallOff> read_fall_off(const std::filesystem::path& path);
constexpr FileKind kFallOffKind{"a fall-off file of daylit", "# Fall-off of a lens"};
Result<void> write_fall_off(const std::filesystem::path& path, const FallOff& fall_off);

/// Relative sensitivity of each pixel of a picture, row by row; 1 where the lens sees nothing. Error value_invalid: the
/// picture is not of the lens's size, or the fall-off is not positive inside the lens's field.
Result<std::vector<float>> pixel_sensitivity(const LensModel& lens, const FallOff& fall_off, int width_px,
                                             int height_px);

/// Radiance of a picture whose pixels are so sensitive; as many numbers as texels.
void divide(RgbImage& picture, std::span<const float> sensitivity);

} // namespace daylit
