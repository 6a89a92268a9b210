#pragma once

#include <cstdint>
#include <vector>

#include "radiosity/elements.h"
#include "scene/aperture.h"
#include "scene/program.h"
#include "scene/sky_partition.h"

namespace daylit::radiosity {

/// Irradiance of every element when one sky region at a time has radiance 1: light straight from outside.
struct FirstBounce {
  std::size_t elements = 0;
  std::vector<std::int32_t> region; ///< sky region of each column; regions that light nothing have no column
  /// [element][channel][column], sr: integral of V tau cos over the region. Channels differ by the panes' colours.
  std::vector<float> irradiance;
  std::vector<float> opening; ///< form factor from each element to the outside through all openings, without panes

  std::size_t columns() const { return region.size(); }
  const float* row(std::size_t element, int channel) const {
    return irradiance.data() + (element * 3 + channel) * columns();
  }
};

struct FirstBounceReport {
  std::uint64_t rays = 0;
  int regions_skipped = 0;   ///< no element receives light from them; bound on the error: 0
  int open_sky_elements = 0; ///< elements that see the sky past every known opening (outside walls, hidden gaps)
  double seconds = 0;
};

/// Per element and aperture: directions uniform in the aperture's solid angle from points over the element, binned by
/// region, scaled so that without obstacles the sum is the exact form factor. Whatever else escapes is found by
/// cosine-distributed rays. Error: interrupted.
Result<FirstBounce> first_bounce(const ElementSet& set, const PatchMesh& mesh, const RayScene& scene,
                                 const std::vector<Aperture>& apertures, const SkyPartition& partition,
                                 const Progress& progress, FirstBounceReport* report = nullptr);

} // namespace daylit::radiosity
