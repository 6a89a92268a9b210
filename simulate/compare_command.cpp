#include "simulate/compare_command.h"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include "scene/image/image_formats.h"
#include "simulate/picture_error.h"

namespace daylit {

namespace {

constexpr float kDifferenceGain = 4.0f;

Result<void> read_into(const std::filesystem::path& path, RgbImage& image) {
  auto file = read_hdr_image(path);
  if (!file)
    return file.error();
  image = std::move(file->radiance);
  return {};
}

/// Left to right, same height.
Rgb8Image side_by_side(const std::vector<Rgb8Image>& pictures) {
  Rgb8Image out;
  out.height = pictures.front().height;
  for (const Rgb8Image& p : pictures)
    out.width += p.width;
  for (int y = 0; y < out.height; ++y)
    for (const Rgb8Image& p : pictures) {
      const auto row = p.bytes.begin() + static_cast<std::ptrdiff_t>(3) * y * p.width;
      out.bytes.insert(out.bytes.end(), row, row + static_cast<std::ptrdiff_t>(3) * p.width);
    }
  return out;
}

} // namespace

Result<void> run_compare(const CompareArguments& a) {
  PictureErrorInput in;
  const std::string suffix = (a.frame == 0 ? "" : fmt::format("_{:04}", a.frame)) + ".exr";
  const std::filesystem::path result = a.result.empty() ? a.folder / ("result" + suffix) : a.result;
  const std::pair<std::filesystem::path, RgbImage*> files[] = {
      {result, &in.result},
      {a.folder / ("truth" + suffix), &in.truth},
      {a.folder / ("interior" + suffix), &in.room},
      {a.folder / ("mask" + suffix), &in.coverage},
      {a.folder / ("se" + suffix), &in.standard_error.emplace()}};
  for (const auto& [path, image] : files)
    if (const auto read = read_into(path, *image); !read)
      return read;
  const std::filesystem::path beside = a.folder / ("result-mask" + suffix);
  const bool has_mask = !a.result_mask.empty() || (a.result.empty() && std::filesystem::exists(beside));
  if (has_mask)
    if (const auto read = read_into(a.result_mask.empty() ? beside : a.result_mask, in.result_coverage.emplace());
        !read)
      return read;
  const auto error = measure_picture_error(in);
  if (!error)
    return error.error();
  if (!a.output.empty()) {
    const float exposure = preview_exposure(in.room);
    const std::vector<Rgb8Image> pictures = {to_srgb8(in.result, exposure), to_srgb8(in.truth, exposure),
                                             to_srgb8(difference_picture(in, kDifferenceGain), 1.0f)};
    if (const auto written = write_png(a.output, side_by_side(pictures)); !written)
      return written;
  }
  std::printf("%s%s", (a.json ? to_json(*error) : to_text(*error)).c_str(), a.json ? "\n" : "");
  return {};
}

} // namespace daylit
