#pragma once

// The safetensors container: 8-byte little-endian header length, JSON header, tensors. Strict: as its reference
// reader demands, the tensors cover the data without holes. Alignment to 64 bytes is made with tensors named
// `_padding_N`.

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit::detail {

struct TensorEntry {
  std::string dtype; ///< F64, F32, F16, I32, I16, I8, U32, U16, U8
  std::vector<std::uint64_t> shape;
  std::uint64_t begin = 0, end = 0; ///< bytes, from the start of the data
  std::uint64_t count() const {     ///< checked on reading: no overflow
    std::uint64_t n = 1;
    for (const std::uint64_t d : shape)
      n *= d;
    return n;
  }
};

struct SafetensorsHeader {
  std::map<std::string, TensorEntry> tensors;
  std::map<std::string, std::string> metadata;
  std::uint64_t data_offset = 0; ///< of the first tensor in the file
};

/// Bytes per element, 0 for a type that is not known.
std::uint64_t dtype_bytes(const std::string& dtype);

/// Checks every size and offset against the bytes at hand; never allocates more than the header's own length.
Result<SafetensorsHeader> parse_safetensors(std::span<const std::uint8_t> file, const std::string& name);

/// A tensor to be written; `bytes` must outlive the writer.
struct TensorToWrite {
  std::string name, dtype;
  std::vector<std::uint64_t> shape;
  std::span<const std::byte> bytes;
};

/// Header text (length word included) and the parts of the data, padding included, in order. The first part's place
/// in the file is a multiple of 64.
struct SafetensorsImage {
  std::string header;
  std::vector<std::span<const std::byte>> parts;
};
SafetensorsImage layout_safetensors(std::span<const TensorToWrite> tensors,
                                    const std::map<std::string, std::string>& metadata);

} // namespace daylit::detail
