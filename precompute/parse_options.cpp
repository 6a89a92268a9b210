#include "precompute/parse_options.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string_view>
#include <vector>

namespace daylit::precompute {

namespace {

/// As many numbers as `count`, separated by commas.
Result<std::vector<double>> parse_numbers(const std::string& text, std::size_t count, const char* option) {
  std::vector<double> numbers;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (word.empty() || *end != 0 || !std::isfinite(numbers.back()))
      numbers.resize(count + 1);
  }
  if (numbers.size() != count)
    return Error{ErrorCode::usage, "'" + text + "' is not " + std::to_string(count) + " numbers", option,
                 "metres, separated by commas"};
  return numbers;
}

} // namespace

Result<glm::ivec3> parse_grid(const std::string& text) {
  glm::ivec3 n(0);
  char rest = 0;
  if (std::sscanf(text.c_str(), "%d,%d,%d%c", &n.x, &n.y, &n.z, &rest) != 3 || n.x < 2 || n.y < 2 || n.z < 2)
    return Error{ErrorCode::usage, "'" + text + "' is not a grid", "--grid", "three numbers of at least 2, as 8,8,8"};
  return n;
}

Result<glm::dvec3> parse_point(const std::string& text) {
  const auto n = parse_numbers(text, 3, "--inside");
  return n ? Result<glm::dvec3>({(*n)[0], (*n)[1], (*n)[2]}) : n.error();
}

/// Two opposite corners, the smaller coordinates first.
Result<Bounds> parse_box(const std::string& text) {
  const auto n = parse_numbers(text, 6, "--box");
  if (!n)
    return n.error();
  const Bounds box{{(*n)[0], (*n)[1], (*n)[2]}, {(*n)[3], (*n)[4], (*n)[5]}};
  const glm::dvec3 size = box.size();
  if (!(std::min({size.x, size.y, size.z}) > 0))
    return Error{ErrorCode::usage, "the box has no volume", "--box", "X0,Y0,Z0,X1,Y1,Z1 with X0 < X1 and so on"};
  return box;
}

Result<double> parse_percent(const std::string& text) {
  double value = 0;
  int end = 0;
  if (std::sscanf(text.c_str(), "%lf %n", &value, &end) != 1 || !std::isfinite(value))
    return Error{ErrorCode::usage, "'" + text + "' is no error in per cent", "--max-error", "a number, as 2 or 2%"};
  const std::string_view rest = std::string_view(text).substr(static_cast<std::size_t>(end));
  if (!rest.empty() && rest != "%")
    return Error{ErrorCode::usage, "'" + text + "' is no error in per cent", "--max-error", "a number, as 2 or 2%"};
  return 0.01 * value;
}

Result<double> parse_quality(const std::string& name) {
  if (name == "draft")
    return 0.04;
  if (name == "normal")
    return 0.02;
  if (name == "high")
    return 0.01;
  return Error{ErrorCode::usage, "unknown quality '" + name + "'", "--quality", "use draft, normal or high"};
}

std::string content_arguments(const std::vector<std::string>& words, const std::string& for_time) {
  std::string text = "daylit-precompute";
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--time" || word.starts_with("--time=")) {
      text += for_time;
      i += word == "--time";
    } else if (word == "-o" || word == "--output" || word == "--threads" || word == "--memory")
      ++i;
    else if (word != "--resume" && word != "--force" && word != "--quiet" && word != "--json" &&
             !word.starts_with("--output=") && !word.starts_with("--threads=") && !word.starts_with("--memory=") &&
             !word.starts_with("-o"))
      text += " " + word;
  }
  return text;
}

} // namespace daylit::precompute
