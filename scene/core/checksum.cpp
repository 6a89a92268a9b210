#include "scene/core/checksum.h"

#include <bit>
#include <new>

#include <fmt/format.h>
#include <xxhash.h>

namespace daylit {

static_assert(std::endian::native == std::endian::little, "files and their checksums are little-endian");

Checksum::Checksum() : state_(XXH64_createState(), [](XXH64_state_s* state) { XXH64_freeState(state); }) {
  if (!state_)
    throw std::bad_alloc();
  XXH64_reset(state_.get(), 0);
}

void Checksum::add(std::span<const std::byte> bytes) {
  if (!bytes.empty())
    XXH64_update(state_.get(), bytes.data(), bytes.size());
}

std::uint64_t Checksum::digest() const { return XXH64_digest(state_.get()); }

std::string Checksum::hex() const { return fmt::format("{:016x}", digest()); }

std::uint64_t checksum64(std::span<const std::byte> bytes) {
  Checksum sum;
  sum.add(bytes);
  return sum.digest();
}

} // namespace daylit
