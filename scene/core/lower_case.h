#pragma once

#include <string>

namespace daylit {

/// ASCII letters only.
inline std::string lower_case(std::string name) {
  for (char& c : name)
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return name;
}

/// Names of materials, compared without regard to case.
inline bool same_name(const std::string& a, const std::string& b) { return lower_case(a) == lower_case(b); }

} // namespace daylit
