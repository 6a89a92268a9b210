#pragma once

#include <cstdint>
#include <random>

namespace daylit::bench {

/// Numbers at random, the same on every machine for a seed.
class Chance {
public:
  explicit Chance(std::uint32_t seed) : random_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * ((static_cast<double>(random_()) + 0.5) / 4294967296.0);
  }
  /// 0 to n - 1.
  std::size_t below(std::size_t n) { return random_() % n; }

private:
  std::mt19937 random_;
};

} // namespace daylit::bench
