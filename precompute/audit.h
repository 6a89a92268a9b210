#pragma once

// The measured error of a bake: its volume against the same transport taken directly, at points off the grid and under
// skies that are no sum of its regions (held_out.h). What the mesh itself does wrong is not in here: two bakes on
// meshes of different fineness show that (mesh_difference).

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "precompute/held_out.h"
#include "precompute/room_points.h"
#include "radiosity/solve.h"
#include "scene/room/aperture.h"
#include "scene/volume/first_reflection.h"
#include "scene/volume/interpolated_probes.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

/// Irradiance on six axes at a room's points under one sky, to order 4.
struct RoomError {
  double error = 0; ///< nrms, relative to the light there
  double light = 0; ///< root of the mean square
};

/// Errors of the nine coefficients, nrms over points, coefficients and channels, under one sky.
struct SkyError {
  std::string sky;
  bool is_sun = false;
  double total = 0;      ///< the volume at the points against the transport there
  double limited = 0;    ///< the same, where no point counts for more than a tenth of the squared error
  double sky_part = 0;   ///< at Audit::probes(): what regions, nodes and stored precision change
  double grid_part = 0;  ///< exact probes, interpolated to the points (to every second of them, where the grid is
                         ///< large); limited in the same way
  double irradiance = 0; ///< as irradiance on six axes, to order 4; of a volume of nine coefficients too
  double band4 = 0;      ///< what l = 4 is of the irradiance there: what nine true coefficients leave
  double standing = 0;   ///< irradiance on six axes where objects stand: AuditReport::standing
  std::vector<RoomError> rooms = {}; ///< of each of AuditReport::rooms
};

/// Of some errors; the percentile interpolated between the two nearest. All 0 of none.
struct ErrorSpread {
  std::size_t skies = 0;
  double mean = 0, percentile95 = 0, worst = 0;
  static ErrorSpread of(std::vector<double> errors);
};

/// What a room's errors are like, sky by sky.
struct RoomErrors {
  ErrorSpread smooth, sun; ///< suns that give the room at least a tenth of what its brightest one does
};

struct AuditReport {
  std::vector<glm::dvec3> points;   ///< where, world metres; empty: no audit
  std::vector<glm::dvec3> standing; ///< more of them, 1 to 30 cm above level faces (points_above())
  std::vector<SkyError> sky;
  std::vector<float> exact;           ///< [sky][point][lm][channel], the direct transport
  std::vector<RoomPoints> rooms = {}; ///< with the points at which the volume has light

  /// Of a room, each sky's error with that of the mesh: sqrt(e^2 + mesh^2).
  RoomErrors errors_in(std::size_t room, double mesh) const;

  /// Worst smooth sky, and rms over the suns (0: none reaches the room).
  double smooth(double SkyError::*part) const;
  double sun(double SkyError::*part) const;
};

/// Direct transport at the same points under the same skies on two meshes: nrms difference, worst smooth sky.
/// The suns' rms is left out: suns stand elsewhere on another mesh.
double mesh_difference(const AuditReport& coarse, const AuditReport& fine);

/// The audit of one bake, through its stages.
class Audit {
public:
  /// Keeps those of `candidates` at which the volume has a value; empty: 128 points spread over the room's air, or some
  /// of the given probes. The same of `standing` and `rooms`. `probes` with their validity. Errors of
  /// LightFieldSampler.
  static Result<Audit> prepare(const Room& room, const std::vector<Aperture>& apertures, const ProbeSet& probes,
                               std::vector<glm::dvec3> candidates, const std::vector<glm::dvec3>& standing = {},
                               const std::vector<RoomPoints>& rooms = {});

  /// Those in the air first, then those where objects stand, then room by room.
  const std::vector<glm::dvec3>& points() const { return points_; }
  /// Valid ones that points are interpolated from, increasing: where exact light is wanted too.
  std::vector<std::size_t> probes() const;
  /// Direct light of the held-out skies; also chooses the suns. `light`: of held_out_partition().
  radiosity::FirstBounce direct_light(std::span<const radiosity::FirstBounceRow> light, const radiosity::PatchSet& set);
  std::size_t skies() const { return skies_.size(); }

  /// `exact_at_points`, `exact_at_probes`: [point][lm][channel * skies + sky], the latter at `probes`, which hold all
  /// of probes() that are valid. `band4_at_points`: the same of l = 4. `surfaces`, `sent`: the volume's elements and
  /// what they send back of the skies' direct light, [sky][element]; the light under suns is corrected by it, as that
  /// of IndirectLight is; null: the volume has none.
  AuditReport judge(const BasisVolume& volume, std::span<const float> exact_at_points,
                    std::span<const float> band4_at_points, std::span<const float> exact_at_probes,
                    std::span<const std::size_t> probes, const FirstReflection* surfaces = nullptr,
                    std::span<const Rgb> sent = {}) const;

private:
  SkyError judge_sky(std::size_t sky, const BasisVolume& volume, std::span<const float> exact_at_points,
                     std::span<const float> band4_at_points, std::span<const float> exact_at_probes,
                     std::span<const std::size_t> probes, const FirstReflection* surfaces,
                     std::span<const Rgb> sent) const;
  std::vector<ShRadiance> light_at_points(const LightField& field, const FirstReflection* surfaces,
                                          std::span<const Rgb> stored, std::span<const Rgb> sent) const;
  LightFieldSampler sampler_;
  std::vector<InterpolatedProbe> interpolated_;
  std::vector<glm::dvec3> points_;
  std::size_t in_air_ = 0, standing_ = 0; ///< of points_, the first, and those after them
  std::vector<RoomPoints> rooms_;         ///< their points are the others of points_
  std::vector<HeldOutSky> skies_;
  std::size_t grid_step_ = 1; ///< between points for which SkyError::grid_part is measured
};

} // namespace daylit::precompute
