#pragma once

// The three methods behind prefilter(): arguments are checked, `maps` have the sides of the lobes.

#include <span>

#include "runtime/maps/prefilter.h"

namespace daylit::detail {

struct PrefilterJob {
  const RadianceMap& source;
  std::span<const Lobe> lobes;
  const PrefilterOptions& options;
  std::span<RadianceMap> maps;
};

/// All return early when the job is stopped.
void exact_lobes(const PrefilterJob& job);
void mip_lobes(const PrefilterJob& job);
void harmonic_lobes(const PrefilterJob& job);

} // namespace daylit::detail
