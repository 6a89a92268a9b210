#pragma once

// Large tensors of a `.volume` file are packed: the tensor NAME, U8 [n], is then a zlib stream (RFC 1950), and the
// metadata `packed` say in a line "NAME TYPE d0 d1 ..." what it holds.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/format/safetensors.h"

namespace daylit::detail {

/// No stream holds more bytes than this times its own: what a reader allocates is bounded by the file.
constexpr std::size_t kMostPacked = 128;

/// Packs what becomes smaller by a tenth and more; `streams` keep what the tensors then refer to. The text of the
/// metadata.
std::string pack_tensors(std::vector<TensorToWrite>& tensors, std::vector<std::vector<std::byte>>& streams);

/// Type and shape of the packed tensors, places in the file as in `tensors`; of anything inconsistent, nothing.
std::map<std::string, TensorEntry> packed_tensors(const std::string& text,
                                                  const std::map<std::string, TensorEntry>& tensors);

/// Fills `bytes` whole. False: the stream is damaged, or holds another number of bytes.
bool unpack(std::span<const std::uint8_t> stream, std::span<std::byte> bytes);

} // namespace daylit::detail
