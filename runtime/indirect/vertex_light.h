#pragma once

#include <span>
#include <vector>

#include "runtime/indirect/indirect_shadow.h"
#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// What a renderer needs to know at each vertex: `indirect`, and the open sky's irradiance where `in_view`. `has_back`:
/// 0 where light from behind can reach nothing. Adds the number of vertices looked at to `lit`.
std::vector<VertexLight> light_vertices(const ObjectSurface& surface, std::span<const std::uint8_t> has_back,
                                        std::span<const std::uint8_t> in_view, std::span<const TwoSided> indirect,
                                        std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                                        std::size_t& lit);

/// Adds to the reflected indirect radiance of each vertex what the objects change of the light that the room sends
/// them.
void add_feedback(const IndirectShadow& field, const VirtualObjects& objects, std::span<TwoSided> radiance);
/// The same of what they hide from each other and send to each other.
void add_exchange(const IndirectShadow& field, const VirtualObjects& objects, std::span<TwoSided> radiance);

} // namespace daylit
