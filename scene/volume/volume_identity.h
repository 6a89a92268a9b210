#pragma once

#include <span>
#include <string>
#include <string_view>

namespace daylit::detail {

inline const std::string kVolumeFormat = "daylit-volume";
/// What files of the versions before version 1 of this format call themselves; some of them have the version 1 too.
inline const std::string kOldVolumeFormat = "daylit.volume";
/// What stands in the place of the checksum while it is computed.
inline const std::string kNoChecksum(16, '0');
constexpr std::string_view kChecksumKey = "\"checksum\":\"";

/// XXH64 of the file with the sixteen digits of the checksum itself, at `digits` of the header, read as zeros.
std::string volume_checksum(std::span<const std::byte> header, std::size_t digits,
                            std::span<const std::span<const std::byte>> parts);

} // namespace daylit::detail
