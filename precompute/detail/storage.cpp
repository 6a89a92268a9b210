#include "precompute/detail/storage.h"

#include <algorithm>
#include <cmath>

#include "scene/detail/tile_kernels.h"

namespace daylit::precompute::detail {

namespace {

float largest(std::span<const float> numbers) {
  float most = 0;
  for (const float x : numbers)
    most = std::max(most, std::abs(x));
  return most;
}

constexpr float kByteMost = 127;

double square(double x) { return x * x; }

/// To the nearest integer, halfway to even; |x| below 2^22. Two additions instead of a call.
float nearest(float x) {
  constexpr float kUlpIsOne = 12582912.0f;
  return (x + kUlpIsOne) - kUlpIsOne;
}

Rounded halves(std::span<const float> numbers) {
  Rounded r;
  if (const float most = largest(numbers); most > 0)
    r.unit = most;
  for (const float x : numbers)
    r.half.push_back(daylit::detail::to_half(x / r.unit));
  return r;
}

/// `carry`: the share of an error that the next number takes over.
Rounded bytes(std::span<const float> numbers, float carry) {
  Rounded r;
  if (const float most = largest(numbers); most > 0)
    r.unit = most / kByteMost;
  r.byte.resize(numbers.size());
  const float per_unit = 1.0f / r.unit;
  float owed = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const float wanted = numbers[k] * per_unit;
    if (wanted == 0.0f)
      continue;
    const float kept = std::clamp(nearest(wanted + owed), -kByteMost, kByteMost);
    owed = carry * std::clamp(wanted + owed - kept, -1.0f, 1.0f);
    r.byte[k] = static_cast<std::int8_t>(kept);
    r.error2 += square(static_cast<double>(r.unit * (wanted - kept)));
    r.power2 += square(static_cast<double>(numbers[k]));
  }
  return r;
}

} // namespace

Rounded Rounded::row_factor(std::span<const float> numbers, Stored stored) {
  return stored == Stored::halves ? halves(numbers) : bytes(numbers, 0.0f);
}

Rounded Rounded::source_factor(std::span<const float> numbers, Stored stored) {
  return stored == Stored::halves ? halves(numbers) : bytes(numbers, 1.0f);
}

std::vector<float> Rounded::values() const {
  std::vector<float> out;
  for (const std::int8_t b : byte)
    out.push_back(unit * static_cast<float>(b));
  for (const std::uint16_t h : half)
    out.push_back(unit * daylit::detail::from_half(h));
  return out;
}

std::vector<Stored> cheapest(std::span<const Component> components, double allowed) {
  /// From one way to store a component to a cheaper one.
  struct Saving {
    double error2, per_byte;
    std::size_t component;
    Stored to;
  };
  std::vector<Saving> savings;
  for (std::size_t k = 0; k < components.size(); ++k) {
    const Component& c = components[k];
    const auto byte = static_cast<double>(c.numbers); // all its numbers as bytes
    const double to_bytes = std::min(c.byte_error2, c.power), to_nothing = c.power - to_bytes;
    if (to_nothing > to_bytes) {
      savings.push_back({to_bytes, to_bytes / byte, k, Stored::bytes});
      savings.push_back({to_nothing, to_nothing / byte, k, Stored::nothing});
    } else {
      savings.push_back({c.power, 0.5 * c.power / byte, k, Stored::nothing});
    }
  }
  std::ranges::stable_sort(savings, {}, &Saving::per_byte);
  std::vector<Stored> choice(components.size(), Stored::halves);
  double sum = 0;
  for (const Saving& s : savings) {
    if ((sum += s.error2) > allowed)
      break;
    choice[s.component] = s.to;
  }
  return choice;
}

} // namespace daylit::precompute::detail
