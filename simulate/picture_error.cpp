#include "simulate/picture_error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "simulate/masked_blur.h"

namespace daylit {

namespace {

using Mask = std::vector<std::uint8_t>;

Mask covered(const RgbImage& coverage) {
  Mask mask(coverage.texels.size());
  for (std::size_t i = 0; i < mask.size(); ++i)
    mask[i] = coverage.texels[i].r >= 0.5f ? 1 : 0;
  return mask;
}

/// Minimum (erosion) or maximum (dilation) over the (2 radius + 1)^2 square; outside the picture counts as its border.
Mask spread(const Mask& in, int width, int height, int radius, bool erode) {
  const auto pass = [&](const Mask& from, int dx, int dy) {
    Mask to(from.size());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        std::uint8_t value = erode ? 1 : 0;
        for (int k = -radius; k <= radius; ++k) {
          const int xx = std::clamp(x + k * dx, 0, width - 1), yy = std::clamp(y + k * dy, 0, height - 1);
          const std::uint8_t v = from[static_cast<std::size_t>(yy) * width + xx];
          value = erode ? std::min(value, v) : std::max(value, v);
        }
        to[static_cast<std::size_t>(y) * width + x] = value;
      }
    return to;
  };
  return pass(pass(in, 1, 0), 0, 1);
}

/// Pixels where the object changes the luminance by more than kShadowChange, of 3 x 3 means: the change of a single
/// pixel with few samples is mostly noise.
Mask changed(const RgbImage& truth, const RgbImage& room) {
  Mask mask(truth.texels.size());
  for (int y = 0; y < truth.height; ++y)
    for (int x = 0; x < truth.width; ++x) {
      float change = 0.0f, level = 0.0f;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int xx = std::clamp(x + dx, 0, truth.width - 1), yy = std::clamp(y + dy, 0, truth.height - 1);
          change += luminance(truth.at(xx, yy)) - luminance(room.at(xx, yy));
          level += luminance(room.at(xx, yy));
        }
      mask[static_cast<std::size_t>(y) * truth.width + x] = std::abs(change) > kShadowChange * level ? 1 : 0;
    }
  return mask;
}

RegionError measure(const PictureErrorInput& in, const Mask& where, const std::optional<RgbImage>& second) {
  RegionError e;
  double square = 0.0, product = 0.0, unchanged = 0.0, level = 0.0, bias = 0.0, own = 0.0;
  for (std::size_t i = 0; i < where.size(); ++i) {
    if (!where[i])
      continue;
    ++e.pixels;
    for (int c = 0; c < 3; ++c) {
      const double t = static_cast<double>(in.truth.texels[i][c]);
      const double d = static_cast<double>(in.result.texels[i][c]) - t;
      const double n = static_cast<double>(in.room.texels[i][c]) - t;
      const double s = in.standard_error ? static_cast<double>(in.standard_error->texels[i][c]) : 0.0;
      square += d * d;
      product += second ? d * static_cast<double>(in.result.texels[i][c] - second->texels[i][c]) : 0.0;
      unchanged += n * n;
      bias += d;
      level += t;
      own += s * s;
    }
  }
  const double count = 3.0 * static_cast<double>(e.pixels), mean = count > 0.0 ? level / count : 0.0;
  if (mean <= 0.0)
    return e;
  e.measured = true;
  e.relative_rms = std::sqrt(square / count) / mean;
  e.no_object_rms = std::sqrt(unchanged / count) / mean;
  e.truth_standard_error = std::sqrt(own / count) / mean;
  e.bias = bias / level;
  if (second)
    e.rms_without_noise = std::sqrt(std::max(product, 0.0) / count) / mean;
  return e;
}

Mask darkest_third(const RgbImage& by, const Mask& where) {
  std::vector<float> level;
  for (std::size_t i = 0; i < where.size(); ++i)
    if (where[i])
      level.push_back(luminance(by.texels[i]));
  Mask mask(where.size());
  if (level.empty())
    return mask;
  const auto third = level.begin() + static_cast<std::ptrdiff_t>(level.size() / 3);
  std::nth_element(level.begin(), third, level.end());
  for (std::size_t i = 0; i < where.size(); ++i)
    mask[i] = where[i] && luminance(by.texels[i]) < *third ? 1 : 0;
  return mask;
}

/// Clipped at `white` and smoothed over the mask.
RgbImage as_seen(const RgbImage& image, const Mask& mask, float white) {
  const Plane weight(mask.begin(), mask.end());
  RgbImage seen(image.width, image.height);
  for (int c = 0; c < 3; ++c) {
    Plane channel(mask.size());
    for (std::size_t i = 0; i < mask.size(); ++i)
      channel[i] = static_cast<double>(std::min(image.texels[i][c], white));
    channel = blur_within(std::move(channel), weight, image.width, image.height);
    for (std::size_t i = 0; i < mask.size(); ++i)
      seen.texels[i][c] = static_cast<float>(channel[i]);
  }
  return seen;
}

/// Of the truth as_seen(): none where it is white beyond doubt, nowhere more than white.
RgbImage error_as_seen(const RgbImage& standard_error, const RgbImage& truth, const Mask& mask, float white) {
  constexpr float kDoubt = 3.0f;
  const Plane weight(mask.begin(), mask.end());
  RgbImage seen(truth.width, truth.height);
  for (int c = 0; c < 3; ++c) {
    Plane channel(mask.size());
    for (std::size_t i = 0; i < mask.size(); ++i) {
      const float s = standard_error.texels[i][c];
      channel[i] = truth.texels[i][c] - kDoubt * s > white ? 0.0 : static_cast<double>(std::min(s, white));
    }
    channel = blurred_error(std::move(channel), weight, truth.width, truth.height);
    for (std::size_t i = 0; i < mask.size(); ++i)
      seen.texels[i][c] = static_cast<float>(channel[i]);
  }
  return seen;
}

RegionError measure_seen(const PictureErrorInput& in, const Mask& where) {
  const float white = 1.0f / preview_exposure(in.room);
  const PictureErrorInput seen{
      as_seen(in.result, where, white),
      as_seen(in.truth, where, white),
      as_seen(in.room, where, white),
      {},
      in.standard_error ? std::optional(error_as_seen(*in.standard_error, in.truth, where, white)) : std::nullopt,
      {},
      {}};
  const auto second = in.second_truth ? std::optional(as_seen(*in.second_truth, where, white)) : std::nullopt;
  return measure(seen, where, second);
}

Result<void> check(const RgbImage& image, const RgbImage& like, const char* name) {
  if (image.width != like.width || image.height != like.height || image.empty())
    return Error{
        ErrorCode::value_invalid,
        fmt::format("is {} x {} pixels, the truth {} x {}", image.width, image.height, like.width, like.height), name,
        "compare pictures of one run"};
  for (const Rgb& c : image.texels)
    if (!std::isfinite(c.r) || !std::isfinite(c.g) || !std::isfinite(c.b))
      return Error{ErrorCode::value_invalid, "holds a value that is not finite", name, ""};
  return {};
}

std::string percent(double fraction, bool measured, int width) {
  return measured ? fmt::format(" {:>{}.2f}", 100.0 * fraction, width) : fmt::format(" {:>{}}", "-", width);
}

std::string row(const char* name, const RegionError& e) {
  return fmt::format("{:<8} {:>8}", name, e.pixels) + percent(e.relative_rms, e.measured, 8) +
         percent(e.bias, e.measured, 8) + percent(e.no_object_rms, e.measured, 12) +
         percent(e.truth_standard_error, e.measured, 10) +
         (e.rms_without_noise ? percent(*e.rms_without_noise, true, 14) : "") + "\n";
}

std::string row(const ContactError& e) {
  const bool measured = e.pixels > 0;
  return fmt::format("contact  {:>8}", e.pixels) + percent(e.relative_rms, measured, 8) + percent(e.bias, measured, 8) +
         (measured
              ? fmt::format("  brightest pixel {:+.0f} %, darkest {:+.0f} %\n", 100.0 * e.brightest, 100.0 * e.darkest)
              : "\n");
}

std::string number(double value, bool measured) { return measured ? fmt::format("{:.6g}", value) : "null"; }

std::string json(const RegionError& e) {
  return fmt::format("{{\"pixels\":{},\"relative_rms\":{},\"bias\":{},\"no_object_rms\":{},"
                     "\"truth_standard_error\":{}{}}}",
                     e.pixels, number(e.relative_rms, e.measured), number(e.bias, e.measured),
                     number(e.no_object_rms, e.measured), number(e.truth_standard_error, e.measured),
                     e.rms_without_noise ? fmt::format(",\"rms_without_noise\":{:.6g}", *e.rms_without_noise) : "");
}

std::string json(const ContactError& e) {
  const bool measured = e.pixels > 0;
  return fmt::format("{{\"pixels\":{},\"relative_rms\":{},\"bias\":{},\"brightest\":{},\"darkest\":{}}}", e.pixels,
                     number(e.relative_rms, measured), number(e.bias, measured), number(e.brightest, measured),
                     number(e.darkest, measured));
}

} // namespace

Result<PictureError> measure_picture_error(const PictureErrorInput& in) {
  const std::pair<const RgbImage*, const char*> images[] = {
      {&in.result, "result"},
      {&in.room, "interior"},
      {&in.truth, "truth"},
      {&in.coverage, "mask"},
      {in.standard_error ? &*in.standard_error : &in.truth, "standard error"},
      {in.result_coverage ? &*in.result_coverage : &in.truth, "result mask"},
      {in.second_truth ? &*in.second_truth : &in.truth, "second truth"}};
  for (const auto& [image, name] : images)
    if (const auto good = check(*image, in.truth, name); !good)
      return good.error();
  const int width = in.truth.width, height = in.truth.height;
  const Mask mask = covered(in.coverage), other = in.result_coverage ? covered(*in.result_coverage) : mask;
  Mask both(mask.size()), either(mask.size());
  std::size_t intersection = 0, together = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    both[i] = mask[i] & other[i];
    either[i] = mask[i] | other[i];
    intersection += both[i];
    together += either[i];
  }
  if (intersection == 0)
    return Error{ErrorCode::not_found, "no pixel shows the object in both pictures", "mask", "check the pose"};
  const Mask dilated = spread(either, width, height, kMaskDilation, false);
  Mask shadow = changed(in.truth, in.room);
  for (std::size_t i = 0; i < shadow.size(); ++i)
    shadow[i] = shadow[i] && !dilated[i] ? 1 : 0;
  PictureError error;
  const Mask inner = spread(both, width, height, kMaskErosion, true);
  error.object = measure(in, inner, in.second_truth);
  error.seen = measure_seen(in, inner);
  if (in.second_truth)
    error.shaded = measure(in, darkest_third(*in.second_truth, inner), {});
  error.shadow = measure(in, shadow, in.second_truth);
  error.shadow_seen = measure_seen(in, shadow);
  error.contact = measure_contact(in.result, in.truth, in.coverage);
  error.whole = measure(in, Mask(mask.size(), 1), in.second_truth);
  if (in.result_coverage)
    error.mask_iou = static_cast<double>(intersection) / static_cast<double>(together);
  error.object_fraction =
      static_cast<double>(std::count(mask.begin(), mask.end(), 1)) / static_cast<double>(mask.size());
  return error;
}

std::string to_text(const PictureError& e) {
  std::string out = "region     pixels    rms %   bias %  unchanged %  truth se %";
  out += e.object.rms_without_noise ? "  without noise\n" : "\n";
  out += row("object", e.object) + (e.shaded ? row("in shade", *e.shaded) : "") + row("as seen", e.seen);
  out += row("shadow", e.shadow) + row("as seen", e.shadow_seen) + row("whole", e.whole) + row(e.contact);
  out += fmt::format("the object covers {:.1f} % of the picture", 100.0 * e.object_fraction);
  return out + (e.mask_iou ? fmt::format("; intersection over union of the masks {:.3f}\n", *e.mask_iou) : "\n");
}

std::string to_json(const PictureError& e) {
  return fmt::format("{{\"object\":{},\"seen\":{},\"shadow\":{},\"shadow_seen\":{},\"contact\":{},\"whole\":{},"
                     "\"object_fraction\":{:.6g},\"mask_iou\":{}{}}}",
                     json(e.object), json(e.seen), json(e.shadow), json(e.shadow_seen), json(e.contact), json(e.whole),
                     e.object_fraction, e.mask_iou ? fmt::format("{:.6g}", *e.mask_iou) : "null",
                     e.shaded ? ",\"shaded\":" + json(*e.shaded) : "");
}

float preview_exposure(const RgbImage& image) {
  std::vector<float> level;
  level.reserve(image.texels.size());
  for (const Rgb& c : image.texels)
    level.push_back(luminance(c));
  if (level.empty())
    return 1.0f;
  const auto at = level.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(level.size() - 1));
  std::nth_element(level.begin(), at, level.end());
  return *at > 0.0f ? 0.8f / *at : 1.0f;
}

RgbImage difference_picture(const PictureErrorInput& in, float gain) {
  double level = 0.0, count = 0.0;
  for (std::size_t i = 0; i < in.truth.texels.size(); ++i)
    if (in.coverage.texels[i].r >= 0.5f) {
      level += static_cast<double>(luminance(in.truth.texels[i]));
      count += 1.0;
    }
  const float scale = level > 0.0 ? gain * static_cast<float>(count / level) : gain;
  RgbImage out(in.truth.width, in.truth.height);
  for (std::size_t i = 0; i < out.texels.size(); ++i)
    out.texels[i] = scale * glm::abs(in.result.texels[i] - in.truth.texels[i]);
  return out;
}

} // namespace daylit
