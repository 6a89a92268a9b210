#include "calibration/bracket_files.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"

namespace daylit::calibration {

namespace {

constexpr float kEdge = 0.1f; ///< spread of 3 x 3 codes that shows an edge
constexpr float kSaturated = 0.98f;
constexpr float kDark = 0.06f, kBright = 0.94f;
constexpr std::size_t kFewest = 50;
constexpr double kSameTime = 1.02;
constexpr std::size_t kMostListBytes = std::size_t{1} << 20;

Error no_time(const std::filesystem::path& path) {
  return {ErrorCode::value_invalid, "the exposure time is not known", path.string(),
          "give --exposures T1,T2,... in seconds, in the order of the pictures, or --exposure-list FILE"};
}

Result<std::map<std::string, double>> read_list(const std::filesystem::path& list) {
  const auto bytes = read_whole_file(list, kMostListBytes);
  if (!bytes)
    return bytes.error();
  std::map<std::string, double> times;
  const std::string text(bytes->begin(), bytes->end());
  TextLines lines(text);
  for (std::string_view line; lines.next(line);) {
    line = line.substr(0, line.find('#'));
    const std::string name(take_word(line));
    if (name.empty())
      continue;
    const auto time = parse_number(take_word(line));
    if (!time || !(*time > 0) || !std::isfinite(*time))
      return Error{ErrorCode::value_invalid, "no positive exposure time after the file name",
                   list.string() + ", line " + std::to_string(lines.number()), "a file name and seconds on each line"};
    if (const auto said = times.find(name); said != times.end() && said->second != *time)
      return Error{ErrorCode::value_invalid, "another time for " + name + ", which was listed before",
                   list.string() + ", line " + std::to_string(lines.number()), "remove one of the two lines"};
    times[name] = *time;
  }
  return times;
}

/// From the EXIF parts: luminances where all files say all of it, else seconds.
Result<void> set_exif_times(BracketFiles& bracket) {
  std::vector<ExifExposure> exif;
  for (const BracketFile& f : bracket.file) {
    const auto read = read_exif(f.path);
    if (!read)
      return read.error();
    exif.push_back(*read);
  }
  bracket.luminance = std::ranges::all_of(exif, [](const auto& e) { return full_scale_luminance(e).has_value(); });
  for (std::size_t i = 0; i < exif.size(); ++i) {
    bracket.file[i].time = bracket.luminance ? 1.0 / *full_scale_luminance(exif[i]) : exif[i].time_s;
    if (bracket.file.size() == 1 && !(bracket.file[i].time > 0))
      bracket.file[i].time = 1.0; // no bracket, whatever its time: that is what is said
    if (!(bracket.file[i].time > 0))
      return no_time(bracket.file[i].path);
  }
  return {};
}

} // namespace

std::size_t BracketFiles::different_times() const {
  std::size_t count = file.empty() ? 0 : 1;
  for (std::size_t i = 1; i < file.size(); ++i)
    count += file[i].time > kSameTime * file[i - 1].time ? 1 : 0;
  return count;
}

Result<BracketFiles> bracket_files(const std::vector<std::filesystem::path>& paths, const std::vector<double>& times,
                                   const std::filesystem::path& list) {
  BracketFiles bracket;
  for (const std::filesystem::path& path : paths)
    bracket.file.push_back({path, 0.0});
  if (!times.empty() && times.size() != paths.size())
    return Error{ErrorCode::usage,
                 std::to_string(times.size()) + " times for " + std::to_string(paths.size()) + " pictures",
                 "--exposures", "give one for each picture, in their order"};
  if (!list.empty()) {
    const auto named = read_list(list);
    if (!named)
      return named.error();
    for (BracketFile& f : bracket.file) {
      const auto found = named->find(f.path.filename().string());
      if (found == named->end())
        return no_time(f.path);
      f.time = found->second;
    }
  } else if (!times.empty()) {
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (!(times[i] > 0))
        return Error{ErrorCode::usage, "an exposure time is not positive", "--exposures", "seconds, as 0.001,0.064,4"};
      bracket.file[i].time = times[i];
    }
  } else if (const Result<void> set = set_exif_times(bracket); !set) {
    return set.error();
  }
  std::ranges::stable_sort(bracket.file, {}, &BracketFile::time);
  return bracket;
}

PlaceCodes place_codes(const CodePicture& picture, double time, const std::vector<std::uint8_t>& ignored) {
  PlaceCodes places{picture.file, time, {}};
  const RgbImage& image = picture.code;
  const double step = std::max(3.0, std::sqrt(static_cast<double>(image.width) * image.height / kPlaces));
  for (double y = step / 2; y < image.height - 1; y += step)
    for (double x = step / 2; x < image.width - 1; x += step) {
      Rgb low(1.0f), high(0.0f), sum(0.0f);
      bool whole = true;
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u) {
          const int px = static_cast<int>(x) + u, py = static_cast<int>(y) + v;
          const Rgb& code = image.at(px, py);
          low = {std::min(low.r, code.r), std::min(low.g, code.g), std::min(low.b, code.b)};
          high = {std::max(high.r, code.r), std::max(high.g, code.g), std::max(high.b, code.b)};
          sum += code / 9.0f;
          whole = whole && (ignored.empty() || !ignored[static_cast<std::size_t>(py) * image.width + px]);
        }
      for (int c = 0; c < 3; ++c)
        if (!whole || high[c] - low[c] > kEdge || high[c] >= kSaturated)
          sum[c] = -1.0f;
      places.code.push_back(sum);
    }
  return places;
}

std::vector<std::uint8_t> pixels_of_colour(const RgbImage& code, const std::optional<Rgb>& colour) {
  std::vector<std::uint8_t> mask;
  if (!colour)
    return mask;
  for (const Rgb& texel : code.texels) {
    const Rgb off = 255.0f * texel - *colour;
    mask.push_back(std::max({std::abs(off.r), std::abs(off.g), std::abs(off.b)}) < 0.5f);
  }
  return mask;
}

std::optional<double> measured_ratio(const PlaceCodes& shorter, const PlaceCodes& longer,
                                     const ResponseCurve& response) {
  std::vector<double> log_ratio;
  for (std::size_t i = 0; i < std::min(shorter.code.size(), longer.code.size()); ++i)
    for (int c = 0; c < 3; ++c) {
      const float a = shorter.code[i][c], b = longer.code[i][c], dark = response.black(c) + kDark;
      if (a > dark && a < kBright && b > dark && b < kBright)
        log_ratio.push_back(static_cast<double>(std::log(response.exposure(b, c) / response.exposure(a, c))));
    }
  if (log_ratio.size() < kFewest)
    return std::nullopt;
  const auto middle = log_ratio.begin() + static_cast<std::ptrdiff_t>(log_ratio.size() / 2);
  std::ranges::nth_element(log_ratio, middle);
  return std::exp(*middle);
}

} // namespace daylit::calibration
