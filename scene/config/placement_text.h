#pragma once

// Objects written back to the file that they were read from.

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

/// An object as it is now, and which [[object]] of the file it was (from 0); empty: it came later.
struct EditedObject {
  ObjectConfig object;
  std::optional<std::size_t> in_file;
};

/// The text of a CONFIG.toml with the objects as they are now: place (`position`, or `on = [x, y]`), rotation and scale
/// of those that it has are changed where they differ, objects that are not listed any more are taken out, new ones
/// put after the last; every other character stays, comments and order too. `path`: for errors, and what the models of
/// new objects are named relative to. Error value_invalid: the text has other objects than `was` when it was read, or
/// they stand in one line and one of them is to go or come.
Result<std::string> with_objects(const std::string& text, std::span<const EditedObject> objects, std::size_t was,
                                 const std::filesystem::path& path);

/// The same for the file, replaced as a whole.
Result<void> write_objects(const std::filesystem::path& path, std::span<const EditedObject> objects, std::size_t was);

/// Where none came or went.
Result<void> write_placements(const std::filesystem::path& path, std::span<const ObjectConfig> objects);

} // namespace daylit
