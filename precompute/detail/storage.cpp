#include "precompute/detail/storage.h"

#include <algorithm>
#include <cmath>

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

Rounded words(std::span<const float> numbers) {
  constexpr float kWordMost = 256 * kByteMost + kByteMost;
  Rounded r;
  if (const float most = largest(numbers); most > 0)
    r.unit = most / kWordMost;
  for (const float x : numbers) {
    const auto word = static_cast<std::int32_t>(std::clamp(nearest(x / r.unit), -kWordMost, kWordMost)),
               high = (word + 128) >> 8;
    r.byte.push_back(static_cast<std::int8_t>(high));
    r.low.push_back(static_cast<std::int8_t>(word - 256 * high));
  }
  return r;
}

Rounded bytes(std::span<const float> numbers) {
  Rounded r;
  if (const float most = largest(numbers); most > 0)
    r.unit = most / kByteMost;
  r.byte.resize(numbers.size());
  return r;
}

} // namespace

Rounded Rounded::row_factor(std::span<const float> numbers, Stored stored) {
  if (stored == Stored::words)
    return words(numbers);
  Rounded r = bytes(numbers);
  const float per_unit = 1.0f / r.unit;
  for (std::size_t k = 0; k < numbers.size(); ++k)
    r.byte[k] = static_cast<std::int8_t>(std::clamp(nearest(numbers[k] * per_unit), -kByteMost, kByteMost));
  return r;
}

Rounded Rounded::source_factor(std::span<const float> numbers, Stored stored) {
  if (stored == Stored::words)
    return words(numbers);
  Rounded r = bytes(numbers);
  const float per_unit = 1.0f / r.unit;
  float owed = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    if (numbers[k] == 0.0f)
      continue;
    const float wanted = numbers[k] * per_unit + owed, kept = std::clamp(nearest(wanted), -kByteMost, kByteMost);
    owed = std::clamp(wanted - kept, -1.0f, 1.0f);
    r.byte[k] = static_cast<std::int8_t>(kept);
  }
  return r;
}

double row_rounding2(std::span<const float> numbers) {
  double sum = 0;
  for (const float x : numbers)
    sum += square(static_cast<double>(x));
  const double step = static_cast<double>(largest(numbers) / kByteMost);
  return sum > 0 ? step * step / 12 * static_cast<double>(numbers.size()) / sum : 0.0;
}

std::vector<float> Rounded::values() const {
  std::vector<float> out(byte.size());
  for (std::size_t k = 0; k < byte.size(); ++k)
    out[k] = unit * (low.empty() ? static_cast<float>(byte[k])
                                 : 256.0f * static_cast<float>(byte[k]) + static_cast<float>(low[k]));
  return out;
}

namespace {

/// From one way to store a component to a cheaper one.
struct Saving {
  double error2, per_byte;
  std::size_t component;
  Stored to;
};

/// In the order in which they are taken.
std::vector<Saving> savings_of(std::span<const Component> components) {
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
  return savings;
}

} // namespace

std::vector<Stored> cheapest(std::span<const Component> components, double allowed, double* per_byte) {
  std::vector<Stored> choice(components.size(), Stored::words);
  double sum = 0, most = 0;
  for (const Saving& s : savings_of(components)) {
    if ((sum += s.error2) > allowed)
      break;
    choice[s.component] = s.to;
    most = s.per_byte;
  }
  if (per_byte)
    *per_byte = most;
  return choice;
}

std::vector<Stored> cheapest_at(std::span<const Component> components, double per_byte) {
  std::vector<Stored> choice(components.size(), Stored::words);
  for (const Saving& s : savings_of(components))
    if (s.per_byte <= per_byte)
      choice[s.component] = s.to;
  return choice;
}

} // namespace daylit::precompute::detail
