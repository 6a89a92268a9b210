#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace daylit {

/// XXH64 of the bytes: against damage, not against intent.
std::uint64_t checksum64(std::span<const std::byte> bytes);

} // namespace daylit
