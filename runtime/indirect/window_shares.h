#pragma once

// The part of the windows' light that reaches each side of each vertex that sends light, and what it reflects of it.

#include <array>
#include <span>
#include <vector>

#include "runtime/indirect/indirect_shadow.h"
#include "runtime/indirect/window_visibility.h"
#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// Of both sides of each sender: how it sees other objects that are near. Empty where objects are far from each other.
using ContactViews = std::vector<std::array<ContactView, 2>>;
ContactViews contact_views(const IndirectShadow& field, const VirtualObjects& objects);

/// Of both sides of each sender: the part of the windows' light that comes past the room, past its own object and past
/// others, by what a uniform sky sends through the windows.
using WindowShares = std::vector<std::array<float, 2>>;
/// `others`: null where objects change nothing; `views`: contact_views().
WindowShares window_shares(const WindowVisibility& windows, const IndirectShadow* others, const VirtualObjects& objects,
                           const ContactViews& views);

/// Radiance that the senders reflect of the windows' light, the sun's excepted. `windows`: that light at the objects'
/// middle, unshadowed.
std::vector<TwoSided> direct_radiance(std::span<const DirectionalLight> windows, const VirtualObjects& objects,
                                      const WindowShares& shares);

} // namespace daylit
