#include "scene/format/toml_section.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "scene/core/read_file.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMaxConfigBytes = std::size_t{1} << 20;

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j)
    row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

} // namespace

std::string closest_word(const std::string& word, const std::vector<std::string>& words) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 2) + 1;
  for (const std::string& candidate : words)
    if (const std::size_t d = edit_distance(word, candidate); d < best_distance) {
      best = candidate;
      best_distance = d;
    }
  return best;
}

std::optional<Error> ConfigFile::error() const {
  if (problems.empty())
    return std::nullopt;
  std::vector<ConfigProblem> sorted = problems;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const ConfigProblem& a, const ConfigProblem& b) { return a.line < b.line; });
  std::string text = sorted.front().text;
  for (std::size_t i = 1; i < sorted.size(); ++i)
    text += fmt::format("; line {}: {}", sorted[i].line, sorted[i].text);
  return Error{ErrorCode::value_invalid, text, fmt::format("{}, line {}", path.string(), sorted.front().line), ""};
}

Result<ConfigFile> parse_config_file(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, kMaxConfigBytes);
  if (!bytes)
    return bytes.error();
  return parse_config_text({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path);
}

Result<ConfigFile> parse_config_text(std::string_view text, const std::filesystem::path& path) {
  try {
    return ConfigFile{path, toml::parse(text, path.string()), {}};
  } catch (const toml::parse_error& e) {
    return Error{ErrorCode::file_malformed, std::string(e.description()),
                 fmt::format("{}, line {}, column {}", path.string(), e.source().begin.line, e.source().begin.column),
                 "the file is read as TOML 1.0"};
  }
}

TomlSection::TomlSection(ConfigFile& file, const toml::table* table, std::string name)
    : file_(&file), table_(table), name_(std::move(name)) {}

std::string TomlSection::where(const std::string& key) const {
  if (name_.empty())
    return key;
  return key.empty() ? "[" + name_ + "]" : "[" + name_ + "] " + key;
}

const toml::node* TomlSection::find(const std::string& key) {
  known_.insert(key);
  return table_ ? table_->get(key) : nullptr;
}

bool TomlSection::has(const std::string& key) { return find(key) != nullptr; }

unsigned TomlSection::line(const std::string& key) const {
  if (!table_)
    return 0;
  const toml::node* node = key.empty() ? nullptr : table_->get(key);
  return node ? node->source().begin.line : table_->source().begin.line;
}

void TomlSection::problem(const std::string& key, const std::string& text) {
  file_->report(line(key), where(key) + ": " + text);
}

template <class T>
bool TomlSection::read_exact(const std::string& key, T& value, const char* expected) {
  const toml::node* node = find(key);
  if (!node)
    return false;
  const std::optional<T> found = node->value_exact<T>();
  if (found)
    value = *found;
  else
    problem(key, expected);
  return found.has_value();
}

bool TomlSection::read(const std::string& key, std::string& value) {
  return read_exact(key, value, "expected a text in quotes");
}

bool TomlSection::read(const std::string& key, std::filesystem::path& value) {
  std::string text;
  if (!read(key, text))
    return false;
  if (text.empty()) {
    problem(key, "the path is empty");
    return false;
  }
  const std::filesystem::path given(text);
  value = given.is_absolute() ? given : (file_->path.parent_path() / given).lexically_normal();
  return true;
}

bool TomlSection::read(const std::string& key, double& value, Range range) {
  std::vector<double> numbers;
  if (!read_numbers(key, numbers, 1, range))
    return false;
  value = numbers[0];
  return true;
}

bool TomlSection::read(const std::string& key, float& value, Range range) {
  double number = 0.0;
  if (!read(key, number, range))
    return false;
  value = static_cast<float>(number);
  return true;
}

bool TomlSection::read(const std::string& key, int& value, Range range) {
  double number = 0.0;
  range = {std::max(range.low, -2147483648.0), std::min(range.high, 2147483647.0)};
  if (!read(key, number, range))
    return false;
  if (number != std::floor(number)) {
    problem(key, fmt::format("expected a whole number, got {}", number));
    return false;
  }
  value = static_cast<int>(number);
  return true;
}

bool TomlSection::read(const std::string& key, bool& value) { return read_exact(key, value, "expected true or false"); }

bool TomlSection::read(const std::string& key, std::vector<int>& value, Range range) {
  const toml::node* node = find(key);
  if (!node)
    return false;
  const toml::array* array = node->as_array();
  if (!array || array->empty() || array->size() > 100000) {
    problem(key, "expected a list of whole numbers");
    return false;
  }
  std::vector<double> numbers;
  if (!read_numbers(key, numbers, array->size(), range))
    return false;
  value.clear();
  for (const double number : numbers) {
    if (number != std::floor(number) || std::abs(number) > 2147483647.0) {
      problem(key, fmt::format("expected whole numbers, got {}", number));
      return false;
    }
    value.push_back(static_cast<int>(number));
  }
  return true;
}

bool TomlSection::read(const std::string& key, glm::dvec3& value, Range range) {
  std::vector<double> n;
  if (!read_numbers(key, n, 3, range))
    return false;
  value = glm::dvec3(n[0], n[1], n[2]);
  return true;
}

bool TomlSection::read_array(const std::string& key, std::span<double> values, Range range) {
  std::vector<double> n;
  if (!read_numbers(key, n, values.size(), range))
    return false;
  std::copy(n.begin(), n.end(), values.begin());
  return true;
}

bool TomlSection::read_rgb(const std::string& key, Rgb& value, Range range) {
  glm::dvec3 v(0.0);
  const bool good = is_number(key) ? read(key, v.x, range) : read(key, v, range);
  if (good)
    value = is_number(key) ? Rgb(static_cast<float>(v.x)) : Rgb(v);
  return good;
}

template <class Matrix>
bool TomlSection::read_matrix(const std::string& key, Matrix& value) {
  constexpr int kSide = Matrix::length();
  std::vector<double> n;
  if (!read_numbers(key, n, std::size_t{kSide * kSide}, {}))
    return false;
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      value[column][row] = n[static_cast<std::size_t>(kSide * row + column)];
  return true;
}

bool TomlSection::read(const std::string& key, glm::dmat3& value) { return read_matrix(key, value); }
bool TomlSection::read(const std::string& key, glm::dmat4& value) { return read_matrix(key, value); }

bool TomlSection::read_rows(const std::string& key, std::size_t columns, std::vector<double>& values, Range range) {
  const toml::node* node = find(key);
  if (!node)
    return false;
  const toml::array* rows = node->as_array();
  bool good = rows && !rows->empty() && rows->size() <= 100000;
  for (std::size_t k = 0; good && k < rows->size(); ++k)
    good = rows->get(k)->is_array() && rows->get(k)->as_array()->size() == columns;
  if (!good) {
    problem(key, fmt::format("expected a list of lists of {} numbers", columns));
    return false;
  }
  return read_numbers(key, values, rows->size() * columns, range);
}

bool TomlSection::read_size(const std::string& key, int& width, int& height) {
  std::vector<int> size;
  if (!read(key, size, {1, 32768}))
    return false;
  if (size.size() != 2) {
    problem(key, "expected [width, height]");
    return false;
  }
  width = size[0];
  height = size[1];
  return true;
}

bool TomlSection::read_word(const std::string& key, std::string& value, const std::vector<std::string>& words) {
  std::string word;
  if (!read(key, word))
    return false;
  if (std::find(words.begin(), words.end(), word) != words.end()) {
    value = word;
    return true;
  }
  const std::string near = closest_word(word, words);
  problem(key, fmt::format("'{}' is not known{}; one of: {}", word,
                           near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near), fmt::join(words, ", ")));
  return false;
}

bool TomlSection::is_number(const std::string& key) const {
  const toml::node* node = table_ ? table_->get(key) : nullptr;
  return node && node->is_number();
}

bool TomlSection::is_text(const std::string& key) const {
  const toml::node* node = table_ ? table_->get(key) : nullptr;
  return node && node->is_string();
}

bool TomlSection::read_numbers(const std::string& key, std::vector<double>& values, std::size_t count, Range range) {
  const toml::node* node = find(key);
  if (!node)
    return false;
  bool good = true;
  const auto collect = [&](const auto& self, const toml::node& n, int depth) -> void {
    if (const toml::array* array = n.as_array(); array && depth < 2) {
      for (const toml::node& child : *array)
        self(self, child, depth + 1);
    } else if (n.is_number() && values.size() <= count) {
      values.push_back(*n.value<double>());
    } else {
      good = false;
    }
  };
  collect(collect, *node, 0);
  if (!good || values.size() != count || (count == 1 && node->is_array() && node->as_array()->size() != 1)) {
    problem(key, count == 1 ? "expected a number" : fmt::format("expected {} numbers", count));
    return false;
  }
  for (const double v : values)
    if (!std::isfinite(v) || v < range.low || v > range.high) {
      problem(key, fmt::format("{} is outside the range {} to {}", v, range.low, range.high));
      return false;
    }
  return true;
}

TomlSection TomlSection::section(const std::string& key) {
  const toml::node* node = find(key);
  if (node && !node->is_table())
    problem(key, "expected a table");
  return section_if_table(key);
}

TomlSection TomlSection::section_if_table(const std::string& key) {
  const toml::node* node = find(key);
  const std::string full = name_.empty() ? key : name_ + "." + key;
  return TomlSection(*file_, node ? node->as_table() : nullptr, full);
}

std::vector<TomlSection> TomlSection::sections(const std::string& key) {
  std::vector<TomlSection> list;
  const toml::node* node = find(key);
  if (!node)
    return list;
  const toml::array* array = node->as_array();
  if (!array) {
    problem(key, fmt::format("write [[{}]], with double brackets", key));
    return list;
  }
  for (const toml::node& child : *array) {
    if (!child.is_table())
      problem(key, "expected tables");
    else
      list.emplace_back(*file_, child.as_table(), key);
  }
  return list;
}

std::vector<std::string> TomlSection::keys() const {
  std::vector<std::string> names;
  if (table_)
    for (const auto& [key, node] : *table_)
      names.emplace_back(key.str());
  return names;
}

void TomlSection::finish() {
  if (!table_)
    return;
  const std::vector<std::string> words(known_.begin(), known_.end());
  for (const auto& [key, node] : *table_) {
    const std::string name(key.str());
    if (known_.contains(name))
      continue;
    const std::string near = closest_word(name, words);
    file_->report(key.source().begin.line,
                  fmt::format("unknown key '{}'{}", where(name),
                              near.empty() ? fmt::format("; known here: {}", fmt::join(words, ", "))
                                           : fmt::format(", did you mean '{}'?", near)));
  }
}

} // namespace daylit::detail
