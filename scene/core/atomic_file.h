#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "scene/core/result.h"

namespace daylit {

/// Writes the parts one after another to a temporary name beside `path`, syncs, renames: a reader never sees half a
/// file.
Result<void> write_file_atomically(const std::filesystem::path& path,
                                   std::span<const std::span<const std::byte>> parts);
Result<void> write_file_atomically(const std::filesystem::path& path, const std::string& text);

} // namespace daylit
