#include "scene/image/image_formats.h"

#include <algorithm>
#include <cmath>

#include "scene/core/atomic_file.h"
#include "scene/core/read_file.h"
#include "scene/image/image_codecs.h"

namespace daylit {

namespace detail {

namespace {
constexpr std::size_t kAlwaysPlausibleTexels = std::size_t{1} << 22;
constexpr std::size_t kMaxPackingRatio = 2048;
} // namespace

std::optional<Error> check_image_size(long long width, long long height, std::size_t bytes_per_texel,
                                      std::size_t file_bytes, const std::string& name) {
  const std::string size = std::to_string(width) + " x " + std::to_string(height);
  if (width <= 0 || height <= 0)
    return Error{ErrorCode::file_malformed, "image size " + size + " is not positive", name, "export the image again"};
  if (width > kMaxImageSide || height > kMaxImageSide ||
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height) > kMaxImageTexels)
    return Error{ErrorCode::limit_exceeded,
                 "image size " + size + " is above the limit of 32768 per side and 2^26 (67,108,864) pixels", name,
                 "scale the image down"};
  const std::size_t texels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (texels > kAlwaysPlausibleTexels && texels * bytes_per_texel / kMaxPackingRatio > file_bytes)
    return damaged_file(name, "the header claims " + size + " pixels, but the file holds only " +
                                  std::to_string(file_bytes) + " bytes");
  return std::nullopt;
}

Error damaged_file(const std::string& name, const std::string& what) {
  return {ErrorCode::file_malformed, what, name, "the file is truncated or damaged: copy or export it again"};
}

} // namespace detail

Result<HdrFile> read_hdr_image(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path);
  if (!bytes)
    return bytes.error();
  return read_hdr_image(*bytes, path.string());
}

Result<HdrFile> read_hdr_image(std::span<const std::uint8_t> bytes, const std::string& name) {
  if (detail::is_exr(bytes))
    return detail::decode_exr(bytes, name);
  if (detail::is_rgbe(bytes))
    return detail::decode_rgbe(bytes, name);
  if (detail::is_png(bytes) || detail::is_jpeg(bytes))
    return Error{ErrorCode::file_malformed, "an 8-bit image where linear radiance is needed", name,
                 "use the OpenEXR or Radiance .hdr version of the image"};
  return Error{ErrorCode::file_malformed, "neither an OpenEXR nor a Radiance .hdr file", name,
               "check the path, or export the image as EXR"};
}

Result<void> write_exr(const std::filesystem::path& path, const RgbImage& image,
                       const std::map<std::string, std::string>& attributes) {
  const auto bytes = detail::encode_exr(image, attributes);
  if (!bytes) {
    Error error = bytes.error();
    error.where = path.string();
    return error;
  }
  const std::span<const std::byte> part = std::as_bytes(std::span(*bytes));
  return write_file_atomically(path, std::span(&part, 1));
}

Result<Rgb8Image> read_ldr_image(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, std::size_t{1} << 30);
  if (!bytes)
    return bytes.error();
  return read_ldr_image(*bytes, path.string());
}

Result<Rgb8Image> read_ldr_image(std::span<const std::uint8_t> bytes, const std::string& name) {
  if (detail::is_png(bytes))
    return detail::decode_png(bytes, name);
  if (detail::is_jpeg(bytes))
    return detail::decode_jpeg(bytes, name);
  return Error{ErrorCode::file_malformed, "neither a PNG nor a JPEG file", name,
               "check the path, or export the image as PNG"};
}

Result<std::vector<std::uint8_t>> encoded_png(const Rgb8Image& image) { return detail::encode_png(image, "picture"); }
Result<std::vector<std::uint8_t>> encoded_exr(const RgbImage& image) { return detail::encode_exr(image, {}); }

Result<void> write_png(const std::filesystem::path& path, const Rgb8Image& image) {
  const auto bytes = detail::encode_png(image, path.string());
  if (!bytes)
    return bytes.error();
  const std::span<const std::byte> part = std::as_bytes(std::span(*bytes));
  return write_file_atomically(path, std::span(&part, 1));
}

Result<std::vector<std::uint8_t>> png_bytes(const Rgb8Image& image) { return detail::encode_png(image, "picture"); }

float srgb_encode(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float srgb_decode(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Rgb8Image to_srgb8(const RgbImage& image, float exposure) {
  Rgb8Image out{image.width, image.height, std::vector<std::uint8_t>(3 * image.texels.size())};
  for (std::size_t i = 0; i < image.texels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const float linear = image.texels[i][c] * exposure;
      const float clipped = linear > 0.0f ? std::min(linear, 1.0f) : 0.0f; // NaN becomes black
      out.bytes[3 * i + c] = static_cast<std::uint8_t>(std::lround(255.0f * srgb_encode(clipped)));
    }
  return out;
}

} // namespace daylit
