#pragma once

#include <optional>
#include <string>

#include "scene/lens/lens.h"

namespace daylit {

/// What a user is told of the lens of projection fisheye that is none; nothing of a fish-eye.
inline std::optional<std::string> sky_lens_note(const LensModel& lens) {
  if (lens.kind == LensKind::equidistant)
    return std::nullopt;
  return "the sky's lens file is of an ordinary camera, not of a fish-eye (distortion_model: equidistant): most of the "
         "sky is outside its picture; is it the interior camera's file?";
}

} // namespace daylit
