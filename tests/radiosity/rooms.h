#pragma once

// Small rooms that the transport tests share with the benches.

#include "bench/room_parts.h"

namespace daylit::testing {

using bench::add_box;
using bench::add_quad;
using bench::add_sphere;
using bench::grey_room;
using bench::room_with_window_hole;

} // namespace daylit::testing
