#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

struct XXH64_state_s;

namespace daylit {

/// XXH64, seed 0, of bytes that arrive in parts (Y. Collet, xxHash fast digest algorithm). Guards against damage and
/// tells contents apart; it is no protection against intent.
class Checksum {
public:
  Checksum();
  void add(std::span<const std::byte> bytes);
  /// The values as they lie in memory; T has no padding.
  template <class T>
  void add(const std::vector<T>& values) {
    add(std::as_bytes(std::span<const T>(values)));
  }
  std::uint64_t digest() const;
  std::string hex() const; ///< 16 digits

private:
  std::unique_ptr<XXH64_state_s, void (*)(XXH64_state_s*)> state_;
};

std::uint64_t checksum64(std::span<const std::byte> bytes);

} // namespace daylit
