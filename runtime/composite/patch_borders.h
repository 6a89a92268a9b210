#pragma once

// Borders of the room's own sun patches inside the shadow of an object.

#include "runtime/composite/compose.h"
#include "runtime/composite/drawn_picture.h"

namespace daylit {

/// Where a patch of sun in the photograph ends in the sun's shadow of an object, a pixel holds some part of the sun's
/// light, of which nothing may be left. The sun is so much brighter than the shadow that a hundredth of a pixel in the
/// place of the border shows as a line of dots. Pixels beside such a border take the mean of those around it that lie
/// in the same shadow or had no sun, on the same triangle of the room: three pixels wide, the floor has no texture
/// there.
void fill_patch_borders(const DrawnPicture& drawn, Composite& result);

} // namespace daylit
