#pragma once

// Furniture as artists model it has a hundred thousand faces of millimetres. What they send each other is what far
// fewer would: light is exchanged on a simplified model, and the volume keeps both that and the model as it is.

#include "scene/core/result.h"
#include "scene/room/room_formats.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

/// A model of more than 8,000 triangles with so many edges collapsed (Garland & Heckbert 1997, through meshoptimizer)
/// that 5,000 are left, by the smallest of some deviations from 2 to 30 mm; others as they are. Borders of a material
/// stay where they are as long as that suffices, so that no joint opens; windows always. Corners within 0.05 mm are
/// one, so that the seam of a cushion does not gape. What was done is added to the notes of `file`. Error
/// limit_exceeded: more are left at 30 mm.
Result<RoomFile> transport_model(RoomFile& file);

/// Of the transport model, without its panes; empty where the model is `file` itself.
ReflectingSurfaces simplified_surfaces(const RoomFile& model, const RoomFile& file);

} // namespace daylit::precompute
