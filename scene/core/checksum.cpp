#include "scene/core/checksum.h"

#include "scene/core/xxh64.h"

namespace daylit {

std::uint64_t checksum64(std::span<const std::byte> bytes) {
  detail::Xxh64 hash;
  hash.add(bytes);
  return hash.digest();
}

} // namespace daylit
