#pragma once

// Radiance materials as diffuse surfaces and clear panes. Source: Ward and Shakespeare 1998, appendix; ray.html,
// "Material types"; materials.pdf (Ward 2004).

#include <span>
#include <string>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::detail {

/// `type` and its real arguments, as a material of a room:
///   plastic r g b spec rough    reflectance c (1 - spec) + spec: what is glossy counts as diffuse
///   metal r g b spec rough      reflectance c
///   trans r g b spec rough trans tspec   reflectance c (1 - spec) (1 - trans) + spec; what passes is left out
///   glass r g b [n]             a pane: the Fresnel slab of index n (1.52) whose transmissivity is the arguments
///   light, glow                 reflectance 0; what it emits is left out
/// Error value_invalid: other types, too few arguments, values outside 0..1.
Result<Material> radiance_material(const std::string& name, const std::string& type, std::span<const double> arguments);

/// What of the material radiance_material() drops, for a note; empty: nothing.
std::string left_out(const std::string& type, std::span<const double> arguments);

} // namespace daylit::detail
