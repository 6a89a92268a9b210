#pragma once

#include <cstdint>
#include <vector>

#include "radiosity/patches.h"
#include "scene/core/program.h"
#include "scene/room/aperture.h"
#include "scene/sky/sky_partition.h"

namespace daylit::radiosity {

/// Irradiance of every patch when one sky region at a time has radiance 1: direct light, H_i = 1/A_i int_A int_region
/// V tau cos dw dA.
struct FirstBounce {
  std::size_t patches = 0;
  int channels = 3;                 ///< stored: 1 where all panes are colourless, else 3
  std::vector<std::int32_t> region; ///< sky region of each column; regions that light nothing have no column
  /// [patch][channel][column], sr: integral of V tau cos over the region. Channels differ by the panes' colours.
  std::vector<float> irradiance;
  std::vector<float> opening; ///< form factor from each patch to the outside through all openings, without panes

  std::size_t columns() const { return region.size(); }
  /// Channels 0, 1, 2 exist whatever is stored.
  const float* row(std::size_t patch, int channel) const { return irradiance.data() + offset(patch, channel); }
  float* row(std::size_t patch, int channel) { return irradiance.data() + offset(patch, channel); }
  std::size_t offset(std::size_t patch, int channel) const {
    return (patch * static_cast<std::size_t>(channels) + static_cast<std::size_t>(channels == 1 ? 0 : channel)) *
           columns();
  }
};

struct FirstBounceReport {
  std::uint64_t rays = 0;
  std::uint64_t clear_pairs = 0;   ///< patch and opening with nothing between them: no ray (bound 0)
  std::uint64_t sampled_pairs = 0; ///< openings too small for the directions, sampled in their solid angle
  int regions_skipped = 0;         ///< no patch receives light from them; bound on the error: 0
  int open_sky_patches = 0;        ///< patches that see the sky past every known opening (outside walls, hidden gaps)
  double seconds = 0;
};

/// The light on one patch, only the regions that give any, in increasing order.
struct FirstBounceRow {
  std::vector<std::int32_t> region;
  std::vector<Rgb> irradiance; ///< sr
  float opening = 0;           ///< as FirstBounce::opening
};

struct FirstBounceOptions {
  int directions = 16384; ///< that stand for the whole sphere, at least so many
};

/// first_bounce() for thousands of regions, of which a patch sees some: one row per patch.
Result<std::vector<FirstBounceRow>> first_bounce_rows(const PatchSet& set, const SurfaceMesh& mesh,
                                                      const RayScene& scene, const std::vector<Aperture>& apertures,
                                                      const SkyPartition& partition, const Progress& progress,
                                                      FirstBounceReport* report = nullptr,
                                                      const FirstBounceOptions& options = {});

/// Thousands of directions, some for each region, one for a node. Per patch, aperture and direction: the part
/// of the patch that parallel light through the aperture meets, by an exact polygon clip, so that a region's energy
/// is that of the beam (no noise from points); rays from that part only where something may stand in the way. The sum
/// is scaled to the exact form factor. Apertures that a patch sees under few directions are sampled uniformly in
/// their solid angle instead. Whatever else escapes is found by cosine-distributed rays. Error: interrupted.
Result<FirstBounce> first_bounce(const PatchSet& set, const SurfaceMesh& mesh, const RayScene& scene,
                                 const std::vector<Aperture>& apertures, const SkyPartition& partition,
                                 const Progress& progress, FirstBounceReport* report = nullptr,
                                 const FirstBounceOptions& options = {});

} // namespace daylit::radiosity
