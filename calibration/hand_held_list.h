#pragma once

// Pictures of all directions, taken by hand: their list file, and the pictures themselves as linear light.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/mat3x3.hpp>

#include "capture/hdr/response_curve.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

struct ListedPicture {
  std::filesystem::path path;
  double exposure = 0.0;             ///< 0: what the photograph's EXIF part says
  glm::dmat3 world_from_camera{1.0}; ///< roughly; camera frame x right, y down, z forward
};

/// A line `picture exposure azimuth altitude roll` each, angles in degrees as camera_orientation() takes them, or
/// `picture exposure qx qy qz qw`, a quaternion world_from_camera; '-' as exposure: from the EXIF part. '#' starts a
/// comment. Pictures are named beside the list. Error: file, line, what is wrong there.
Result<std::vector<ListedPicture>> read_picture_list(const std::filesystem::path& list);

struct HandHeldPicture {
  std::string file;
  RgbImage light;                    ///< exposure: 1 is full scale; at most kWorkingSide pixels
  std::vector<std::uint8_t> usable;  ///< 0: saturated, or beside what is
  LensModel lens;                    ///< of `light`
  double exposure = 1.0;             ///< stated; radiance = light / exposure
  glm::dmat3 world_from_camera{1.0}; ///< rough at first
};

inline constexpr int kWorkingSide = 1000; ///< pixels, longest side that is worked with
inline constexpr float kFull = 0.98f;     ///< of the largest code: saturated from here on

/// Larger pictures are reduced to means of blocks, in linear light. Errors of the readers; another size than the
/// lens's.
Result<HandHeldPicture> read_hand_held(const ListedPicture& listed, const LensModel& lens,
                                       const ResponseCurve& response);

} // namespace daylit::calibration
