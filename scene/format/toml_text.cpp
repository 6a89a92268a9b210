#include "scene/format/toml_text.h"

#include <fmt/format.h>

namespace daylit::detail {

std::string text(double value) {
  // TOML tells integers from floats by the dot; the readers take both.
  return fmt::format("{}", value);
}

std::string text(const glm::dvec3& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }
std::string text(const Rgb& c) { return fmt::format("[{}, {}, {}]", c.r, c.g, c.b); }

std::string text(const glm::dmat4& m) {
  std::string out = "[\n";
  for (int r = 0; r < 4; ++r)
    out += fmt::format("  [{}, {}, {}, {}]{}\n", m[0][r], m[1][r], m[2][r], m[3][r], r < 3 ? "," : "]");
  return out;
}

std::string quoted(const std::string& value) {
  std::string out = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\')
      out += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F)
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  return out + '"';
}

} // namespace daylit::detail
