#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace daylit::radiosity {

/// Patches that rays have met, -1 for none: many, in 16 bits each where all numbers fit.
class PatchNumbers {
public:
  PatchNumbers() = default;
  explicit PatchNumbers(std::size_t patches) : is_narrow_(fits(patches)) {}

  static std::size_t bytes_each(std::size_t patches) {
    return fits(patches) ? sizeof(std::uint16_t) : sizeof(std::int32_t);
  }
  std::size_t size() const { return is_narrow_ ? narrow_.size() : wide_.size(); }
  void resize(std::size_t size) { is_narrow_ ? narrow_.resize(size) : wide_.resize(size); }
  /// From [first] on. Several threads may work on different ranges.
  void put(std::size_t first, std::span<const std::int32_t> numbers) {
    for (std::size_t k = 0; k < numbers.size(); ++k)
      if (is_narrow_)
        narrow_[first + k] = static_cast<std::uint16_t>(numbers[k]);
      else
        wide_[first + k] = numbers[k];
  }
  void get(std::size_t first, std::span<std::int32_t> numbers) const {
    for (std::size_t k = 0; k < numbers.size(); ++k)
      numbers[k] = !is_narrow_ ? wide_[first + k] : narrow_[first + k] == kNone ? -1 : narrow_[first + k];
  }

private:
  static constexpr std::uint16_t kNone = 0xffff; ///< -1 in 16 bits
  static bool fits(std::size_t patches) { return patches <= kNone; }

  bool is_narrow_ = true;
  std::vector<std::uint16_t> narrow_;
  std::vector<std::int32_t> wide_;
};

} // namespace daylit::radiosity
