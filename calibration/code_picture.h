#pragma once

// Pictures as the camera stored them: code values, and the exposure that the file tells.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/frames/frame.h"
#include "capture/hdr/response_curve.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit::calibration {

/// What the EXIF part of a photograph says of its exposure; 0: nothing.
struct ExifExposure {
  double time_s = 0.0, f_number = 0.0, iso = 0.0;
};

struct CodePicture {
  std::string file; ///< without its folder
  RgbImage code;    ///< code values as fractions of the largest; of an HDR picture its radiance
  int bits = 8;     ///< of a code value; 32 of an HDR picture
  ExifExposure exif;
  bool raw = false; ///< of a Bayer mosaic
};

/// PNG, TIFF, PGM and PPM of 8 or 16 bits, JPEG, and linear HDR pictures (EXR, Radiance), chosen by content. `mosaic`:
/// what a picture with one channel is; not given: grey.
Result<CodePicture> read_code_picture(const std::filesystem::path& path, Mosaic mosaic = Mosaic::mono);

/// `response`: of the option, empty where it was not given. Error value_invalid: not given, and the codes may stand for
/// anything: 8 bits, and not raw.
Result<void> check_response_given(const CodePicture& picture, const std::string& response);

/// Error value_invalid: a grey picture whose every second pixel is far brighter than its neighbours all over, a Bayer
/// mosaic that was read as grey.
Result<void> check_mosaic_given(const CodePicture& picture);

/// The curve of that name; linear where none was given.
Result<ResponseCurve> response_or_linear(const std::string& response);

/// Of a JPEG photograph; zeros where the file says nothing, or is of another kind.
Result<ExifExposure> read_exif(const std::filesystem::path& path);

/// The luminance, cd m^-2, that a code of 1 stands for in a photograph: 87 N^2 / (t S), with f-number N, exposure time
/// t in seconds and ISO speed S, as Radiance's hdrgen takes it; right to about a third without a calibration. Nothing
/// where the file does not say all three.
std::optional<double> full_scale_luminance(const ExifExposure& exif);

/// 8-bit view for reports, sRGB-encoded where the codes are `linear`.
Rgb8Image view_of(const RgbImage& code, bool linear);

} // namespace daylit::calibration
