#pragma once

// A value or an error, for all modules, and the errors of this one. It is used alone by others, so it needs nothing but
// the standard library: a bad argument comes back as a value that says what was wrong and where. Nothing here throws,
// prints or aborts.

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace daylit::sh {

enum class ErrorCode {
  degree_out_of_range,  ///< negative, or above what the function documents
  wrong_count,          ///< a span whose length does not fit degree, channels or grid
  not_a_unit_direction, ///< a direction whose length is not 1
  not_finite,           ///< NaN or infinity in the input
  parameter_out_of_range,
};

struct Error {
  ErrorCode code = ErrorCode::parameter_out_of_range;
  std::string what;  ///< "wrong number of coefficients: 8, degree 2 needs 9"
  std::string where; ///< "RingTransform::synthesise"

  std::string message() const { return where + ": " + what; }
};

/// Either a value or an error E. `if (!r) return r.error();` passes an error on.
template <class T, class E = Error>
class [[nodiscard]] Expected {
public:
  Expected(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Expected(E error) : state_(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const { return state_.index() == 0; }
  T& operator*() & { return std::get<0>(state_); }
  const T& operator*() const& { return std::get<0>(state_); }
  T&& operator*() && { return std::get<0>(std::move(state_)); }
  T* operator->() { return &std::get<0>(state_); }
  const T* operator->() const { return &std::get<0>(state_); }
  const E& error() const { return std::get<1>(state_); }

private:
  std::variant<T, E> state_;
};

/// Success, or an error E.
template <class E>
class [[nodiscard]] Expected<void, E> {
public:
  Expected() = default;
  Expected(E error) : error_(std::move(error)) {}
  explicit operator bool() const { return !error_.has_value(); }
  const E& error() const { return *error_; }

private:
  std::optional<E> error_;
};

} // namespace daylit::sh
