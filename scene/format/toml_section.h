#pragma once

// Reading one TOML table key by key. Every key that is read is a known key; what is left over at the end is an
// unknown one. All problems of a file are collected and reported together.

#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <toml++/toml.h>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit::detail {

struct ConfigProblem {
  unsigned line = 0;
  std::string text;
};

struct ConfigFile {
  std::filesystem::path path;
  toml::table root;
  std::vector<ConfigProblem> problems;

  void report(unsigned line, std::string text) { problems.push_back({line, std::move(text)}); }
  /// Empty when there is no problem. Names the first line; the text lists all of them, in the order of the file.
  std::optional<Error> error() const;
};

/// Error: missing, not TOML (with line and column).
Result<ConfigFile> parse_config_file(const std::filesystem::path& path);
Result<ConfigFile> parse_config_text(std::string_view text, const std::filesystem::path& path);

/// Numbers outside [low, high], or not finite, are problems.
struct Range {
  double low = -1e30, high = 1e30;
};

class TomlSection {
public:
  /// `table` null: the section is absent, every read keeps the default.
  TomlSection(ConfigFile& file, const toml::table* table, std::string name);

  explicit operator bool() const { return table_ != nullptr; }
  /// Whether `key` is there, without reading it: it is known then.
  bool has(const std::string& key);
  unsigned line(const std::string& key = "") const;
  void problem(const std::string& key, const std::string& text);

  bool read(const std::string& key, std::string& value);
  bool read(const std::string& key, std::filesystem::path& value); ///< made relative to the file's folder
  bool read(const std::string& key, double& value, Range range = {});
  bool read(const std::string& key, float& value, Range range = {});
  bool read(const std::string& key, int& value, Range range = {});
  bool read(const std::string& key, bool& value);
  bool read(const std::string& key, std::vector<int>& value, Range range = {});
  bool read(const std::string& key, glm::dvec3& value, Range range = {});
  bool read_array(const std::string& key, std::span<double> values, Range range = {}); ///< exactly so many
  /// Three numbers, or one number for all channels.
  bool read_rgb(const std::string& key, Rgb& value, Range range = {});
  /// Row-major, flat or one array per row.
  bool read(const std::string& key, glm::dmat3& value);
  bool read(const std::string& key, glm::dmat4& value);
  /// Rows of `columns` numbers, as an array of arrays; one row at least.
  bool read_rows(const std::string& key, std::size_t columns, std::vector<double>& values, Range range = {});
  /// [width, height], each 1..32768.
  bool read_size(const std::string& key, int& width, int& height);
  /// One of the words, else a problem with a suggestion.
  bool read_word(const std::string& key, std::string& value, const std::vector<std::string>& words);
  bool is_number(const std::string& key) const;
  bool is_text(const std::string& key) const;

  TomlSection section(const std::string& key);               ///< a problem when `key` is there and no table
  TomlSection section_if_table(const std::string& key);      ///< absent when `key` is no table
  std::vector<TomlSection> sections(const std::string& key); ///< [[key]]

  std::vector<std::string> keys() const; ///< all of the table, in its order

  /// Reports every key that was not read. Call once, last.
  void finish();

private:
  ConfigFile* file_;
  const toml::table* table_;
  std::string name_;
  std::set<std::string> known_;

  const toml::node* find(const std::string& key);
  template <class T>
  bool read_exact(const std::string& key, T& value, const char* expected);
  template <class Matrix>
  bool read_matrix(const std::string& key, Matrix& value);
  bool read_numbers(const std::string& key, std::vector<double>& values, std::size_t count, Range range);
  std::string where(const std::string& key) const;
};

/// The word of `words` closest to `word` by edit distance; empty when none is near.
std::string closest_word(const std::string& word, const std::vector<std::string>& words);

} // namespace daylit::detail
