#pragma once

#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

/// One thing that was looked at.
struct Finding {
  enum class Level {
    ok,
    warning, ///< it works, but not as well as it could
    error,   ///< daylit-run will not start, or has no picture
  };
  Level level = Level::ok;
  std::string subject; ///< "interior camera", "volume"
  std::string found;   ///< what is there
  std::string change;  ///< what to do; empty where all is well
};
using Findings = std::vector<Finding>;

inline Finding all_well(std::string subject, std::string found) {
  return {Finding::Level::ok, std::move(subject), std::move(found), {}};
}
inline Finding warning(std::string subject, std::string found, std::string change) {
  return {Finding::Level::warning, std::move(subject), std::move(found), std::move(change)};
}
inline Finding failure(std::string subject, std::string found, std::string change) {
  return {Finding::Level::error, std::move(subject), std::move(found), std::move(change)};
}
/// The place of an error stands with what was found.
inline Finding failure(std::string subject, const Error& e) {
  return failure(std::move(subject), e.where.empty() ? e.what : e.where + ": " + e.what, e.hint);
}

} // namespace daylit
