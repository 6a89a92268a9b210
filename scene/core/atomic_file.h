#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

/// Writes the parts one after another to a temporary name beside `path`, syncs, renames: a reader never sees half a
/// file.
Result<void> write_file_atomically(const std::filesystem::path& path,
                                   std::span<const std::span<const std::byte>> parts);
Result<void> write_file_atomically(const std::filesystem::path& path, const std::string& text);

/// Whole file into memory. Error: missing, unreadable, larger than `max_bytes`.
Result<std::vector<std::uint8_t>> read_whole_file(const std::filesystem::path& path,
                                                  std::size_t max_bytes = std::size_t{1} << 32);

} // namespace daylit
