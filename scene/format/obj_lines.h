#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "scene/core/result.h"
#include "scene/core/text_lines.h"

namespace daylit::detail {

/// Logical lines of an OBJ or MTL file: a backslash at the end joins the next line, # starts a comment.
class ObjLines {
public:
  ObjLines(std::string_view text, std::string name) : lines_(text), name_(std::move(name)) {}

  /// The next line that says something: its keyword and what follows it. False at the end.
  bool next(std::string_view& keyword, std::string_view& rest) {
    do {
      if (!next_joined(rest))
        return false;
      keyword = next_word(rest);
    } while (keyword.empty());
    return true;
  }

  /// Removes and returns the first word; empty at the end of the line or at a comment.
  static std::string_view next_word(std::string_view& line) {
    if (trimmed(line).starts_with('#'))
      line = {};
    return take_word(line);
  }

  int line() const { return line_; } ///< number of the (first) line, from 1

  Error error(ErrorCode code, std::string what, std::string hint) const {
    return error_at(line_, code, std::move(what), std::move(hint));
  }
  Error error_at(int line, ErrorCode code, std::string what, std::string hint) const {
    return {code, std::move(what), name_ + ", line " + std::to_string(line), std::move(hint)};
  }

private:
  bool next_joined(std::string_view& line) {
    if (!lines_.next(line))
      return false;
    line_ = lines_.number();
    if (!line.ends_with('\\'))
      return true;
    joined_.clear();
    while (line.ends_with('\\')) {
      joined_.append(line.substr(0, line.size() - 1)).push_back(' ');
      if (!lines_.next(line))
        line = {};
    }
    line = joined_.append(line);
    return true;
  }

  TextLines lines_;
  std::string name_, joined_;
  int line_ = 0;
};

} // namespace daylit::detail
