#pragma once

// The pixels of virtual objects whose material is looked up there: diffuse light drawn at vertices takes the colour of
// the pixel, and what mirrors and refracts is followed by rays. The only code for it, whatever draws the rest.

#include <cstdint>

#include "runtime/composite/compose.h"
#include "runtime/composite/drawn_picture.h"
#include "runtime/reflect/glossy_rays.h"

namespace daylit {

struct GlossyCounts {
  std::uint64_t pixels = 0; ///< that show such an object
  std::uint64_t rays = 0;   ///< from the surfaces on; the camera's are not counted
};

/// Some object has a material that is looked up per pixel (VirtualObjects::Part::per_pixel).
bool any_per_pixel(const VirtualObjects& objects);
/// Some material of them has a normal map.
bool any_normal_map(const VirtualObjects& objects);

/// Adds them to the composite, which holds everything else. `drawn`: what the composite was made of.
GlossyCounts draw_glossy(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room,
                         const PhotoScale& scale, Composite& composite);

} // namespace daylit
