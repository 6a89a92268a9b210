#pragma once

// The unoccluded kernel of one patch against many, at vector speed.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "radiosity/patches.h"

namespace daylit::radiosity {

/// Patches in tree order, one array per coordinate, float, in the coordinates of the ray scene.
struct PairArrays {
  std::array<std::vector<float>, 9> corner; ///< x, y, z of corner 0, then 1, 2
  std::array<std::vector<float>, 9> gauss;  ///< the 3-point rule of degree 2
  std::array<std::vector<float>, 3> centre, normal;
  std::vector<float> radius, area;

  PairArrays() = default;
  PairArrays(const PatchSet& set, std::span<const std::uint32_t> order, const glm::dvec3& shift);
  std::size_t size() const { return area.size(); }
};

enum PairState : std::int32_t {
  kNotFacing = 0, ///< neither sees the other's front
  kFar = 1,       ///< the rule is good to 1.1e-4 rms, 3e-3 for the worst pair
  kNear = 2,      ///< close, or cut by the other's plane: needs the contour integral
};

/// Exchange areas (m^2) by 3 x 3 points of patch `i` with patches [first, last), and which of them to trust.
void pair_row(const PairArrays& a, std::uint32_t i, std::uint32_t first, std::uint32_t last, float* exchange_m2,
              std::int32_t* state);

} // namespace daylit::radiosity
