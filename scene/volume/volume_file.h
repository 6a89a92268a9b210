#pragma once

// The `.volume` file: safetensors, documented in docs/volume-format.md.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "scene/core/output_file.h"
#include "scene/core/result.h"
#include "scene/volume/volume.h"

namespace daylit {

/// The version of the layout described in docs/volume-format.md. A reader refuses any other.
constexpr int kVolumeFormatVersion = 2;

/// How every volume starts: the length of its header, and the header's first key (docs/volume-format.md).
constexpr FileKind kVolumeKind{"a volume", R"({"__metadata__":{"checksum":")", 8};

/// How a basis per region is stored. Half floats have a scale per region: half the file, rounded by at most 2.5e-4 of
/// the region's largest number.
enum class BasisPrecision { float32, float16 };

/// Writes the file whole or not at all. Error: the volume breaks a rule of check_volume(), or the disk does.
Result<void> write_volume(const std::filesystem::path& path, const BasisVolume& volume,
                          BasisPrecision precision = BasisPrecision::float32);

/// The bytes that write_volume() writes.
Result<std::vector<std::uint8_t>> volume_bytes(const BasisVolume& volume,
                                               BasisPrecision precision = BasisPrecision::float32);

/// Files are hostile input: every size is checked against the file before anything is allocated, no allocation is
/// larger than twice the file or than what a packed tensor can hold (packed_tensors.h), and the result satisfies
/// check_volume(). Errors: file_missing; file_version names both versions; file_malformed for a wrong checksum or
/// anything inconsistent.
Result<BasisVolume> read_volume(const std::filesystem::path& path);
/// The same from memory; `name` only appears in errors.
Result<BasisVolume> parse_volume(std::span<const std::uint8_t> bytes, const std::string& name);

/// What every volume satisfies, on disk and off: sizes agree, indices are in range, numbers are finite, probes are
/// where the grid says, reflectances and transmittances are in 0..1.
Result<void> check_volume(const BasisVolume& volume);

} // namespace daylit
