#pragma once

#include <string>

namespace daylit {

/// ASCII letters only.
inline std::string lower_case(std::string name) {
  for (char& c : name)
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return name;
}

} // namespace daylit
