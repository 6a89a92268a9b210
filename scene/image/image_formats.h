#pragma once

// Images on disk. Files are hostile input: the size in the header is checked before anything is decoded, damaged files
// give an Error.

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/core/output_file.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit {

constexpr int kMaxImageSide = 32768;
constexpr std::size_t kMaxImageTexels = std::size_t{1} << 26; ///< a sky of 8192 x 4096 twice over

constexpr FileKind kPngKind{"a PNG picture", "\x89PNG\r\n\x1a\n"}, kExrKind{"an OpenEXR picture", "\x76\x2f\x31\x01"};

struct HdrFile {
  RgbImage radiance;                             ///< linear; Radiance EXPOSURE= lines are divided out
  std::map<std::string, std::string> attributes; ///< text attributes ("daylit:..." and others)
  std::vector<std::string> notes{};              ///< for people: what was read in another way than it stands there
};

/// EXR (R, G, B or Y, half or float, scan-line or tiled) or Radiance .hdr/.pic, chosen by content, not by name.
Result<HdrFile> read_hdr_image(const std::filesystem::path& path);
/// The same from memory; `name` only appears in errors.
Result<HdrFile> read_hdr_image(std::span<const std::uint8_t> bytes, const std::string& name);

/// 32-bit float RGB EXR (PIZ or ZIP, never DWA), written whole or not at all.
Result<void> write_exr(const std::filesystem::path& path, const RgbImage& image,
                       const std::map<std::string, std::string>& attributes = {});

/// 8-bit image as stored (no transfer function applied). Row-major RGB triples.
struct Rgb8Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bytes; ///< 3 * width * height
};
/// PNG (8/16 bit, grey or colour; 16 bit reduced to 8) or baseline/progressive JPEG, chosen by content.
Result<Rgb8Image> read_ldr_image(const std::filesystem::path& path);
Result<Rgb8Image> read_ldr_image(std::span<const std::uint8_t> bytes, const std::string& name);
Result<void> write_png(const std::filesystem::path& path, const Rgb8Image& image);
/// The bytes of such a file.
Result<std::vector<std::uint8_t>> png_bytes(const Rgb8Image& image);

/// The bytes of such files. Error value_invalid: an empty picture.
Result<std::vector<std::uint8_t>> encoded_png(const Rgb8Image& image);
Result<std::vector<std::uint8_t>> encoded_exr(const RgbImage& image);
/// Baseline JPEG, colour at half resolution. `quality`: libjpeg's, 1 to 100.
Result<std::vector<std::uint8_t>> encoded_jpeg(const Rgb8Image& image, int quality = 85);

/// sRGB transfer function (IEC 61966-2-1), per channel, v and result in 0..1.
float srgb_encode(float linear);
float srgb_decode(float encoded);
/// Linear radiance times `exposure`, clipped to 0..1, sRGB-encoded, rounded: the preview of an HDR image.
Rgb8Image to_srgb8(const RgbImage& image, float exposure);

} // namespace daylit
