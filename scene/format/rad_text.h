#pragma once

// The syntax of Radiance scenes: primitives, comments, and commands, of which only `!xform` is understood; it is
// parsed, never run. Source: Ward and Shakespeare 1998, Rendering with Radiance, chapter 2; ray.html, xform(1).

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"

namespace daylit::detail {

/// `modifier type identifier`, then the counted arguments. For an alias the modifier it stands for is in `words`.
struct RadPrimitive {
  std::string modifier, type, identifier;
  std::vector<std::string> words;
  std::vector<double> numbers; ///< the real arguments, finite
  int line = 0;                ///< of the modifier, from 1
};

/// `!xform OPTIONS FILE`: what stands in the file, once for each transform.
struct RadXform {
  std::string file;
  std::string modifier;               ///< -m: of all surfaces; empty: their own
  std::vector<glm::dmat4> transforms; ///< one, or those of the arrays (-a)
  int line = 0;
};

/// Reads one primitive or command after the other.
class RadReader {
public:
  RadReader(std::string_view text, std::string name);

  struct Item {
    std::optional<RadPrimitive> primitive;
    std::optional<RadXform> xform;
  };
  /// Empty at the end. Errors: file_malformed with file and line; a command other than xform.
  Result<std::optional<Item>> next();

private:
  void skip_space();
  std::string_view word();
  Result<RadPrimitive> read_primitive();
  Result<RadXform> read_command();
  Result<std::size_t> read_count(const RadPrimitive& p);
  Error error(int line, std::string what, std::string hint) const;

  std::string_view text_;
  std::string name_;
  int line_ = 1;
};

/// The arguments of `!xform`, the command's name taken off. `where` stands in errors.
Result<RadXform> parse_xform(std::string_view arguments, const std::string& where);

} // namespace daylit::detail
