#include "tests/scene/parse_matrix.h"
#include "scene/core/read_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace daylit::test {

namespace {

Error bad_matrix(const std::string& name, std::string what) {
  return {ErrorCode::file_malformed, std::move(what), name,
          "expected a Radiance matrix: NROWS, NCOLS, NCOMP=3, FORMAT"};
}

struct Header {
  int rows = 0, columns = 0;
  MatrixFormat format = MatrixFormat::ascii;
  bool has_format = false, big_endian = false;
};

std::optional<int> positive(std::string_view text) {
  int value = 0;
  const auto [stop, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
  return ec == std::errc{} && stop == text.data() + text.size() && value > 0 ? std::optional(value) : std::nullopt;
}

/// One line; an empty answer is no problem. Lines that are not known are history.
std::string read_header_line(std::string_view line, Header& header) {
  const auto value_of = [&](std::string_view key) -> std::optional<std::string_view> {
    return line.starts_with(key) ? std::optional(line.substr(key.size())) : std::nullopt;
  };
  if (const auto rows = value_of("NROWS=")) {
    header.rows = positive(*rows).value_or(0);
    return header.rows > 0 ? "" : "NROWS is no count";
  }
  if (const auto columns = value_of("NCOLS=")) {
    header.columns = positive(*columns).value_or(0);
    return header.columns > 0 ? "" : "NCOLS is no count";
  }
  if (const auto components = value_of("NCOMP="))
    return *components == "3" ? "" : "NCOMP is not 3";
  if (const auto order = value_of("BigEndian="))
    header.big_endian = *order == "1";
  if (const auto format = value_of("FORMAT=")) {
    header.has_format = true;
    header.format = *format == "float"    ? MatrixFormat::float32
                    : *format == "double" ? MatrixFormat::float64
                                          : MatrixFormat::ascii;
    return *format == "ascii" || *format == "float" || *format == "double" ? ""
                                                                           : "FORMAT is not ascii, float or double";
  }
  return "";
}

/// The header's lines; `rest` is what follows the blank line.
std::string read_header(std::string_view& rest, Header& header) {
  if (!rest.starts_with("#?RADIANCE\n"))
    return "it does not start with #?RADIANCE";
  while (true) {
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos)
      return "the header does not end";
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    if (line.empty())
      break;
    if (std::string problem = read_header_line(line, header); !problem.empty())
      return problem;
  }
  return header.rows > 0 && header.columns > 0 && header.has_format ? "" : "the header lacks NROWS, NCOLS or FORMAT";
}

template <class Number>
Number binary_number(const char* bytes, bool swap) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(Number));
  if (swap)
    std::reverse(raw.begin(), raw.end());
  return std::bit_cast<Number>(raw);
}

/// False: no number is left.
bool next_number(const char*& p, const char* end, float& value) {
  while (p < end && (*p == ' ' || *p == '\t' || *p == '\n' || *p == '\r'))
    ++p;
  const auto [stop, ec] = std::from_chars(p, end, value);
  if (ec != std::errc{})
    return false;
  p = stop;
  return true;
}

bool read_ascii(std::string_view text, std::vector<Rgb>& values) {
  const char *p = text.data(), *end = p + text.size();
  for (Rgb& value : values)
    for (int c = 0; c < 3; ++c)
      if (!next_number(p, end, value[c]))
        return false;
  float extra = 0.0f;
  return !next_number(p, end, extra);
}

} // namespace

Result<RadianceMatrix> parse_matrix(const std::string& text, const std::string& name) {
  std::string_view rest = text;
  Header header;
  if (std::string problem = read_header(rest, header); !problem.empty())
    return bad_matrix(name, std::move(problem));
  const std::size_t count = static_cast<std::size_t>(header.rows) * static_cast<std::size_t>(header.columns);
  // Five characters and a separator are the least for three numbers of text.
  const std::size_t size = header.format == MatrixFormat::float32   ? 12
                           : header.format == MatrixFormat::float64 ? 24
                                                                    : 6;
  const bool fits = header.format == MatrixFormat::ascii ? count <= rest.size() / 5 : rest.size() == count * size;
  if (!fits)
    return bad_matrix(name, fmt::format("{} x {} values do not fit its size", header.rows, header.columns));
  RadianceMatrix matrix{header.rows, header.columns, std::vector<Rgb>(count)};
  if (header.format == MatrixFormat::ascii && !read_ascii(rest, matrix.value))
    return bad_matrix(name, "a value is not a number, or there are too few or too many");
  if (header.format != MatrixFormat::ascii)
    for (std::size_t i = 0; i < 3 * count; ++i) {
      const char* at = rest.data() + i * size / 3;
      matrix.value[i / 3][static_cast<int>(i % 3)] =
          size == 12 ? binary_number<float>(at, header.big_endian)
                     : static_cast<float>(std::clamp(binary_number<double>(at, header.big_endian), -1e300, 1e300));
    }
  for (const Rgb& v : matrix.value)
    if (!std::isfinite(v.r) || !std::isfinite(v.g) || !std::isfinite(v.b))
      return bad_matrix(name, "a value is not finite");
  return matrix;
}

} // namespace daylit::test
