#pragma once

#include <cstdint>

namespace daylit {

/// A change of the room further from an object, in its radii, is not looked for by the feedback on it.
constexpr double kFeedbackRadii = 2.5;

/// Of the change of irradiance of one side of a vertex: light from one direction, and V cos of it times its part in
/// what arrives at the vertex.
struct FeedbackTerm {
  std::uint32_t light = 0;
  float weight = 0.0f;
};

} // namespace daylit
