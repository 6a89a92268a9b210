#include "runtime/input/photograph.h"

#include "capture/markers/find_markers.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

#include "scene/core/read_file.h"

namespace daylit {

namespace {

constexpr std::uint8_t kTopCode = 255;

Result<Photograph> read_hdr_photograph(const std::vector<std::uint8_t>& bytes, const std::string& name,
                                       const std::string& response) {
  auto file = read_hdr_image(bytes, name);
  if (!file)
    return file.error();
  std::size_t bad = 0, first = 0;
  for (std::size_t i = 0; i < file->radiance.texels.size(); ++i) {
    const Rgb& t = file->radiance.texels[i];
    if (std::isfinite(t.r) && std::isfinite(t.g) && std::isfinite(t.b))
      continue;
    first = bad++ == 0 ? i : first;
  }
  const std::size_t width = static_cast<std::size_t>(file->radiance.width);
  if (bad > 0)
    return Error{ErrorCode::value_invalid, std::to_string(bad) + " pixels are NaN or infinite",
                 name + ", first at pixel (" + std::to_string(first % width) + ", " + std::to_string(first / width) +
                     ")",
                 "re-export the picture as 32-bit float"};
  if (response != "linear")
    return Error{ErrorCode::value_invalid, "an EXR or .hdr picture is linear, the response \"" + response + "\" is not",
                 name, "set [interior] response = \"linear\", or give the 8-bit picture"};
  return Photograph{std::move(file->radiance), {}, ResponseCurve::linear()};
}

bool is_hdr_file(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() >= 4 && ((bytes[0] == 0x76 && bytes[1] == 0x2f && bytes[2] == 0x31 && bytes[3] == 0x01) ||
                               (bytes[0] == '#' && bytes[1] == '?'));
}

} // namespace

Result<Photograph> read_photograph(const std::filesystem::path& path, const std::string& response) {
  const auto bytes = read_whole_file(path, std::size_t{1} << 31);
  if (!bytes)
    return bytes.error();
  if (is_hdr_file(*bytes))
    return read_hdr_photograph(*bytes, path.string(), response);
  auto curve = ResponseCurve::named(response);
  if (!curve)
    return curve.error();
  auto image = read_ldr_image(*bytes, path.string());
  if (!image)
    return image.error();
  return Photograph{{}, std::move(*image), *curve};
}

bool Photograph::is_saturated(std::size_t pixel) const {
  return !is_hdr() && std::any_of(&original.bytes[3 * pixel], &original.bytes[3 * pixel] + 3,
                                  [](std::uint8_t code) { return code == kTopCode; });
}

std::size_t Photograph::saturated_pixels() const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < original.bytes.size() / 3; ++i)
    count += is_saturated(i) ? 1 : 0;
  return count;
}

Rgb8Image encode_picture(const ResponseCurve& response, const RgbImage& picture) {
  Rgb8Image out{picture.width, picture.height, std::vector<std::uint8_t>(3 * picture.texels.size())};
  for (std::size_t i = 0; i < picture.texels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      out.bytes[3 * i + static_cast<std::size_t>(c)] = response.encode(picture.texels[i][c], c);
  return out;
}

Result<Rgb8Image> encode_photograph(const Photograph& photo, const RgbImage& changed,
                                    const std::vector<std::uint8_t>& touched) {
  const PhotoPixels pixels = photo.pixels();
  if (changed.width != pixels.width() || changed.height != pixels.height() || touched.size() != pixels.size())
    return Error{ErrorCode::value_invalid, "the changed picture has another size than the photograph", "", ""};
  if (photo.is_hdr())
    return encode_picture(photo.response, changed);
  Rgb8Image out = photo.original;
  for (std::size_t i = 0; i < touched.size(); ++i)
    for (int c = 0; c < 3 && touched[i] != 0; ++c)
      out.bytes[3 * i + static_cast<std::size_t>(c)] = photo.response.encode(changed.texels[i][c], c);
  return out;
}

Rgb8Image marker_search_image(const Photograph& photo, float white) {
  if (!photo.is_hdr())
    return photo.original;
  if (white > 0)
    return to_srgb8(photo.linear, 1.0f / white);
  std::vector<float> brightness;
  brightness.reserve(photo.linear.texels.size());
  for (const Rgb& t : photo.linear.texels)
    brightness.push_back(luminance(t));
  const auto p95 = brightness.begin() + static_cast<std::ptrdiff_t>(brightness.size() * 95 / 100);
  std::nth_element(brightness.begin(), p95, brightness.end());
  return to_srgb8(photo.linear, *p95 > 0 ? 1.0f / *p95 : 1.0f);
}

/// 98th percentile in boxes around the squares, larger by kMargin of their size on each side: the paper.
float white_around(const Photograph& photo, const std::vector<SeenMarker>& seen) {
  constexpr double kMargin = 0.15;
  std::vector<float> brightness;
  for (const SeenMarker& marker : seen) {
    glm::dvec2 low = marker.corner_px[0], high = low;
    for (const glm::dvec2& p : marker.corner_px)
      low = glm::min(low, p), high = glm::max(high, p);
    const glm::dvec2 margin = kMargin * (high - low), last(photo.linear.width - 1, photo.linear.height - 1);
    const glm::ivec2 from(glm::clamp(low - margin, glm::dvec2(0.0), last)),
        to(glm::clamp(high + margin, glm::dvec2(0.0), last));
    for (int y = from.y; y <= to.y && photo.is_hdr(); ++y)
      for (int x = from.x; x <= to.x; ++x)
        brightness.push_back(luminance(photo.linear.at(x, y)));
  }
  if (brightness.empty())
    return 0;
  const auto p98 = brightness.begin() + static_cast<std::ptrdiff_t>(brightness.size() * 98 / 100);
  std::nth_element(brightness.begin(), p98, brightness.end());
  return *p98;
}

Result<Rgb8Image> picture_of_markers(const Photograph& photo, const std::string& dictionary) {
  Rgb8Image picture = marker_search_image(photo);
  if (!photo.is_hdr())
    return picture;
  const auto seen = find_markers(picture, dictionary);
  if (!seen)
    return seen.error();
  const float white = white_around(photo, *seen);
  return white > 0 ? marker_search_image(photo, white) : picture;
}

double marker_search_exponent(const Photograph& photo, const std::string& response) {
  return !photo.is_hdr() && response == "linear" ? kLinearExponent : kPhotographExponent;
}

} // namespace daylit
