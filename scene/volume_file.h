#pragma once

#include <filesystem>

#include "scene/result.h"
#include "scene/volume.h"

namespace daylit {

/// Version of the layout described in docs/volume-format.md. A reader refuses any other.
constexpr int kVolumeFormatVersion = 1;

/// safetensors file: 8-byte header length, JSON header, little-endian tensors aligned to 64 bytes; checksummed.
Result<void> write_volume(const std::filesystem::path& path, const BasisVolume& volume);
/// Hostile input: every size is checked against the file before anything is allocated.
Result<BasisVolume> read_volume(const std::filesystem::path& path);
Result<BasisVolume> parse_volume(std::span<const std::uint8_t> bytes, const std::string& name);

} // namespace daylit
