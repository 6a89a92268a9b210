#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

/// Counts how often something was made or set: equal versions of one thing are the same thing. 0: never.
using Version = std::uint64_t;

/// A value that is set from outside.
template <class T>
class Versioned {
public:
  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }
  Version version() const { return version_; }
  void set(T value) {
    value_ = std::move(value);
    ++version_;
  }
  /// To change the value in its place.
  T& change() {
    ++version_;
    return value_;
  }

private:
  T value_{};
  Version version_ = 0;
};

/// A value with the versions of what it was made from. It is made anew, in its own memory, when one of them differs.
template <class T>
class Cached {
public:
  /// `make`: void(T&), a function of what `inputs` are the versions of.
  template <class Make>
  void update(std::initializer_list<Version> inputs, const Make& make) {
    (void)try_update(inputs, [&](T& value) -> Result<void> {
      make(value);
      return {};
    });
  }
  /// `make`: Result<void>(T&). After an Error the value is made again the next time.
  template <class Make>
  Result<void> try_update(std::initializer_list<Version> inputs, const Make& make) {
    reused_ = std::ranges::equal(inputs_, inputs);
    if (reused_)
      return {};
    inputs_.clear();
    if (const Result<void> made = make(value_); !made)
      return made;
    inputs_.assign(inputs);
    ++version_;
    return {};
  }

  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }
  Version version() const { return version_; }
  bool reused() const { return reused_; } ///< by the last update
  T& beside() { return value_; }          ///< for parts of the value that are not made from the inputs

private:
  T value_{};
  std::vector<Version> inputs_;
  Version version_ = 0;
  bool reused_ = false;
};

} // namespace daylit
