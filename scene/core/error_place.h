#pragma once

#include <string>
#include <utility>

#include "scene/core/result.h"

namespace daylit {

/// The error of a part of something: `where` comes before the part's own place.
inline Error placed_in(const std::string& where, Error error) {
  error.where = error.where.empty() ? where : where + ", " + error.where;
  return error;
}

} // namespace daylit
