// daylit-simulate develop.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/mat3x3.hpp>

#include "scene/core/output_file.h"
#include "scene/image/image_formats.h"
#include "scene/lens/fall_off.h"
#include "simulate/photograph_command.h"
#include "simulate/sensor_picture.h"

namespace daylit {

namespace {

Result<void> apply_fall_off(const DevelopArguments& a, RgbImage& light) {
  if (a.fall_off.empty())
    return {};
  const auto lens = read_lens(a.lens);
  if (!lens)
    return lens.error();
  const auto fall_off = read_fall_off(a.fall_off);
  if (!fall_off)
    return fall_off.error();
  const auto sensitivity = pixel_sensitivity(*lens, *fall_off, light.width, light.height);
  if (!sensitivity)
    return sensitivity.error();
  for (std::size_t i = 0; i < light.texels.size(); ++i)
    light.texels[i] *= (*sensitivity)[i];
  return {};
}

/// Light in the camera's colours, 1 at full scale; the exposure.
double expose(const DevelopArguments& a, RgbImage& light) {
  double mean = 0;
  for (const Rgb& texel : light.texels)
    mean += static_cast<double>(luminance(texel)) / static_cast<double>(light.texels.size());
  const double exposure = a.mean > 0 && mean > 0 ? a.mean / mean : a.exposure;
  glm::mat3 camera;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      camera[c][r] = static_cast<float>(exposure * a.camera_from_rec709[static_cast<std::size_t>(3 * r + c)]);
  for (Rgb& texel : light.texels)
    texel = camera * texel;
  return exposure;
}

/// Code, 0..1: ln(1 + a v) / ln(1 + a) of light v; v itself for a = 0.
double code_of(double light, double a) {
  const double v = std::clamp(light, 0.0, 1.0);
  return a > 0 ? std::log1p(a * v) / std::log1p(a) : v;
}

Rgb8Image codes_of(const RgbImage& light, double logarithmic) {
  Rgb8Image codes{light.width, light.height, {}};
  codes.bytes.reserve(3 * light.texels.size());
  for (const Rgb& texel : light.texels)
    for (int c = 0; c < 3; ++c)
      codes.bytes.push_back(
          static_cast<std::uint8_t>(std::lround(255.0 * code_of(static_cast<double>(texel[c]), logarithmic))));
  return codes;
}

} // namespace

Result<void> run_develop(const DevelopArguments& a) {
  const bool png = a.output.extension() == ".png";
  if (!png && a.output.extension() != ".exr")
    return Error{ErrorCode::usage, "the output is neither .png nor .exr", a.output.string(),
                 ".png: the camera's codes; .exr: its light, without curve and limit"};
  if (a.fall_off.empty() != a.lens.empty())
    return Error{ErrorCode::usage, "a fall-off needs the lens of the picture", "--lens, --fall-off", "give both"};
  auto file = read_hdr_image(a.picture);
  if (!file)
    return file.error();
  RgbImage& light = file->radiance;
  if (const Result<void> good = apply_fall_off(a, light); !good)
    return good;
  const double exposure = expose(a, light);
  add_noise(light, {0.0, a.noise * a.noise, 0.0}, a.seed);
  if (const Result<void> good = check_output(a.output, png ? kPngKind : kExrKind, a.force); !good)
    return good;
  const Result<void> written = png ? write_png(a.output, codes_of(light, a.logarithmic)) : write_exr(a.output, light);
  if (!written)
    return written;
  const auto saturated = static_cast<double>(std::ranges::count_if(light.texels,
                                                                   [](const Rgb& t) {
                                                                     return std::max({t.r, t.g, t.b}) >= 1.0f;
                                                                   })) /
                         static_cast<double>(light.texels.size());
  if (a.json)
    fmt::print("{{\"exposure\":{:.9g},\"saturated\":{:.6g}}}\n", exposure, saturated);
  else if (!a.quiet)
    fmt::print(stderr, "exposure {:.4g}, {:.2f} % of the pixels are saturated\n", exposure, 100 * saturated);
  return {};
}

} // namespace daylit
