#include "calibration/hand_held_list.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>

#include "calibration/code_picture.h"
#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"
#include "scene/lens/orientation.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::size_t kMostBytes = std::size_t{1} << 22;

/// The numbers of a line after the picture's name; nothing where one is none.
std::optional<std::vector<double>> numbers_of(std::istringstream& words) {
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    const auto number = word == "-" && numbers.empty() ? std::optional(0.0) : parse_number(word);
    if (!number || !std::isfinite(*number) || (numbers.empty() && word != "-" && !(*number > 0)))
      return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<glm::dmat3> orientation_of(const std::vector<double>& n) {
  if (n.size() == 4)
    return camera_orientation(n[1] * kDegree, n[2] * kDegree, n[3] * kDegree);
  const glm::dquat q(n[4], n[1], n[2], n[3]);
  const double length = glm::length(q);
  return std::abs(length - 1.0) < 1e-2 ? std::optional(glm::mat3_cast(q / length)) : std::nullopt;
}

/// Mean of blocks; a block with a saturated texel is saturated.
void reduce(const RgbImage& code, const ResponseCurve& response, int block, HandHeldPicture& out) {
  out.light = RgbImage(code.width / block, code.height / block);
  out.usable.assign(out.light.texels.size(), 1);
  for (int y = 0; y < out.light.height; ++y)
    for (int x = 0; x < out.light.width; ++x) {
      Rgb sum(0.0f);
      bool full = false;
      for (int v = 0; v < block; ++v)
        for (int u = 0; u < block; ++u) {
          const Rgb& texel = code.at(x * block + u, y * block + v);
          full = full || std::max({texel.r, texel.g, texel.b}) >= kFull;
          for (int c = 0; c < 3; ++c)
            sum[c] += response.exposure(texel[c], c);
        }
      out.light.at(x, y) = sum / static_cast<float>(block * block);
      out.usable[static_cast<std::size_t>(y) * out.light.width + x] = full ? 0 : 1;
    }
}

} // namespace

Result<std::vector<ListedPicture>> read_picture_list(const std::filesystem::path& list) {
  const auto bytes = read_whole_file(list, kMostBytes);
  if (!bytes)
    return bytes.error();
  std::vector<ListedPicture> pictures;
  std::istringstream lines(std::string(bytes->begin(), bytes->end()));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    std::string name;
    if (!(words >> name))
      continue;
    const auto numbers = numbers_of(words);
    const bool complete = numbers && (numbers->size() == 4 || numbers->size() == 5);
    const auto orientation = complete ? orientation_of(*numbers) : std::nullopt;
    if (!orientation)
      return Error{ErrorCode::file_malformed, "no picture with its exposure and orientation",
                   fmt::format("{}, line {}", list.string(), number),
                   "PICTURE EXPOSURE AZIMUTH ALTITUDE ROLL, degrees, or PICTURE EXPOSURE QX QY QZ QW; - as exposure: "
                   "from the EXIF part"};
    pictures.push_back({list.parent_path() / name, (*numbers)[0], *orientation});
  }
  if (pictures.empty())
    return Error{ErrorCode::value_invalid, "lists no picture", list.string(),
                 "a line PICTURE EXPOSURE AZIMUTH ALTITUDE ROLL for each"};
  return pictures;
}

/// The lens of the reduced picture: pixel centres are whole numbers on either side.
Result<HandHeldPicture> read_hand_held(const ListedPicture& listed, const LensModel& lens,
                                       const ResponseCurve& response) {
  const auto read = read_code_picture(listed.path);
  if (!read)
    return read.error();
  HandHeldPicture picture;
  picture.file = read->file;
  picture.world_from_camera = listed.world_from_camera;
  picture.exposure = listed.exposure > 0 ? listed.exposure : read->exif.time_s;
  if (!(picture.exposure > 0))
    return Error{ErrorCode::value_invalid, "tells no exposure time", listed.path.string(),
                 "write it into the list, in place of -"};
  const int width = read->code.width, height = read->code.height;
  if (lens.width_px > 0 && (width != lens.width_px || height != lens.height_px))
    return Error{
        ErrorCode::value_invalid,
        fmt::format("is {} x {} pixels, the lens file is for {} x {}", width, height, lens.width_px, lens.height_px),
        listed.path.string(), "one lens file, and pictures of its size"};
  const int block = std::max(1, (std::max(width, height) + kWorkingSide - 1) / kWorkingSide);
  reduce(read->code, response, block, picture);
  picture.lens = lens;
  picture.lens.width_px = picture.light.width;
  picture.lens.height_px = picture.light.height;
  picture.lens.fx /= block;
  picture.lens.fy /= block;
  picture.lens.cx = (lens.cx + 0.5) / block - 0.5;
  picture.lens.cy = (lens.cy + 0.5) / block - 0.5;
  return picture;
}

} // namespace daylit::calibration
