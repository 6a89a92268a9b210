#pragma once

// Linear light as the file of a camera.

#include <filesystem>
#include <string>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit {

enum class PictureFormat { jpeg, png, exr };

inline const char* extension_of(PictureFormat format) {
  return format == PictureFormat::jpeg ? ".jpg" : format == PictureFormat::png ? ".png" : ".exr";
}

/// 8-bit sRGB codes of values 0..1, or with exr the linear values, clipped to 0..1 too.
Result<void> write_camera_file(const std::filesystem::path& path, const RgbImage& light, PictureFormat format);

} // namespace daylit
