#pragma once

// Places of objects written back to the file that they were read from.

#include <filesystem>
#include <span>
#include <string>

#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

/// The text of a CONFIG.toml with its objects where `objects` says (`position`, or `on = [x, y]`); every other
/// character stays, comments and order too. `path`: for errors. Error value_invalid: the text has other objects.
Result<std::string> with_placements(const std::string& text, std::span<const ObjectConfig> objects,
                                    const std::filesystem::path& path);

/// The same for the file, replaced as a whole.
Result<void> write_placements(const std::filesystem::path& path, std::span<const ObjectConfig> objects);

} // namespace daylit
