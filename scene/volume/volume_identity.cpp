#include "scene/volume/volume_identity.h"

#include <fmt/format.h>

#include "scene/core/xxh64.h"

namespace daylit::detail {

std::string volume_checksum(std::span<const std::byte> header, std::size_t digits,
                            std::span<const std::span<const std::byte>> parts) {
  Xxh64 hash;
  hash.add(header.first(digits));
  hash.add(std::as_bytes(std::span(kNoChecksum)));
  hash.add(header.subspan(digits + kNoChecksum.size()));
  for (const auto& part : parts)
    hash.add(part);
  return fmt::format("{:016x}", hash.digest());
}

} // namespace daylit::detail
