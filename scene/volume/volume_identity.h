#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

namespace daylit::detail {

inline const std::string kVolumeFormat = "daylit.volume";
/// What stands in the place of the checksum while it is computed.
inline const std::string kNoChecksum(16, '0');
/// Coordinates of a graded grid along x, y and z.
inline const std::array<std::string, 3> kProbePlanes{"probe.plane_x", "probe.plane_y", "probe.plane_z"};
constexpr std::string_view kChecksumKey = "\"checksum\":\"";

/// XXH64 of the file with the sixteen digits of the checksum itself, at `digits` of the header, read as zeros.
std::string volume_checksum(std::span<const std::byte> header, std::size_t digits,
                            std::span<const std::span<const std::byte>> parts);

} // namespace daylit::detail
