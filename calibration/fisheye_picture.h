#pragma once

// What a lens does to the light of a picture: fall-off towards the edge, and the illuminance that follows from it.

#include <filesystem>
#include <vector>

#include "scene/core/output_file.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

/// Relative sensitivity at an angle t (radians) from the axis: 1 + a1 t^2 + a2 t^4 + a3 t^6 ...
struct FallOff {
  std::vector<double> coefficient;
  double at(double theta) const;
};

/// Text: "coefficients a1 a2 ...", '#' starts a comment. Error value_invalid: not that, or not positive up to 110
/// degrees where it would be divided by.
Result<FallOff> read_fall_off(const std::filesystem::path& path);
constexpr FileKind kFallOffKind{"a fall-off file of daylit", "# Fall-off of a lens"};
Result<void> write_fall_off(const std::filesystem::path& path, const FallOff& fall_off);

/// Error value_invalid: the picture is not of the lens's size, or the fall-off is not positive inside the lens's field.
Result<void> divide_fall_off(RgbImage& radiance, const LensModel& lens, const FallOff& fall_off);

/// Integral of luminance times cosine over the half space before the lens: lx for a picture in cd m^-2.
double illuminance_at(const RgbImage& radiance, const LensModel& lens);

} // namespace daylit::calibration
