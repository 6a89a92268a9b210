#include "scene/checksum.h"

#include "scene/detail/xxh64.h"

namespace daylit {

std::uint64_t checksum64(std::span<const std::byte> bytes) {
  detail::Xxh64 hash;
  hash.add(bytes);
  return hash.digest();
}

} // namespace daylit
