#pragma once

// Text files read line by line and word by word, without copies.

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

namespace daylit {

/// The lines of a text, without their ends (LF or CR LF) and the mark that some editors write before UTF-8, and their
/// numbers.
class TextLines {
public:
  explicit TextLines(std::string_view text) : rest_(text) {
    if (rest_.starts_with("\xEF\xBB\xBF"))
      rest_.remove_prefix(3);
  }

  /// False at the end of the text.
  bool next(std::string_view& line) {
    if (rest_.empty())
      return false;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    if (line.ends_with('\r'))
      line.remove_suffix(1);
    ++number_;
    return true;
  }
  int number() const { return number_; } ///< of the last line, from 1

private:
  std::string_view rest_;
  int number_ = 0;
};

/// Without the blanks and tabs at both ends.
inline std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  return first == std::string_view::npos ? std::string_view{}
                                         : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Removes and returns the first word; empty when there is none.
inline std::string_view take_word(std::string_view& text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, text.find_first_of(" \t"));
  text.remove_prefix(word.size());
  return word;
}

/// The whole text as a number; nothing when it is none. Numbers beyond the range of double are infinite or 0.
template <class Number = double>
std::optional<Number> parse_number(std::string_view text) {
  if (text.starts_with('+'))
    text.remove_prefix(1);
  Number value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || code == std::errc::invalid_argument)
    return std::nullopt;
  if (code == std::errc{})
    return value;
  if constexpr (std::is_floating_point_v<Number>)
    return static_cast<Number>(std::strtod(std::string(text).c_str(), nullptr));
  return std::nullopt;
}

} // namespace daylit
