#pragma once

// Errors are values: what went wrong, where, and what the user does next. Libraries never exit, print or throw
// across a public boundary; only a program's main turns an Error into text and an exit code (scene/core/program.h).

#include <string>

#include "sh/error.h"

namespace daylit {

enum class ErrorCode {
  usage,            ///< command line or argument outside its documented range
  file_missing,     ///< no such file, or it cannot be opened
  file_malformed,   ///< truncated, damaged, or not the format it claims to be
  file_version,     ///< a format version that this program does not read
  value_invalid,    ///< NaN, negative radiance, reflectance outside 0..1, unknown key
  geometry_invalid, ///< degenerate room, no window and no hole
  not_found,        ///< no marker in the picture, no probe near the point
  limit_exceeded,   ///< would need more memory, patches or time than allowed
  device,           ///< graphics or camera
  interrupted,      ///< Ctrl-C; work so far is kept in a checkpoint where the program has one
  io,               ///< writing failed (disk full, permission)
};

struct Error {
  ErrorCode code = ErrorCode::value_invalid;
  std::string what;  ///< "radiance is negative"
  std::string where; ///< "sky.exr, pixel (12, 40)"
  std::string hint;  ///< "re-export the image without sharpening"

  /// "sky.exr, pixel (12, 40): radiance is negative; re-export the image without sharpening"
  std::string message() const {
    std::string text = where.empty() ? what : where + ": " + what;
    return hint.empty() ? text : text + "; " + hint;
  }
};

/// Either a value or an Error; Result<void>: success or an Error. `if (!r) return r.error();` passes an error on.
template <class T>
using Result = sh::Expected<T, Error>;

} // namespace daylit
