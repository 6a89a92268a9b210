#pragma once

// Lighting cases whose answer is a formula, run through the libraries that bake and probe use: `daylit-bench selftest`
// on the user's machine and tests/analytic go through the same table.

#include <span>
#include <string>
#include <vector>

#include "scene/core/program.h"
#include "scene/core/result.h"

namespace daylit::bench {

/// How fine, and how close a case has to come.
struct SelftestQuality {
  int facets = 2000;               ///< of every room
  double visibility_rays = 229376; ///< per unit of form factor, of partly hidden pairs
  int sky_rows_px = 512;           ///< height of the sky images
  int sky_regions = 1024;          ///< of the uniform partition, where a case uses one
  double tolerance = 0.02;         ///< largest relative deviation
};

/// "normal" (2 %) and "high" (0.5 %), with the facets and rays of daylit-precompute's qualities of these names.
/// Error usage for any other name.
Result<SelftestQuality> selftest_quality(const std::string& name);

struct Comparison {
  std::string what;
  double reference = 0, result = 0;
  double deviation() const { return reference != 0 ? result / reference - 1 : result; } ///< relative
};

struct ClosedFormCase {
  const char* name;    ///< "CIE 171 5.6"
  const char* subject; ///< "reflection over a diffuse floor"
  Result<std::vector<Comparison>> (*run)(const SelftestQuality& quality, const Progress& progress);
};

/// Cases inside closed rooms: emission per facet.
std::span<const ClosedFormCase> closed_room_cases();
/// Cases of daylight through openings and glass.
std::span<const ClosedFormCase> sky_cases();
/// All of them, in the order of the table.
std::vector<ClosedFormCase> closed_form_cases();

} // namespace daylit::bench
