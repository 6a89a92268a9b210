#pragma once

// One decoder per file format, behind scene/image/image_formats.h. Every function takes the whole file in memory.

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/image/image_formats.h"

namespace daylit::detail {

using Bytes = std::span<const std::uint8_t>;

bool is_exr(Bytes bytes);
bool is_rgbe(Bytes bytes);
bool is_png(Bytes bytes);
bool is_jpeg(Bytes bytes);

/// What an EXR file is read for: channels R, G, B or Y; or one channel of depth, which all three then hold.
enum class ExrUse { radiance, depth };
Result<HdrFile> decode_exr(Bytes bytes, const std::string& name, ExrUse use = ExrUse::radiance);
Result<HdrFile> decode_rgbe(Bytes bytes, const std::string& name);
Result<Rgb8Image> decode_png(Bytes bytes, const std::string& name);
Result<Rgb8Image> decode_jpeg(Bytes bytes, const std::string& name);

/// Numbers of 16 bits, row by row.
struct Grey16Image {
  int width = 0, height = 0;
  std::vector<std::uint16_t> values;
};
/// Error file_malformed: a PNG of 8 bits, or in colour.
Result<Grey16Image> decode_png_grey16(Bytes bytes, const std::string& name);
/// `image`: not empty.
Result<std::vector<std::uint8_t>> encode_png_grey16(const Grey16Image& image, const std::string& name);

Result<std::vector<std::uint8_t>> encode_exr(const RgbImage& image,
                                             const std::map<std::string, std::string>& attributes);
Result<std::vector<std::uint8_t>> encode_png(const Rgb8Image& image, const std::string& name);

/// Refuses sizes that are not positive, above the limits, or that the file cannot hold: no codec read here packs more
/// than about 1,000:1, so a few bytes must not claim gigabytes. Called before anything of that size is allocated.
std::optional<Error> check_image_size(long long width, long long height, std::size_t bytes_per_texel,
                                      std::size_t file_bytes, const std::string& name);

/// The Error of a damaged file, in the words of all formats.
Error damaged_file(const std::string& name, const std::string& what);

} // namespace daylit::detail
