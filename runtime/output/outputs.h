#pragma once

// What daylit-run shows and writes of a composite.

#include "runtime/composite/compose.h"
#include "runtime/input/photograph.h"
#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

/// The picture in 8 bits, every pixel through the photograph's response; of a linear photograph a preview, exposed so
/// that its brightest hundredth is white.
Rgb8Image view_of(const Photograph& photo, const RgbImage& picture);

/// Error value_invalid: `size` is more than four times as wide as the picture, or would stretch it by more than 1 %.
Result<void> check_output_size(const OutputConfig& output, int picture_width_px, int picture_height_px);

/// As it is shown on a screen and in a PNG of the photograph's own size: where nothing changed the photograph's bytes.
Result<Rgb8Image> view_of(const Photograph& photo, const Composite& composite);

/// Call when all inputs have been read. Errors: of check_output(), and two outputs of one name.
Result<void> check_outputs(const OutputConfig& output, bool force);

/// The outputs of frame `index` of a sequence: picture.png is picture-00042.png.
OutputConfig numbered(const OutputConfig& output, std::size_t index);

/// [output] png, exr and mask, those that are named, in [output] size: resampled by area in linear light. In the
/// picture's own size the PNG holds the photograph's own bytes where nothing changed.
Result<void> write_outputs(const OutputConfig& output, const Photograph& photo, const Composite& composite);

} // namespace daylit
