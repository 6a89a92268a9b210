#pragma once

// A depth picture of a camera (RGB-D, stereo, lidar turned into the camera's view), on disk and in memory.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

/// Distance of what each pixel shows from the camera, along its optical axis (not along the ray). Row-major.
struct DepthPicture {
  int width = 0, height = 0;
  std::vector<float> z_m; ///< metres; 0: a hole, nothing was measured

  float at(int x, int y) const {
    return z_m[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  bool operator==(const DepthPicture&) const = default;
};

constexpr double kDepthUnit_m = 0.001; ///< of a 16-bit PNG, where nothing else is said

/// A grey PNG of 16 bits, whose numbers count `unit_m` metres; or an EXR (half or float; channel Z, else Y, else R,
/// else the only one), whose numbers are metres. Numbers that are not above 0, or not below 1e9, become holes. Errors:
/// missing, damaged, another kind of picture.
Result<DepthPicture> read_depth_picture(const std::filesystem::path& path, double unit_m = kDepthUnit_m);
/// Error value_invalid: not as large as a photograph of that size nor a whole fraction of it, alike in both directions.
Result<void> check_depth_size(const DepthPicture& depth, int photo_width_px, int photo_height_px,
                              const std::string& name);
/// As `path` ends: ".png", millimetres; else an EXR, metres. What does not fit into 16 bits becomes a hole. Error
/// value_invalid: an empty picture.
Result<void> write_depth_picture(const std::filesystem::path& path, const DepthPicture& depth);

} // namespace daylit
