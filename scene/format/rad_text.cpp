#include "scene/format/rad_text.h"

#include <algorithm>
#include <cmath>

#include "scene/core/text_lines.h"

namespace daylit::detail {

namespace {

constexpr double kLargestNumber = 1e9;
constexpr std::size_t kMostArguments = 100'000'000;

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v'; }
bool is_text(char c) { return is_space(c) || static_cast<unsigned char>(c) >= 0x20; }

} // namespace

RadReader::RadReader(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

Error RadReader::error(int line, std::string what, std::string hint) const {
  return {ErrorCode::file_malformed, std::move(what), name_ + ", line " + std::to_string(line), std::move(hint)};
}

void RadReader::skip_space() {
  while (!text_.empty() && is_space(text_.front())) {
    line_ += text_.front() == '\n' ? 1 : 0;
    text_.remove_prefix(1);
  }
}

std::string_view RadReader::word() {
  skip_space();
  const auto end = static_cast<std::size_t>(std::ranges::find_if(text_, is_space) - text_.begin());
  const std::string_view found = text_.substr(0, end);
  text_.remove_prefix(end);
  return found;
}

Result<std::optional<RadReader::Item>> RadReader::next() {
  skip_space();
  while (text_.starts_with('#')) {
    text_.remove_prefix(std::min(text_.find('\n'), text_.size()));
    skip_space();
  }
  if (text_.empty())
    return std::optional<Item>();
  Item item;
  if (text_.starts_with('!')) {
    auto xform = read_command();
    if (!xform)
      return xform.error();
    item.xform = std::move(*xform);
  } else {
    auto primitive = read_primitive();
    if (!primitive)
      return primitive.error();
    item.primitive = std::move(*primitive);
  }
  return std::optional<Item>(std::move(item));
}

Result<std::size_t> RadReader::read_count(const RadPrimitive& p) {
  const std::string_view text = word();
  const std::optional<std::int64_t> count = parse_number<std::int64_t>(text);
  if (!count || *count < 0 || static_cast<std::size_t>(*count) > std::min(text_.size(), kMostArguments))
    return error(line_,
                 p.type + " " + p.identifier + " needs the number of its arguments, not '" +
                     std::string(text.substr(0, 40)) + "'",
                 "check that the file is a Radiance scene and complete");
  return static_cast<std::size_t>(*count);
}

Result<RadPrimitive> RadReader::read_primitive() {
  RadPrimitive p;
  p.line = line_;
  for (std::string* part : {&p.modifier, &p.type, &p.identifier}) {
    *part = word();
    if (part->empty() || part->size() > 1024 || !std::ranges::all_of(*part, is_text))
      return error(p.line, "this is no primitive of a Radiance scene", "expected: modifier type identifier, arguments");
  }
  if (p.type == "alias") {
    p.words.emplace_back(word());
    return p;
  }
  for (int list = 0; list < 3; ++list) {
    const Result<std::size_t> count = read_count(p);
    if (!count)
      return count.error();
    for (std::size_t i = 0; i < *count; ++i) {
      const std::string_view text = word();
      if (list == 0) {
        p.words.emplace_back(text);
        continue;
      }
      const std::optional<double> number = parse_number(text);
      if (!number || !(std::abs(*number) <= kLargestNumber))
        return error(line_, "'" + std::string(text.substr(0, 40)) + "' is no number up to 1e9",
                     "the file may be cut off here");
      if (list == 2)
        p.numbers.push_back(*number);
    }
  }
  return p;
}

Result<RadXform> RadReader::read_command() {
  const int line = line_;
  std::string command;
  for (bool more = true; more;) {
    const std::size_t end = std::min(text_.find('\n'), text_.size());
    std::string_view part = text_.substr(0, end);
    text_.remove_prefix(std::min(end + 1, text_.size()));
    ++line_;
    while (!part.empty() && is_space(part.back()))
      part.remove_suffix(1);
    more = part.ends_with('\\') && !text_.empty();
    if (part.ends_with('\\'))
      part.remove_suffix(1);
    command.append(part).push_back(' ');
  }
  std::string_view rest = std::string_view(command).substr(1);
  const std::string name(take_word(rest));
  if (name != "xform" || rest.find_first_of("|;&<>$`()\"'*?") != std::string_view::npos)
    return error(line, "the command '!" + name.substr(0, 40) + "' is not run: only a plain !xform is understood",
                 "run it and put what it prints in the scene: xform -e room.rad > plain.rad");
  auto xform = parse_xform(rest, name_ + ", line " + std::to_string(line));
  if (xform)
    xform->line = line;
  return xform;
}

} // namespace daylit::detail
