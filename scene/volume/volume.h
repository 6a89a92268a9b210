#pragma once

// The basis irradiance volume: for every sky region at radiance 1, the nine SH coefficients of the *indirect*
// radiance at every probe. Combination is linear: L_lm(x) = sum_i L_i L_lm^(i)(x) (Grosch et al. 2007, eq. 4).

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/room/room.h"
#include "scene/sky/sky_partition.h"
#include "scene/volume/compact_basis.h"

namespace daylit {

/// Where the probes are. Either a grid (count.x * count.y * count.z probes, x fastest), regular or graded, or free
/// points. The coordinates of a grid come from ProbePlanes (scene/probe_planes.h).
struct ProbeSet {
  std::vector<glm::vec3> positions; ///< metres, relative to `origin`
  glm::dvec3 origin{0.0};           ///< world metres
  bool is_grid = false;
  glm::ivec3 count{0};     ///< grid only
  glm::dvec3 spacing{0.0}; ///< grid only, metres; of a graded one the mean
  /// Graded grid only: increasing coordinates along x, y and z, metres relative to `origin`; else empty.
  std::array<std::vector<double>, 3> planes = {};
  std::vector<std::uint8_t> valid; ///< 1 = inside the room and in the air; invalid probes hold zeros
  /// Grid only, one per probe or empty: 1, 2, 3 = in the air, but with a light of its own nowhere in the volume; it is
  /// interpolated along x, y or z (scene/interpolated_probes.h). Such a probe is not valid.
  std::vector<std::uint8_t> interpolated = {};

  std::size_t size() const { return positions.size(); }
  bool is_graded() const { return !planes[0].empty() || !planes[1].empty() || !planes[2].empty(); }
};

struct VolumeProvenance {
  std::string program_version, command_line, room_name, room_hash;
  std::string report_json; ///< what the bake printed: times, skipped work, energy balance, error estimates
};

/// The elements of surface whose light the sources of a compact basis are, one for each source. Empty: not known.
struct SourceElements {
  /// Metres, relative to ProbeSet::origin; they turn left as seen from the lit side. All alike where a source stands
  /// for surfaces that no probe sees.
  std::vector<std::array<glm::vec3, 3>> corner;
  std::vector<Rgb> reflectance;
};

/// World metres; panes are none.
struct ReflectingSurfaces {
  std::vector<glm::dvec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct BasisVolume {
  SkyPartition partition;
  ProbeSet probes;
  /// Row r holds the basis of region stored_region[r]; regions that no aperture sees are not stored (all zero).
  std::vector<std::int32_t> stored_region;
  /// [row][probe][coefficient 0..8][channel r, g, b], row-major; unit: sr of indirect radiance per region radiance.
  std::vector<float> basis;
  /// The same of the coefficients of l = 4, [row][probe][m + 4][channel]; empty: not known.
  std::vector<float> band4 = {};
  /// Not null: the basis of a partition of nodes (SkyPartition::fine) in factors; then stored_region and basis are
  /// empty.
  std::shared_ptr<const CompactBasis> compact;
  SourceElements elements = {}; ///< of `compact`
  Room room;                    ///< world metres, windows included
  /// Between which light was exchanged instead of those of `room`, which are too many; empty: it was between those.
  ReflectingSurfaces simplified = {};
  std::vector<Aperture> apertures; ///< windows and holes
  VolumeProvenance provenance;

  std::size_t row_floats() const { return probes.size() * 27; }
  bool has_band4() const { return compact ? !compact->band4.cluster.empty() : !band4.empty(); }
};

/// One per region of the sky: 0 where its light reaches no probe.
std::vector<std::uint8_t> regions_that_count(const BasisVolume& volume);

/// How much of the radiance is asked for: nine coefficients, or also those of l = 4. With these, irradiance is right to
/// order 4, because its kernel has no band 3.
enum class ShOrder { second = 2, fourth = 4 };

/// Coefficients at the probes for one sky.
struct LightField {
  std::vector<Sh9Rgb> probe;        ///< one per probe of the volume
  std::vector<Band4Rgb> band4 = {}; ///< the same, or empty: not asked for, or not known
};

/// L_lm(x) = sum_i L_i L_lm^(i)(x) at each probe x for the given region radiances L_i (size = partition.size(); Grosch
/// et al. 2007, eq. 4). Rows of regions that are black are not read; the result does not depend on the thread count.
/// Order 2 reads nothing of l = 4, and order 4 does not change the nine.
LightField combine(const BasisVolume& volume, std::span<const Rgb> region_radiance, ShOrder order = ShOrder::second);

/// Radiance around a point as far as irradiance sees it; `band4` is zero where it is not known.
struct ShRadiance {
  Sh9Rgb nine{};
  Band4Rgb band4{};

  ShRadiance& operator+=(const ShRadiance& other);
};

/// Interpolates between probes without light leaks. A point has a light field exactly when it sees a valid probe of
/// its grid cell, or of the ring of probes around that cell, along a segment that crosses neither a surface nor an
/// aperture. Weights are trilinear over the valid, visible corners, renormalised; between the outer probes and the
/// walls the point is moved to the border of the grid. Surfaces do not block points within 0.1 mm of them, on either
/// side. Volumes with free points answer at those points only (within 0.1 mm).
/// Copies what it needs from the volume; thread-safe.
class LightFieldSampler {
public:
  /// Errors of check_grid() (scene/probe_planes.h).
  static Result<LightFieldSampler> make(const BasisVolume& volume);
  /// Probe indices and weights (sum 1) at a world point; returns the number used, 0 where there is no light field:
  /// outside the room, or inside furniture.
  int weights(const glm::dvec3& world_point, std::span<std::uint32_t, 8> probe, std::span<float, 8> weight) const;
  std::optional<Sh9Rgb> sample(const LightField& field, const glm::dvec3& world_point) const;
  /// With the band of l = 4 where the field has one.
  std::optional<ShRadiance> sample_all(const LightField& field, const glm::dvec3& world_point) const;

private:
  struct State;
  std::shared_ptr<const State> state_;
};

/// E(n) = sum A_l L_lm Y_lm(n), A = pi, 2pi/3, pi/4 (Ramamoorthi & Hanrahan 2001). May be slightly negative: ringing.
Rgb irradiance(const Sh9Rgb& radiance_coefficients, const glm::vec3& unit_normal);
/// The same with l = 4, A = -pi/24.
Rgb irradiance(const ShRadiance& radiance, const glm::vec3& unit_normal);

/// Light whose irradiance is nowhere negative: channels that ring are windowed by the least amount that ends it
/// (sh/window.h), the others keep every bit.
struct NonNegativeLight {
  ShRadiance radiance;
  int windowed_channels = 0;
  double bias = 0; ///< largest over the channels: rms change of irradiance over all normals / its mean
};
NonNegativeLight without_ringing(const ShRadiance& radiance);

} // namespace daylit
