#pragma once

// The measured error of a bake: its volume against the same transport taken directly, at points off the grid and under
// skies that are no sum of its regions (held_out.h). What the mesh itself does wrong is not in here: two bakes on
// meshes of different fineness show that (mesh_difference).

#include <array>
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

/// Irradiance on six axes over the air of a room from 10 cm off its surfaces, under one sky.
struct RoomError {
  double error = 0; ///< nrms, relative to the light there; of a sun with the clear sky around it
  double light = 0; ///< root of the mean square; of a sun alone
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
  double irradiance = 0; ///< as irradiance on six axes: what the coefficients leave out is in it
  double band4 = 0;      ///< what l = 4 is of the irradiance there: what nine true coefficients leave
  double standing = 0;   ///< irradiance on six axes where objects stand: AuditReport::standing; of a sun with the sky
                         ///< around it
  std::vector<RoomError> rooms = {}; ///< of each of AuditReport::rooms
  bool of_room = false;              ///< a sun that counts in `rooms` alone: HeldOutSky::of_room
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

  /// Worst smooth sky, and rms over the suns that are not of one room (0: none comes in).
  double smooth(double SkyError::*part) const;
  double sun(double SkyError::*part) const;
};

/// Direct transport at the same points under the same skies on two meshes: nrms difference, worst smooth sky.
/// The suns' rms is left out: suns stand elsewhere on another mesh.
double mesh_difference(const AuditReport& coarse, const AuditReport& fine);

/// The transport taken directly, [point][lm][channel * skies + sky]; of l = 4 in the same way, and irradiance on the
/// six axes (radiosity::Bands).
struct AuditTruth {
  std::span<const float> at_points, band4_at_points, irradiance_at_points;
  std::span<const float> at_probes;    ///< at `probes`
  std::span<const std::size_t> probes; ///< all of Audit::probes() that are valid
};

/// On the axes +x, -x, +y, -y, +z, -z.
using SixIrradiances = std::array<Rgb, 6>;

/// The volume's elements, and what they send back of the direct light of the skies, [sky][element]: the light is
/// corrected by it, as that of IndirectLight is. Null: the volume names none.
struct SentLight {
  const FirstReflection* surfaces = nullptr;
  std::span<const Rgb> radiance = {};
};

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
  /// Which of points() are those of a room, first and behind the last.
  std::array<std::size_t, 2> range_of_room(std::size_t room) const;
  std::size_t rooms() const { return rooms_.size(); }
  /// Direct light of the held-out skies; also chooses the suns: some for all that the elements' importance counts, and
  /// for each room some that count there. `light`: of held_out_partition(). `in_room`: room by room, what the light of
  /// each element counts.
  radiosity::FirstBounce direct_light(std::span<const radiosity::FirstBounceRow> light, const radiosity::PatchSet& set,
                                      std::span<const std::vector<double>> in_room);

  AuditReport judge(const BasisVolume& volume, const AuditTruth& truth, const SentLight& sent = {}) const;

private:
  /// Coefficient (l, c) of a point or probe for one column of [point][lm][channel * columns + column].
  struct Column {
    std::span<const float> values;
    std::size_t columns, column;
    Sh9Rgb at(std::size_t point) const;
  };
  struct PointTruth;
  /// At the points where objects stand and those of the rooms, under one sky: of the volume, and taken directly.
  struct NearLight {
    std::vector<ShRadiance> got;
    std::vector<SixIrradiances> exact;
  };
  SkyError judge_sky(std::size_t sky, const BasisVolume& volume, const AuditTruth& truth, const SentLight& sent,
                     std::span<const FirstReflection::Exchange> surfaces, NearLight& near) const;
  double judge_standing(const NearLight& light, const NearLight& uniform, float sky_part) const;
  std::vector<RoomError> judge_rooms(const NearLight& light, const NearLight& uniform, float sky_part) const;
  void judge_points(std::span<const ShRadiance> got, const PointTruth& truth, SkyError& error) const;
  void judge_probes(const LightField& field, const Column& exact_at_probes, std::span<const std::size_t> probes,
                    const PointTruth& truth, SkyError& error) const;
  std::vector<FirstReflection::Exchange> near_surfaces(const SentLight& sent) const;
  std::vector<ShRadiance> light_at_points(std::size_t sky, const LightField& field, std::span<const Rgb> radiance,
                                          const SentLight& sent, std::span<const FirstReflection::Exchange> near) const;
  LightFieldSampler sampler_;
  std::vector<InterpolatedProbe> interpolated_;
  std::vector<glm::dvec3> points_;
  std::size_t in_air_ = 0, standing_ = 0; ///< of points_, the first, and those after them
  std::vector<RoomPoints> rooms_;         ///< their points are the others of points_
  std::vector<HeldOutSky> skies_;
  std::size_t grid_step_ = 1; ///< between points for which SkyError::grid_part is measured
};

} // namespace daylit::precompute
