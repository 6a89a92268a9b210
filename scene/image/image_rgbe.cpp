#include "scene/image/image_codecs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "scene/core/text_lines.h"

// Radiance .hdr / .pic, after Ward, "Real Pixels" (Graphics Gems II) and the format notes of the Radiance manual.
// A texel is mantissa bytes and a shared exponent: (m + 1/2) 2^(e - 136); writers truncate, hence the half.

namespace daylit::detail {

namespace {

using Texel = std::array<std::uint8_t, 4>;

struct PictureHeader {
  int width = 0, height = 0;
  bool columns_first = false; ///< scan lines are columns ("+X W -Y H")
  bool x_decreasing = false, y_increasing = false;
  double exposure = 1.0;
  glm::dvec3 colour_correction{1.0};
  std::map<std::string, std::string> attributes;
  std::vector<std::string> notes;
};

/// One pass over the bytes of the file; reading behind the end gives false, never a byte.
class Cursor {
public:
  explicit Cursor(Bytes bytes) : bytes_(bytes) {}
  bool line(std::string& out) {
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(position_);
    const auto end = std::find(begin, bytes_.end(), std::uint8_t{'\n'});
    if (end == bytes_.end() || end - begin > kMaxLine)
      return false;
    out.assign(begin, end);
    if (!out.empty() && out.back() == '\r')
      out.pop_back();
    position_ += static_cast<std::size_t>(end - begin) + 1;
    return true;
  }
  bool byte(std::uint8_t& out) {
    if (position_ >= bytes_.size())
      return false;
    out = bytes_[position_++];
    return true;
  }
  bool texel(Texel& out) {
    if (bytes_.size() - position_ < 4)
      return false;
    std::memcpy(out.data(), bytes_.data() + position_, 4);
    position_ += 4;
    return true;
  }
  void back(std::size_t n) { position_ -= n; }

private:
  static constexpr std::ptrdiff_t kMaxLine = 1 << 16;
  Bytes bytes_;
  std::size_t position_ = 0;
};

/// Takes the first word as a positive number.
std::optional<double> take_positive(std::string_view& text) {
  const std::optional<double> value = parse_number(take_word(text));
  return value && std::isfinite(*value) && *value > 0 ? value : std::nullopt;
}

/// One KEY=VALUE line. EXPOSURE and COLORCORR lines accumulate: the file's values are radiance times their product.
std::optional<Error> apply_variable(const std::string& line, PictureHeader& header, const std::string& name) {
  const std::size_t equals = line.find('=');
  if (equals == std::string::npos || line.empty() || line[0] == '#' || line[0] == '\t' || line[0] == ' ')
    return std::nullopt;
  const std::string key = line.substr(0, equals), value = line.substr(equals + 1);
  if (key == "FORMAT" && value.find("32-bit_rle_rgbe") == std::string::npos)
    return Error{ErrorCode::file_malformed, "pixel format \"" + value + "\" (32-bit_rle_rgbe is read)", name,
                 value.find("xyze") == std::string::npos ? "export the image again as RGBE"
                                                         : "convert it with: ra_xyze -r in.hdr out.hdr"};
  if (key == "EXPOSURE") {
    std::string_view number = value;
    if (parse_number(trimmed(number)) == 0.0) {
      header.notes.push_back(name + ": EXPOSURE=0 says nothing about the exposure, the values are taken as they are");
      return std::nullopt;
    }
    const auto factor = take_positive(number);
    if (!factor)
      return damaged_file(name, "EXPOSURE=" + value.substr(0, 40) + " is not a positive number");
    header.exposure *= *factor;
  } else if (key == "COLORCORR") {
    std::string_view numbers = value;
    for (int c = 0; c < 3; ++c) {
      const auto factor = take_positive(numbers);
      if (!factor)
        return damaged_file(name, "COLORCORR=" + value.substr(0, 40) + " is not three positive numbers");
      header.colour_correction[c] *= *factor;
    }
  } else {
    header.attributes[key] = value;
  }
  return std::nullopt;
}

/// "-Y 512 +X 1024" and the seven other orientations.
bool parse_resolution(const std::string& line, PictureHeader& header) {
  char first_sign = 0, first_axis = 0, second_sign = 0, second_axis = 0;
  int first = 0, second = 0;
  if (line.size() > 64 || std::sscanf(line.c_str(), "%c%c %9d %c%c %9d", &first_sign, &first_axis, &first, &second_sign,
                                      &second_axis, &second) != 6)
    return false;
  auto is_sign = [](char c) { return c == '+' || c == '-'; };
  const bool yx = first_axis == 'Y' && second_axis == 'X', xy = first_axis == 'X' && second_axis == 'Y';
  if (!is_sign(first_sign) || !is_sign(second_sign) || !(yx || xy))
    return false;
  header.columns_first = xy;
  header.width = yx ? second : first;
  header.height = yx ? first : second;
  header.y_increasing = (yx ? first_sign : second_sign) == '+';
  header.x_decreasing = (yx ? second_sign : first_sign) == '-';
  return true;
}

Result<PictureHeader> read_picture_header(Cursor& cursor, const std::string& name) {
  PictureHeader header;
  std::string line;
  if (!cursor.line(line))
    return damaged_file(name, "the file ends inside the header");
  while (true) {
    if (!cursor.line(line))
      return damaged_file(name, "the file ends inside the header");
    if (line.empty())
      break;
    if (auto error = apply_variable(line, header, name))
      return *error;
  }
  if (!cursor.line(line))
    return damaged_file(name, "the file ends before the resolution line");
  if (!parse_resolution(line, header))
    return damaged_file(name, "the resolution line is not of the form \"-Y height +X width\"");
  const glm::dvec3 factor = header.exposure * header.colour_correction;
  for (int c = 0; c < 3; ++c)
    if (!(factor[c] > 1e-30 && factor[c] < 1e30))
      return damaged_file(name, "the product of the EXPOSURE lines is outside 1e-30..1e30");
  return header;
}

/// The four component runs of a scan line in the run-length form of 1991 (after its 4-byte mark).
bool read_component_runs(Cursor& cursor, std::vector<Texel>& line) {
  for (int component = 0; component < 4; ++component)
    for (std::size_t x = 0; x < line.size();) {
      std::uint8_t code = 0, value = 0;
      if (!cursor.byte(code) || code == 0)
        return false;
      const bool run = code > 128;
      const std::size_t count = run ? code & 127u : code;
      if (count > line.size() - x || (run && !cursor.byte(value)))
        return false;
      for (std::size_t k = 0; k < count; ++k, ++x) {
        if (!run && !cursor.byte(value))
          return false;
        line[x][component] = value;
      }
    }
  return true;
}

/// Flat texels, with (1, 1, 1, n) repeating the previous one n times (consecutive marks: n << 8, ...).
bool read_flat_or_old_runs(Cursor& cursor, std::vector<Texel>& line) {
  int shift = 0;
  for (std::size_t x = 0; x < line.size();) {
    Texel texel;
    if (!cursor.texel(texel))
      return false;
    if (texel[0] != 1 || texel[1] != 1 || texel[2] != 1) {
      line[x++] = texel;
      shift = 0;
      continue;
    }
    if (x == 0 || shift > 16)
      return false;
    const std::size_t count = std::size_t{texel[3]} << shift;
    if (count > line.size() - x)
      return false;
    std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(x), count, line[x - 1]);
    x += count;
    shift += 8;
  }
  return true;
}

bool read_scan_line(Cursor& cursor, std::vector<Texel>& line) {
  Texel mark;
  if (!cursor.texel(mark))
    return false;
  const bool may_be_runs = line.size() >= 8 && line.size() <= 0x7fff;
  if (!may_be_runs || mark[0] != 2 || mark[1] != 2 || mark[2] >= 128) {
    cursor.back(4);
    return read_flat_or_old_runs(cursor, line);
  }
  return (std::size_t{mark[2]} << 8 | mark[3]) == line.size() && read_component_runs(cursor, line);
}

Rgb to_rgb(const Texel& t, const glm::dvec3& inverse_factor) {
  if (t[3] == 0)
    return Rgb(0.0f);
  const double scale = std::ldexp(1.0, t[3] - 136);
  return Rgb(glm::dvec3(t[0] + 0.5, t[1] + 0.5, t[2] + 0.5) * scale * inverse_factor);
}

} // namespace

bool is_rgbe(Bytes bytes) { return bytes.size() >= 2 && bytes[0] == '#' && bytes[1] == '?'; }

Result<HdrFile> decode_rgbe(Bytes bytes, const std::string& name) {
  Cursor cursor(bytes);
  auto header = read_picture_header(cursor, name);
  if (!header)
    return header.error();
  if (auto error = check_image_size(header->width, header->height, 4, bytes.size(), name))
    return *error;
  HdrFile out{RgbImage(header->width, header->height), std::move(header->attributes), std::move(header->notes)};
  RgbImage& image = out.radiance;
  const int lines = header->columns_first ? image.width : image.height;
  const glm::dvec3 inverse_factor = 1.0 / (header->exposure * header->colour_correction);
  std::vector<Texel> line(static_cast<std::size_t>(header->columns_first ? image.height : image.width));
  for (int i = 0; i < lines; ++i) {
    if (!read_scan_line(cursor, line))
      return damaged_file(name,
                          "scan line " + std::to_string(i) + " of " + std::to_string(lines) + " cannot be decoded");
    for (int j = 0; j < static_cast<int>(line.size()); ++j) {
      const int x = header->columns_first ? i : j, y = header->columns_first ? j : i;
      image.at(header->x_decreasing ? image.width - 1 - x : x, header->y_increasing ? image.height - 1 - y : y) =
          to_rgb(line[static_cast<std::size_t>(j)], inverse_factor);
    }
  }
  return out;
}

} // namespace daylit::detail
