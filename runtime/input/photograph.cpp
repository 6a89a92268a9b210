#include "runtime/input/photograph.h"

#include "capture/markers/find_markers.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "scene/core/read_file.h"

namespace daylit {

namespace {

constexpr std::uint8_t kTopCode = 255;

Error response_error(const std::string& what, const std::string& where) {
  return {ErrorCode::value_invalid, what, where, "256 lines, one number or three (R G B) each, never falling"};
}

/// The numbers of one line without its comment; false when something else stands there.
bool line_numbers(std::string_view line, std::vector<double>& out) {
  line = line.substr(0, line.find('#'));
  while (true) {
    const std::size_t begin = line.find_first_not_of(" \t\r,;");
    if (begin == std::string_view::npos)
      return true;
    line.remove_prefix(begin);
    double value = 0;
    const auto [end, code] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (code != std::errc() || !std::isfinite(value))
      return false;
    out.push_back(value);
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  }
}

} // namespace

CameraResponse CameraResponse::linear() {
  CameraResponse r;
  for (std::size_t code = 0; code < 256; ++code)
    for (auto& channel : r.exposure_)
      channel[code] = static_cast<float>(code) / 255.0f;
  return r;
}

CameraResponse CameraResponse::srgb() {
  CameraResponse r;
  for (std::size_t code = 0; code < 256; ++code)
    for (auto& channel : r.exposure_)
      channel[code] = srgb_decode(static_cast<float>(code) / 255.0f);
  return r;
}

Result<CameraResponse> CameraResponse::parse(const std::string& text, const std::string& name) {
  CameraResponse r;
  std::array<std::array<double, 256>, 3> value{};
  std::size_t code = 0, line_number = 0, begin = 0;
  std::vector<double> numbers;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string where = name + ", line " + std::to_string(++line_number);
    numbers.clear();
    if (!line_numbers(std::string_view(text).substr(begin, end - begin), numbers))
      return response_error("not a list of numbers", where);
    begin = end + 1;
    if (numbers.empty())
      continue;
    if (code == 256 || (numbers.size() != 1 && numbers.size() != 3))
      return response_error(code == 256 ? "more than 256 code values" : "neither one number nor three", where);
    for (std::size_t c = 0; c < 3; ++c) {
      value[c][code] = numbers[numbers.size() == 3 ? c : 0];
      if (value[c][code] < 0 || (code > 0 && value[c][code] < value[c][code - 1]))
        return response_error("the exposure is negative or falls", where);
    }
    ++code;
  }
  if (code != 256)
    return response_error(std::to_string(code) + " code values instead of 256", name);
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(value[c][255] > value[c][0] && value[c][255] < 1e30))
      return response_error("the response does not rise", name);
    for (std::size_t i = 0; i < 256; ++i)
      r.exposure_[c][i] = static_cast<float>(value[c][i] / value[c][255]);
  }
  return r;
}

Result<CameraResponse> CameraResponse::named(const std::string& name) {
  if (name == "linear")
    return linear();
  if (name == "srgb")
    return srgb();
  const auto bytes = read_whole_file(name, std::size_t{1} << 20);
  if (!bytes) {
    Error error = bytes.error();
    error.hint = "a response is \"linear\", \"srgb\" or the path of a response file";
    return error;
  }
  return parse(std::string(bytes->begin(), bytes->end()), name);
}

std::uint8_t CameraResponse::encode(float linear, int channel) const {
  const std::array<float, 256>& curve = exposure_[static_cast<std::size_t>(channel)];
  const auto above = std::lower_bound(curve.begin(), curve.end(), linear);
  if (above == curve.end())
    return kTopCode;
  if (above == curve.begin() || !(linear > 0.0f))
    return 0;
  const float low = *(above - 1), high = *above;
  const std::size_t code = static_cast<std::size_t>(above - curve.begin());
  return static_cast<std::uint8_t>(linear - low < high - linear ? code - 1 : code);
}

namespace {

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
  return Photograph{std::move(file->radiance), {}, CameraResponse::linear()};
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
  auto curve = CameraResponse::named(response);
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

Rgb8Image encode_picture(const CameraResponse& response, const RgbImage& picture) {
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

Rgb8Image marker_search_image(const Photograph& photo) {
  if (!photo.is_hdr())
    return photo.original;
  std::vector<float> brightness;
  brightness.reserve(photo.linear.texels.size());
  for (const Rgb& t : photo.linear.texels)
    brightness.push_back(luminance(t));
  const auto p95 = brightness.begin() + static_cast<std::ptrdiff_t>(brightness.size() * 95 / 100);
  std::nth_element(brightness.begin(), p95, brightness.end());
  return to_srgb8(photo.linear, *p95 > 0 ? 1.0f / *p95 : 1.0f);
}

double marker_search_exponent(const Photograph& photo, const std::string& response) {
  return !photo.is_hdr() && response == "linear" ? kLinearExponent : kPhotographExponent;
}

} // namespace daylit
