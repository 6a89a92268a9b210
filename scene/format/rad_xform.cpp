#include <cmath>
#include <numbers>

#include "scene/core/text_lines.h"
#include "scene/format/rad_text.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMostCopies = 10'000;

/// A part of the options: a transform that is repeated 0, 1, ... count - 1 times, or once.
struct Part {
  glm::dmat4 transform{1.0};
  std::size_t count = 1;
  bool is_array = false;
};

glm::dmat4 moved(const glm::dvec3& by) {
  glm::dmat4 m(1.0);
  m[3] = glm::dvec4(by, 1.0);
  return m;
}

glm::dmat4 scaled(const glm::dvec3& by) {
  glm::dmat4 m(1.0);
  for (int k = 0; k < 3; ++k)
    m[k][k] = by[k];
  return m;
}

/// Counter-clockwise about an axis, seen from its positive end.
glm::dmat4 turned(int axis, double degrees) {
  const double a = degrees * std::numbers::pi / 180.0;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  glm::dmat4 m(1.0);
  m[u][u] = m[v][v] = std::cos(a);
  m[u][v] = std::sin(a);
  m[v][u] = -std::sin(a);
  return m;
}

class XformParser {
public:
  XformParser(std::string_view arguments, const std::string& where) : rest_(arguments), where_(where) {}

  Result<RadXform> run() {
    for (std::string_view word = take_word(rest_); !word.empty(); word = take_word(rest_)) {
      if (!xform_.file.empty())
        return wrong("two files", "one !xform for each");
      if (!word.starts_with('-')) {
        xform_.file = word;
        continue;
      }
      if (const Result<void> done = read_option(word); !done)
        return done.error();
    }
    if (xform_.file.empty())
      return wrong("no file", "!xform OPTIONS FILE");
    return with_copies();
  }

private:
  Error wrong(const std::string& what, const std::string& hint) const {
    return {ErrorCode::file_malformed, "!xform: " + what, where_, hint};
  }

  Result<double> number() {
    const std::string_view word = take_word(rest_);
    const std::optional<double> value = parse_number(word);
    if (!value || !(std::abs(*value) <= 1e9))
      return wrong("'" + std::string(word.substr(0, 40)) + "' is no number", "see xform(1)");
    return *value;
  }

  void apply(const glm::dmat4& m) { parts_.back().transform = m * parts_.back().transform; }

  Result<void> read_option(std::string_view option) {
    if (option == "-t") {
      glm::dvec3 by(0.0);
      for (int k = 0; k < 3; ++k) {
        const Result<double> value = number();
        if (!value)
          return value.error();
        by[k] = *value;
      }
      apply(moved(by));
    } else if (option == "-mx" || option == "-my" || option == "-mz") {
      apply(scaled({option[2] == 'x' ? -1 : 1, option[2] == 'y' ? -1 : 1, option[2] == 'z' ? -1 : 1}));
    } else if (option == "-m" || option == "-n") {
      const std::string_view name = take_word(rest_);
      if (option == "-m")
        xform_.modifier = name;
    } else if (option == "-rx" || option == "-ry" || option == "-rz" || option == "-s" || option == "-a" ||
               option == "-i") {
      return read_number_option(option);
    } else if (option != "-I" && option != "-e" && option != "-c") {
      return wrong("the option " + std::string(option.substr(0, 40)) + " is not understood", "see xform(1)");
    }
    return {};
  }

  Result<void> read_number_option(std::string_view option) {
    const Result<double> value = number();
    if (!value)
      return value.error();
    if (option.starts_with("-r")) {
      apply(turned(option[2] - 'x', *value));
    } else if (option == "-s") {
      if (!(*value > 0.0))
        return wrong("-s needs a factor above zero", "");
      apply(scaled(glm::dvec3(*value)));
    } else {
      if (!(*value >= 1.0 && *value <= double(kMostCopies)) || *value != std::floor(*value))
        return wrong("copies from 1 to 10000", "");
      parts_.push_back({glm::dmat4(1.0), static_cast<std::size_t>(*value), option == "-a"});
    }
    return {};
  }

  /// -a: copy k has the part's transform k times; -i: all of them, count times. Parts follow one another.
  Result<RadXform> with_copies() {
    xform_.transforms = {glm::dmat4(1.0)};
    for (const Part& part : parts_) {
      std::vector<glm::dmat4> all;
      glm::dmat4 repeated(1.0);
      for (std::size_t k = 0; k < part.count; ++k) {
        if (!part.is_array)
          repeated = part.transform * repeated;
        if (part.is_array || k + 1 == part.count)
          for (const glm::dmat4& before : xform_.transforms)
            all.push_back(repeated * before);
        if (part.is_array)
          repeated = part.transform * repeated;
        if (all.size() > kMostCopies)
          return Error{ErrorCode::limit_exceeded, "!xform: more than 10000 copies", where_, ""};
      }
      xform_.transforms = std::move(all);
    }
    return std::move(xform_);
  }

  std::string_view rest_;
  const std::string& where_;
  RadXform xform_;
  std::vector<Part> parts_{1};
};

} // namespace

Result<RadXform> parse_xform(std::string_view arguments, const std::string& where) {
  return XformParser(arguments, where).run();
}

} // namespace daylit::detail
