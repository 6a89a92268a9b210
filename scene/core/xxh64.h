#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace daylit::detail {

/// XXH64, seed 0, as specified by Y. Collet (xxHash fast digest algorithm, doc/xxhash_spec.md, XXH64 algorithm
/// description). A checksum against damage, not against intent.
class Xxh64 {
public:
  void add(std::span<const std::byte> bytes);
  std::uint64_t digest() const;

private:
  void stripes(const std::byte* p, std::size_t count);

  std::array<std::uint64_t, 4> lane_{0x60EA27EEADC0B5D6u, 0xC2B2AE3D27D4EB4Fu, 0u, 0x61C8864E7A143579u};
  std::array<std::byte, 32> buffer_{};
  std::size_t buffered_ = 0;
  std::uint64_t total_ = 0;
};

} // namespace daylit::detail
