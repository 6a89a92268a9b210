#pragma once

// The photographs of one exposure bracket: their exposure times, their order, and code values at the same places of
// all.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/code_picture.h"
#include "capture/hdr/response_curve.h"
#include "scene/core/program.h"

namespace daylit::calibration {

struct BracketFile {
  std::filesystem::path path;
  double time = 0.0; ///< of the exposure
};

struct BracketFiles {
  std::vector<BracketFile> file; ///< from the shortest exposure to the longest
  /// Times are in seconds; or, where every file says time, f-number and speed, such that code / time is a luminance in
  /// cd m^-2 (full_scale_luminance()).
  bool luminance = false;
  std::size_t different_times() const;
};

/// `times`: seconds, in the order of the paths; `list`: a text file with a file name and a time on each line. Both
/// empty: from the EXIF parts. Error value_invalid: a photograph without a time.
Result<BracketFiles> bracket_files(const std::vector<std::filesystem::path>& paths, const std::vector<double>& times,
                                   const std::filesystem::path& list);

/// Codes, fractions of the largest, at a regular grid of places. Means of 3 x 3 pixels; negative where these differ
/// much (an edge), where one is saturated, and where there is no picture.
struct PlaceCodes {
  std::string file;
  double time = 0.0;
  std::vector<Rgb> code;
};

inline constexpr std::size_t kPlaces = 4096; ///< about

/// `ignored` as in BracketMerger::add().
PlaceCodes place_codes(const CodePicture& picture, double time, const std::vector<std::uint8_t>& ignored);

/// One byte per pixel: whether it has exactly this colour, codes of 8 bits. Empty without a colour.
std::vector<std::uint8_t> pixels_of_colour(const RgbImage& code, const std::optional<Rgb>& colour);

/// Measured exposure of `longer` over that of `shorter`, of places that are well exposed in both; nothing where there
/// are too few.
std::optional<double> measured_ratio(const PlaceCodes& shorter, const PlaceCodes& longer,
                                     const ResponseCurve& response);

} // namespace daylit::calibration
