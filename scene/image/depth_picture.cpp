#include "scene/image/depth_picture.h"

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

#include "scene/core/atomic_file.h"
#include "scene/core/read_file.h"
#include "scene/image/image_codecs.h"

namespace daylit {

namespace {

constexpr double kFarthest_m = 1e9; // what renderers write where there is nothing is further

float depth_or_hole(double z_m) { return z_m > 0.0 && z_m < kFarthest_m ? static_cast<float>(z_m) : 0.0f; }

Result<DepthPicture> from_png(detail::Bytes bytes, const std::string& name, double unit_m) {
  const auto image = detail::decode_png_grey16(bytes, name);
  if (!image)
    return image.error();
  DepthPicture depth{image->width, image->height, {}};
  depth.z_m.reserve(image->values.size());
  for (const std::uint16_t number : image->values)
    depth.z_m.push_back(depth_or_hole(unit_m * number));
  return depth;
}

Result<DepthPicture> from_exr(detail::Bytes bytes, const std::string& name) {
  const auto file = detail::decode_exr(bytes, name, detail::ExrUse::depth);
  if (!file)
    return file.error();
  DepthPicture depth{file->radiance.width, file->radiance.height, {}};
  depth.z_m.reserve(file->radiance.texels.size());
  for (const Rgb& texel : file->radiance.texels)
    depth.z_m.push_back(depth_or_hole(static_cast<double>(texel.r)));
  return depth;
}

Result<std::vector<std::uint8_t>> png_of(const DepthPicture& depth, const std::string& name) {
  detail::Grey16Image image{depth.width, depth.height, {}};
  image.values.reserve(depth.z_m.size());
  for (const float z : depth.z_m) {
    const double number = std::round(static_cast<double>(z) / kDepthUnit_m);
    image.values.push_back(number <= 65535.0 ? static_cast<std::uint16_t>(number) : 0);
  }
  return detail::encode_png_grey16(image, name);
}

} // namespace

Result<DepthPicture> read_depth_picture(const std::filesystem::path& path, double unit_m) {
  const auto bytes = read_whole_file(path, std::size_t{1} << 30);
  if (!bytes)
    return bytes.error();
  if (detail::is_png(*bytes))
    return from_png(*bytes, path.string(), unit_m);
  if (detail::is_exr(*bytes))
    return from_exr(*bytes, path.string());
  return Error{ErrorCode::file_malformed, "neither a PNG nor an OpenEXR file", path.string(),
               "save depth as a grey PNG of 16 bits, or as an EXR in metres"};
}

Result<void> check_depth_size(const DepthPicture& depth, int width, int height, const std::string& name) {
  const bool whole = depth.width > 0 && depth.height > 0 && width % depth.width == 0 && height % depth.height == 0 &&
                     width / depth.width == height / depth.height;
  if (whole)
    return {};
  return Error{ErrorCode::value_invalid,
               "the depth picture is " + std::to_string(depth.width) + " x " + std::to_string(depth.height) +
                   ", the photograph " + std::to_string(width) + " x " + std::to_string(height),
               name,
               "register it to the photograph: the same lens, its size or a whole fraction of it (1/2, 1/3, ...)"};
}

Result<void> write_depth_picture(const std::filesystem::path& path, const DepthPicture& depth) {
  if (depth.z_m.empty())
    return Error{ErrorCode::value_invalid, "an empty depth picture cannot be written", path.string(), ""};
  if (path.extension() != ".png") {
    RgbImage image(depth.width, depth.height);
    for (std::size_t i = 0; i < depth.z_m.size(); ++i)
      image.texels[i] = Rgb(depth.z_m[i]);
    return write_exr(path, image);
  }
  const auto bytes = png_of(depth, path.string());
  if (!bytes)
    return bytes.error();
  const std::span<const std::byte> part = std::as_bytes(std::span(*bytes));
  return write_file_atomically(path, std::span(&part, 1));
}

} // namespace daylit
