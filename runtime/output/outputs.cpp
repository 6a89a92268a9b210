#include "runtime/output/outputs.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <utility>

#include "scene/image/resample.h"

namespace daylit {

namespace {

constexpr int kMostEnlarged = 4;
constexpr double kMostStretch = 0.01;

float preview_exposure(const RgbImage& photo) {
  std::vector<float> values;
  values.reserve(photo.texels.size());
  for (const Rgb& c : photo.texels)
    values.push_back(std::max({c.r, c.g, c.b}));
  if (values.empty())
    return 1.0f;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at > 0.0f ? 1.0f / *at : 1.0f;
}

RgbImage object_mask(const Composite& composite) {
  RgbImage mask(composite.picture.width, composite.picture.height);
  for (std::size_t i = 0; i < mask.texels.size(); ++i)
    mask.texels[i] = Rgb(composite.coverage[i]);
  return mask;
}

} // namespace

Rgb8Image view_of(const Photograph& photo, const RgbImage& picture) {
  return photo.is_hdr() ? to_srgb8(picture, preview_exposure(photo.linear)) : encode_picture(photo.response, picture);
}

Result<Rgb8Image> view_of(const Photograph& photo, const Composite& composite) {
  return photo.is_hdr() ? view_of(photo, composite.picture)
                        : encode_photograph(photo, composite.picture, composite.touched);
}

OutputConfig numbered(const OutputConfig& output, std::size_t index) {
  OutputConfig out = output;
  char number[24];
  std::snprintf(number, sizeof(number), "-%05zu", index);
  for (std::filesystem::path* path : {&out.png, &out.exr, &out.mask})
    if (!path->empty())
      path->replace_filename(path->stem().string() + number + path->extension().string());
  return out;
}

Result<void> check_output_size(const OutputConfig& output, int width, int height) {
  if (output.width_px == 0)
    return {};
  const auto text = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
  // One pixel of rounding is no stretch.
  const double high = static_cast<double>(output.width_px) * height / width;
  if (std::abs(output.height_px - high) > 1.0 + kMostStretch * high)
    return Error{ErrorCode::value_invalid,
                 "size " + text(output.width_px, output.height_px) + " would stretch the picture of " +
                     text(width, height),
                 "[output] size", "give a size of the same shape, or leave it out"};
  if (output.width_px > kMostEnlarged * width)
    return Error{ErrorCode::value_invalid,
                 "size " + text(output.width_px, output.height_px) + " is more than " + std::to_string(kMostEnlarged) +
                     " times the picture's " + text(width, height),
                 "[output] size", "give a smaller size, or leave it out"};
  return {};
}

Result<void> check_outputs(const OutputConfig& output, bool force) {
  const std::pair<const std::filesystem::path*, const FileKind*> files[] = {
      {&output.png, &kPngKind}, {&output.exr, &kExrKind}, {&output.mask, &kExrKind}};
  std::set<std::filesystem::path> names;
  for (const auto& [path, kind] : files) {
    if (path->empty())
      continue;
    if (!names.insert(path->lexically_normal()).second)
      return Error{ErrorCode::value_invalid, "two outputs have one name", path->string(), "give each its own"};
    if (const auto writable = check_output(*path, *kind, force); !writable)
      return writable;
  }
  return {};
}

Result<void> write_outputs(const OutputConfig& output, const Photograph& photo, const Composite& composite) {
  const RgbImage& picture = composite.picture;
  const bool as_it_is =
      output.width_px == 0 || (output.width_px == picture.width && output.height_px == picture.height);
  const auto sized = [&](const RgbImage& image) { return resampled_by_area(image, output.width_px, output.height_px); };
  const auto write_linear = [&](const std::filesystem::path& path, const RgbImage& image) {
    return as_it_is ? write_exr(path, image) : write_exr(path, sized(image));
  };
  if (!output.exr.empty())
    if (const auto r = write_linear(output.exr, picture); !r)
      return r;
  if (!output.mask.empty())
    if (const auto r = write_linear(output.mask, object_mask(composite)); !r)
      return r;
  if (output.png.empty())
    return {};
  if (!as_it_is)
    return write_png(output.png, view_of(photo, sized(picture)));
  const auto png = view_of(photo, composite);
  return png ? write_png(output.png, *png) : Result<void>(png.error());
}

} // namespace daylit
