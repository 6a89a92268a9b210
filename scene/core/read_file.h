#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

/// Bytes of a file that another file names (buffers, textures, material libraries), by the name written there.
using ReadFile = std::function<Result<std::vector<std::uint8_t>>(const std::string& file_name)>;

} // namespace daylit
