#pragma once

// Rotation of coefficients: the exact (2l + 1) x (2l + 1) matrices of every band, applied without being stored.
//
// R = Rz(a) Ry(b) Rz(c) is taken apart as Rz(a - pi/2) Ry(-pi/2) Rz(b) Ry(pi/2) Rz(c + pi/2). Turns about z are
// trigonometric. The quarter turn about y is d^l_{n,m}(pi/2), from a three-term recurrence in l for every (n, m) at
// once in vectors over m, with an exponent beside the number while it is below the range of double. At pi/2 half of
// the entries vanish and the recurrence has no angle in it, so the error does not depend on the rotation.
// O(degree^3) time, O(degree^2) memory. |error| <= 1e-12 at degree 100 and 1e-10 at 1000 (measured: docs/sh.md).

#include <span>

#include <glm/mat3x3.hpp>

#include "sh/error.h"

namespace daylit::sh {

inline constexpr int kMaxRotationDegree = 4096;

/// Coefficients of g(w) = f(R^T w): the function carried along by R. `rotation` must be a rotation (orthonormal,
/// determinant +1) within 1e-6; it is orthonormalised in double. `channels` values per index, in place.
Expected<void> rotate(const glm::dmat3& rotation, int degree, int channels, std::span<double> coefficients);

} // namespace daylit::sh
