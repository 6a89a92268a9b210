#include "scene/lens/fall_off.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "scene/core/atomic_file.h"
#include "scene/core/parallel.h"
#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"

namespace daylit {

namespace {
constexpr std::size_t kMostBytes = 1 << 16;
constexpr std::size_t kMostCoefficients = 8;

Error bad_file(const std::string& what, const std::string& where) {
  return {ErrorCode::value_invalid, what, where, "one line: coefficients a1 a2 ..., of 1 + a1 t^2 + a2 t^4 + ..."};
}
} // namespace

double FallOff::at(double theta) const {
  double sum = 0;
  for (std::size_t k = coefficient.size(); k > 0; --k)
    sum = (sum + coefficient[k - 1]) * theta * theta;
  return 1.0 + sum;
}

Result<FallOff> read_fall_off(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, kMostBytes);
  if (!bytes)
    return bytes.error();
  const std::string text(bytes->begin(), bytes->end());
  FallOff fall_off;
  TextLines lines(text);
  for (std::string_view line; lines.next(line);) {
    line = line.substr(0, line.find('#'));
    const std::string where = path.string() + ", line " + std::to_string(lines.number());
    const std::string_view key = take_word(line);
    if (key.empty())
      continue;
    if (key != "coefficients" || !fall_off.coefficient.empty())
      return bad_file("something else than one line of coefficients", where);
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
      const auto number = parse_number(word);
      if (!number || !std::isfinite(*number) || fall_off.coefficient.size() == kMostCoefficients)
        return bad_file("not 1 to 8 numbers", where);
      fall_off.coefficient.push_back(*number);
    }
  }
  if (fall_off.coefficient.empty())
    return bad_file("no coefficients", path.string());
  return fall_off;
}

Result<void> write_fall_off(const std::filesystem::path& path, const FallOff& fall_off) {
  std::string text = "# Fall-off of a lens: 1 + a1 t^2 + a2 t^4 + ..., t = angle from the axis, radians\ncoefficients";
  for (const double a : fall_off.coefficient)
    text += fmt::format(" {:.9g}", a);
  return write_file_atomically(path, text + "\n");
}

Result<std::vector<float>> pixel_sensitivity(const LensModel& lens, const FallOff& fall_off, int width_px,
                                             int height_px) {
  if (lens.width_px > 0 && (lens.width_px != width_px || lens.height_px != height_px))
    return Error{ErrorCode::value_invalid,
                 fmt::format("the lens is of {} x {} pixels, the picture {} x {}", lens.width_px, lens.height_px,
                             width_px, height_px),
                 "lens", "use the lens file of this camera, and pictures that were not cropped"};
  for (double theta = 0; theta <= lens.max_theta; theta += 0.001)
    if (!(fall_off.at(theta) > 0))
      return Error{ErrorCode::value_invalid,
                   fmt::format("the fall-off is not positive at {:.1f} degrees", theta * 57.29577951308232), "fall-off",
                   "measure it as far as the lens reaches"};
  std::vector<float> sensitivity(static_cast<std::size_t>(width_px) * height_px, 1.0f);
  parallel_for(0, height_px, [&](int y) {
    for (int x = 0; x < width_px; ++x)
      if (const auto d = lens.unproject({x, y}))
        sensitivity[static_cast<std::size_t>(y) * width_px + x] =
            static_cast<float>(fall_off.at(std::acos(std::clamp(d->z, -1.0, 1.0))));
  });
  return sensitivity;
}

void divide(RgbImage& picture, std::span<const float> sensitivity) {
  for (std::size_t i = 0; i < picture.texels.size(); ++i)
    picture.texels[i] /= sensitivity[i];
}

} // namespace daylit
