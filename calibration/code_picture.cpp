#include "calibration/code_picture.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include <libexif/exif-data.h>
#include <opencv2/imgcodecs.hpp>

#include "scene/core/read_file.h"
#include "scene/image/image_formats.h"

namespace daylit::calibration {

namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;
constexpr double kHdrgenLuminance = 87.0;
constexpr double kMosaic = 1.1; ///< light of the brightest over the darkest of four interlaced grids of pixels

double rational_of(ExifData* data, ExifTag tag) {
  const ExifEntry* entry = exif_content_get_entry(data->ifd[EXIF_IFD_EXIF], tag);
  if (!entry || !entry->data)
    return 0.0;
  const ExifByteOrder order = exif_data_get_byte_order(data);
  if (entry->format == EXIF_FORMAT_SHORT && entry->size >= 2)
    return exif_get_short(entry->data, order);
  if (entry->format == EXIF_FORMAT_RATIONAL && entry->size >= 8) {
    const ExifRational r = exif_get_rational(entry->data, order);
    return r.denominator > 0 ? static_cast<double>(r.numerator) / r.denominator : 0.0;
  }
  return 0.0;
}

ExifExposure exif_of(const std::vector<std::uint8_t>& bytes) {
  const std::unique_ptr<ExifData, decltype(&exif_data_unref)> data(
      exif_data_new_from_data(bytes.data(), static_cast<unsigned>(bytes.size())), exif_data_unref);
  if (!data)
    return {};
  return {rational_of(data.get(), EXIF_TAG_EXPOSURE_TIME), rational_of(data.get(), EXIF_TAG_FNUMBER),
          rational_of(data.get(), EXIF_TAG_ISO_SPEED_RATINGS)};
}

RgbImage fractions_of(const Rgb8Image& picture) {
  RgbImage code(picture.width, picture.height);
  for (std::size_t i = 0; i < code.texels.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      code.texels[i][static_cast<int>(c)] = static_cast<float>(picture.bytes[3 * i + c]) / 255.0f;
  return code;
}

bool starts_with(const std::vector<std::uint8_t>& bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

/// Decoded by OpenCV: what scene/image does not read, with all of its bits.
Result<CameraFrame> decode_samples(const std::vector<std::uint8_t>& bytes, Mosaic mosaic, const std::string& name) {
  cv::Mat picture;
  try {
    picture = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    picture.release();
  }
  const int channels = picture.empty() ? 0 : picture.channels();
  if (channels != 1 && channels != 3 && channels != 4)
    return Error{ErrorCode::file_malformed, "no picture that can be read: PNG, JPEG, TIFF, PGM, PPM, EXR or .hdr", name,
                 "the file is damaged, or of another kind: export it again"};
  if (picture.depth() != CV_8U && picture.depth() != CV_16U)
    return Error{ErrorCode::file_malformed, "code values of neither 8 nor 16 bits", name, "export it with 16 bits"};
  CameraFrame frame;
  frame.width_px = picture.cols;
  frame.height_px = picture.rows;
  frame.format = {channels == 1 ? mosaic : Mosaic::rgb, picture.depth() == CV_8U ? 8 : 16};
  const std::size_t sample = picture.elemSize1();
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      for (int c = 0; c < std::min(channels, 3); ++c) { // OpenCV has blue first
        const std::uint8_t* at =
            picture.ptr(y) + (static_cast<std::size_t>(x) * channels + (channels == 1 ? 0 : 2 - c)) * sample;
        frame.bytes.insert(frame.bytes.end(), at, at + sample);
      }
  return frame;
}

constexpr std::size_t kPngDepth = 24; ///< offset of the bit depth in a PNG file

} // namespace

Result<CodePicture> read_code_picture(const std::filesystem::path& path, Mosaic mosaic) {
  const auto bytes = read_whole_file(path, kMostBytes);
  if (!bytes)
    return bytes.error();
  CodePicture picture{.file = path.filename().string(), .code = {}, .exif = {}};
  const bool png = starts_with(*bytes, "\x89PNG"), jpeg = starts_with(*bytes, "\xff\xd8\xff");
  if (starts_with(*bytes, kExrKind.start) || starts_with(*bytes, "#?")) {
    auto hdr = read_hdr_image(*bytes, path.string());
    if (!hdr)
      return hdr.error();
    picture.code = std::move(hdr->radiance);
    picture.bits = 32;
  } else if (jpeg || (png && bytes->size() > kPngDepth && (*bytes)[kPngDepth] <= 8 && mosaic == Mosaic::mono)) {
    const auto stored = read_ldr_image(*bytes, path.string());
    if (!stored)
      return stored.error();
    picture.code = fractions_of(*stored);
    if (jpeg)
      picture.exif = exif_of(*bytes);
  } else {
    const auto frame = decode_samples(*bytes, mosaic, path.string());
    if (!frame)
      return frame.error();
    auto code = linear_picture(*frame);
    if (!code)
      return code.error();
    picture.code = std::move(*code);
    picture.bits = frame->format.bits;
    picture.raw = frame->format.mosaic != Mosaic::mono && frame->format.mosaic != Mosaic::rgb;
  }
  return picture;
}

Result<void> check_response_given(const CodePicture& picture, const std::string& response) {
  if (!response.empty() || picture.bits > 8 || picture.raw)
    return {};
  return Error{ErrorCode::value_invalid, "codes of 8 bits, not light: what they stand for is not known", picture.file,
               "give --response srgb, a file that `daylit-calibrate response` wrote, or linear if they are raw"};
}

Result<void> check_mosaic_given(const CodePicture& picture) {
  double sum[4] = {};
  for (int y = 0; y + 1 < picture.code.height; y += 2)
    for (int x = 0; x + 1 < picture.code.width; x += 2)
      for (int k = 0; k < 4; ++k) {
        const Rgb& code = picture.code.at(x + k % 2, y + k / 2);
        if (code.r != code.g || code.g != code.b)
          return {};
        sum[k] += static_cast<double>(code.g);
      }
  if (*std::ranges::max_element(sum) <= kMosaic * *std::ranges::min_element(sum))
    return {};
  return Error{ErrorCode::value_invalid,
               "looks like a Bayer mosaic: neighbouring pixels differ in the same way all over", picture.file,
               "give --mosaic rggb, grbg, gbrg or bggr, as the camera's data sheet says"};
}

Result<ResponseCurve> response_or_linear(const std::string& response) {
  return ResponseCurve::named(response.empty() ? "linear" : response);
}

Result<ExifExposure> read_exif(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, kMostBytes);
  if (!bytes)
    return bytes.error();
  return starts_with(*bytes, "\xff\xd8\xff") ? exif_of(*bytes) : ExifExposure{};
}

std::optional<double> full_scale_luminance(const ExifExposure& e) {
  if (!(e.time_s > 0.0 && e.f_number > 0.0 && e.iso > 0.0))
    return std::nullopt;
  return kHdrgenLuminance * e.f_number * e.f_number / (e.time_s * e.iso);
}

Rgb8Image view_of(const RgbImage& code, bool linear) {
  if (linear)
    return to_srgb8(code, 1.0f);
  Rgb8Image view{code.width, code.height, {}};
  view.bytes.reserve(3 * code.texels.size());
  for (const Rgb& texel : code.texels)
    for (int c = 0; c < 3; ++c)
      view.bytes.push_back(static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(texel[c], 0.0f, 1.0f))));
  return view;
}

} // namespace daylit::calibration
