#include "simulate/picture_file.h"

#include <array>
#include <span>

#include <glm/common.hpp>

#include "scene/core/atomic_file.h"
#include "scene/image/image_formats.h"

namespace daylit {

Result<void> write_camera_file(const std::filesystem::path& path, const RgbImage& light, PictureFormat format) {
  if (format == PictureFormat::exr) {
    RgbImage clipped = light;
    for (Rgb& texel : clipped.texels)
      texel = glm::clamp(texel, 0.0f, 1.0f);
    return write_exr(path, clipped);
  }
  const Rgb8Image codes = to_srgb8(light, 1.0f);
  const auto bytes = format == PictureFormat::png ? encoded_png(codes) : encoded_jpeg(codes, 95);
  if (!bytes)
    return bytes.error();
  const std::span<const std::byte> part = std::as_bytes(std::span(*bytes));
  return write_file_atomically(path, std::span(&part, 1));
}

} // namespace daylit
