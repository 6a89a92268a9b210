#pragma once

#include <vector>

#include "radiosity/detail/plane_groups.h"

namespace daylit::radiosity {

/// Adds to the contacts of each plane where flat faces end that come close to it without touching it: furniture a
/// little off a wall, a carpet above the floor. A facet half of which is behind them would share its light with the
/// dark half and lose it there. Edges count that are nowhere farther than `near_m` from the plane, and that may matter
/// to facets with edges of `edge_m`: at least as long, nowhere farther than a quarter of it, and no border of the
/// plane or line already there within a sixteenth (of the end of a board one edge is enough).
void add_near_edges(std::vector<PlaneGroup>& groups, double near_m, double edge_m);

} // namespace daylit::radiosity
