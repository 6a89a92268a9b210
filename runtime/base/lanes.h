#pragma once

#include <cstdint>

namespace daylit {

/// Points, rays and lights are worked on in sets of sixteen, one to a lane; bit k of a mask is lane k.
constexpr int kLanes = 16;
using LaneMask = std::uint32_t;

} // namespace daylit
