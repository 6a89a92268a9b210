#include "capture/hdr/response_curve.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"
#include "scene/image/image_formats.h"

namespace daylit {

namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;
constexpr const char* kForm = "256 lines of one number or three (R G B), never falling, or three polynomials as hdrgen "
                              "writes them";

Error bad_response(const std::string& what, const std::string& where) {
  return {ErrorCode::value_invalid, what, where, kForm};
}

/// The numbers of a line that has any.
struct NumberRow {
  std::vector<double> numbers;
  std::string where; ///< file and line
};

Result<std::vector<NumberRow>> number_rows(const std::string& text, const std::string& name) {
  std::vector<NumberRow> rows;
  TextLines lines(text);
  for (std::string_view line; lines.next(line);) {
    std::string plain(line.substr(0, line.find('#')));
    std::ranges::replace_if(
        plain, [](char c) { return c == ',' || c == ';'; }, ' ');
    NumberRow row{{}, name + ", line " + std::to_string(lines.number())};
    std::string_view rest = plain;
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      const auto number = parse_number(word);
      if (!number || !std::isfinite(*number))
        return bad_response("not a list of numbers", row.where);
      row.numbers.push_back(*number);
    }
    if (row.numbers.empty())
      continue;
    if (rows.size() == 256)
      return bad_response("more than 256 lines", row.where);
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Horner's rule; coefficients from the highest power down, after the degree.
double polynomial(const std::vector<double>& row, double x) {
  double y = 0;
  for (std::size_t i = 1; i < row.size(); ++i)
    y = y * x + row[i];
  return y;
}

/// Polynomials that dip a little at the dark end, as fitted ones do, are held at their largest value so far.
Result<ResponseCurve::Table> table_of_polynomials(const std::vector<NumberRow>& rows) {
  ResponseCurve::Table table;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto& numbers = rows[c].numbers;
    if (numbers[0] != static_cast<double>(numbers.size() - 2))
      return bad_response("the degree does not fit the number of coefficients", rows[c].where);
    double highest = 0;
    for (std::size_t code = 0; code < 256; ++code) {
      highest = std::max(highest, polynomial(numbers, static_cast<double>(code) / 255.0));
      table[c][code] = static_cast<float>(highest);
    }
  }
  return table;
}

Result<ResponseCurve::Table> table_of_lines(const std::vector<NumberRow>& rows) {
  ResponseCurve::Table table;
  for (std::size_t code = 0; code < 256; ++code) {
    const auto& [numbers, where] = rows[code];
    if (numbers.size() != 1 && numbers.size() != 3)
      return bad_response("neither one number nor three", where);
    for (std::size_t c = 0; c < 3; ++c) {
      table[c][code] = static_cast<float>(numbers[numbers.size() == 3 ? c : 0]);
      if (!(table[c][code] >= (code > 0 ? table[c][code - 1] : 0.0f)))
        return bad_response("the exposure is negative or falls", where);
    }
  }
  return table;
}

} // namespace

ResponseCurve ResponseCurve::linear() {
  ResponseCurve curve;
  curve.linear_ = true;
  for (auto& channel : curve.table_)
    for (std::size_t code = 0; code < 256; ++code)
      channel[code] = static_cast<float>(code) / 255.0f;
  return curve;
}

ResponseCurve ResponseCurve::srgb() {
  ResponseCurve curve;
  for (auto& channel : curve.table_)
    for (std::size_t code = 0; code < 256; ++code)
      channel[code] = srgb_decode(static_cast<float>(code) / 255.0f);
  return curve;
}

Result<ResponseCurve> ResponseCurve::from_table(const Table& table, const std::string& name) {
  ResponseCurve curve;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto& t = table[c];
    if (!(t[0] >= 0.0f) || !std::ranges::is_sorted(t))
      return bad_response("the exposure is negative or falls", name);
    if (!(t[255] > t[0] && t[255] < 1e30f))
      return bad_response("the response does not rise", name);
    for (std::size_t code = 0; code < 256; ++code)
      curve.table_[c][code] = t[code] / t[255];
  }
  return curve;
}

Result<ResponseCurve> ResponseCurve::parse(const std::string& text, const std::string& name) {
  const auto rows = number_rows(text, name);
  if (!rows)
    return rows.error();
  const bool polynomials =
      rows->size() == 3 && std::ranges::all_of(*rows, [](const NumberRow& r) { return r.numbers.size() >= 3; });
  if (!polynomials && rows->size() != 256)
    return bad_response(std::to_string(rows->size()) + " lines of numbers", name);
  const auto table = polynomials ? table_of_polynomials(*rows) : table_of_lines(*rows);
  return table ? from_table(*table, name) : Result<ResponseCurve>(table.error());
}

Result<ResponseCurve> ResponseCurve::named(const std::string& name) {
  if (name == "linear")
    return linear();
  if (name == "srgb")
    return srgb();
  const auto bytes = read_whole_file(name, kMostBytes);
  if (!bytes) {
    Error error = bytes.error();
    error.hint = "a response is \"linear\", \"srgb\" or the path of a response file";
    return error;
  }
  return parse(std::string(bytes->begin(), bytes->end()), name);
}

float ResponseCurve::exposure(float code, int channel) const {
  const float x = std::clamp(code, 0.0f, 1.0f);
  if (linear_)
    return x;
  const float at = x * 255.0f;
  const auto low = static_cast<std::size_t>(std::min(at, 254.0f));
  const auto& t = table_[static_cast<std::size_t>(channel)];
  return t[low] + (at - static_cast<float>(low)) * (t[low + 1] - t[low]);
}

std::uint8_t ResponseCurve::encode(float exposure, int channel) const {
  const auto& t = table_[static_cast<std::size_t>(channel)];
  const auto above = std::lower_bound(t.begin(), t.end(), exposure);
  if (above == t.end())
    return 255;
  if (above == t.begin() || !(exposure > 0.0f))
    return 0;
  const auto code = static_cast<std::uint8_t>(above - t.begin());
  return exposure - *(above - 1) < *above - exposure ? static_cast<std::uint8_t>(code - 1) : code;
}

float ResponseCurve::slope(float code, int channel) const {
  if (linear_)
    return 1.0f;
  const auto low = static_cast<std::size_t>(std::clamp(code * 255.0f, 0.0f, 254.0f));
  const auto& t = table_[static_cast<std::size_t>(channel)];
  return 255.0f * (t[low + 1] - t[low]);
}

float ResponseCurve::black(int channel) const {
  const auto& t = table_[static_cast<std::size_t>(channel)];
  std::size_t last = 0;
  while (t[last + 1] <= 0.0f)
    ++last;
  return static_cast<float>(last) / 255.0f;
}

std::string ResponseCurve::text() const {
  std::string out = "# Response of a camera: exposure of code 0, 1, ... 255 for R G B; code 255 is 1\n";
  for (std::size_t code = 0; code < 256; ++code) {
    char line[64];
    std::snprintf(line, sizeof(line), "%.7g %.7g %.7g\n", static_cast<double>(table_[0][code]),
                  static_cast<double>(table_[1][code]), static_cast<double>(table_[2][code]));
    out += line;
  }
  return out;
}

} // namespace daylit
