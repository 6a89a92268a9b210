#pragma once

// What a program may write over, decided before its work begins.

#include <filesystem>
#include <string_view>

#include "scene/core/result.h"

namespace daylit {

/// A kind of file, told by the bytes at `offset`.
struct FileKind {
  const char* name; ///< "an OpenEXR picture"
  std::string_view start;
  std::size_t offset = 0;
};

/// Call when all inputs have been read. Error value_invalid: `path` is one of them (was_read()), is a folder, a pipe or
/// a device, or holds something else than `kind`, which only `force` replaces. Error io: its folder does not exist.
Result<void> check_output(const std::filesystem::path& path, const FileKind& kind, bool force);

} // namespace daylit
