#include "scene/volume/volume_identity.h"

#include "scene/core/checksum.h"

namespace daylit::detail {

/// The digits are part of the header that they protect: while the hash runs they read as zeros.
std::string volume_checksum(std::span<const std::byte> header, std::size_t digits,
                            std::span<const std::span<const std::byte>> parts) {
  Checksum hash;
  hash.add(header.first(digits));
  hash.add(std::as_bytes(std::span(kNoChecksum)));
  hash.add(header.subspan(digits + kNoChecksum.size()));
  for (const auto& part : parts)
    hash.add(part);
  return hash.hex();
}

} // namespace daylit::detail
