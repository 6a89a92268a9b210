#include "precompute/detail/storage.h"

#include <algorithm>
#include <cmath>

namespace daylit::precompute::detail {

namespace {

constexpr float kWeakMost = 127, kStrongMost = 32767;

float largest(std::span<const float> values) {
  float most = 0;
  for (const float x : values)
    most = std::max(most, std::abs(x));
  return most;
}

/// To the nearest integer, halfway to even; |x| below 2^22. Two additions instead of a call.
float nearest(float x) {
  constexpr float kUlpIsOne = 12582912.0f;
  return (x + kUlpIsOne) - kUlpIsOne;
}

/// integer = nearest(number / step + what the rounding of those before left over, if it is carried on)
Rounded round(std::span<const float> values, float most_integer, bool carries_error) {
  Rounded r;
  if (const float most = largest(values); most > 0)
    r.step = most / most_integer;
  r.integer.resize(values.size());
  const float per_step = 1.0f / r.step;
  float owed = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (values[k] == 0.0f)
      continue;
    const float wanted = values[k] * per_step + owed, kept = std::clamp(nearest(wanted), -most_integer, most_integer);
    if (carries_error)
      owed = std::clamp(wanted - kept, -1.0f, 1.0f);
    r.integer[k] = static_cast<std::int16_t>(kept);
  }
  return r;
}

float most_integer(Stored stored) { return stored == Stored::strong ? kStrongMost : kWeakMost; }

} // namespace

Rounded Rounded::row_factor(std::span<const float> values, Stored stored) {
  return round(values, most_integer(stored), false);
}

Rounded Rounded::source_factor(std::span<const float> values, Stored stored) {
  return round(values, most_integer(stored), stored == Stored::weak);
}

/// Rounding to a step h errs by h^2 / 12 in the mean, independently (Bennett 1948): n h^2 / 12 / sum of x^2.
double row_rounding2(std::span<const float> values) {
  double sum = 0;
  for (const float x : values)
    sum += static_cast<double>(x) * static_cast<double>(x);
  const double step = static_cast<double>(largest(values) / kWeakMost);
  return sum > 0 ? step * step / 12 * static_cast<double>(values.size()) / sum : 0.0;
}

std::vector<float> Rounded::values() const {
  std::vector<float> out(integer.size());
  std::ranges::transform(integer, out.begin(), [this](std::int16_t x) { return step * static_cast<float>(x); });
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
    const auto bytes = static_cast<double>(c.size); // of all its numbers with 8 bits
    const double to_weak = std::min(c.weak_error2, c.power), to_nothing = c.power - to_weak;
    if (to_nothing > to_weak) {
      savings.push_back({to_weak, to_weak / bytes, k, Stored::weak});
      savings.push_back({to_nothing, to_nothing / bytes, k, Stored::nothing});
    } else {
      savings.push_back({c.power, 0.5 * c.power / bytes, k, Stored::nothing});
    }
  }
  std::ranges::stable_sort(savings, {}, &Saving::per_byte);
  return savings;
}

} // namespace

/// Greedy for the fractional knapsack: by error per byte saved, until the next saving no longer fits.
std::vector<Stored> cheapest(std::span<const Component> components, double allowed, double* per_byte) {
  std::vector<Stored> choice(components.size(), Stored::strong);
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

/// All savings that cost no more error per byte than given: the same trade as another list's.
std::vector<Stored> cheapest_at(std::span<const Component> components, double per_byte) {
  std::vector<Stored> choice(components.size(), Stored::strong);
  for (const Saving& s : savings_of(components))
    if (s.per_byte <= per_byte)
      choice[s.component] = s.to;
  return choice;
}

} // namespace daylit::precompute::detail
