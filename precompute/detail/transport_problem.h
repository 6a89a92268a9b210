#pragma once

// What every bake of a room starts from, and the clock of its stages.

#include <chrono>
#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>

#include "precompute/bake.h"
#include "radiosity/gather.h"
#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"

namespace daylit::precompute::detail {

/// Writes the seconds of each stage, as it finishes, into the report.
class StageClock {
public:
  explicit StageClock(BakeReport& report) : report_(report), start_(now()), last_(start_) {}
  void finish(const char* name) {
    const auto t = now();
    report_.stages.push_back({name, std::chrono::duration<double>(t - last_).count()});
    last_ = t;
    report_.total_seconds = std::chrono::duration<double>(t - start_).count();
  }

private:
  static std::chrono::steady_clock::time_point now() { return std::chrono::steady_clock::now(); }
  BakeReport& report_;
  std::chrono::steady_clock::time_point start_, last_;
};

/// The transport problem of a room: mesh, probes, unknowns and the two ray scenes.
struct Problem {
  RayScene room_scene, facet_rays;
  Apertures apertures;
  ProbeSet probes;
  radiosity::SizeField field;
  radiosity::SurfaceMesh mesh;
  radiosity::PatchSet patches;
  std::vector<radiosity::HoleOutline> holes; ///< small ones between rooms
};

/// Fills the counts of mesh, probes and unknowns in the report.
Result<Problem> set_up(const Room& room, const BakeOptions& options, BakeReport& report, StageClock& clock);

/// Positions of the valid probes, relative to the mesh origin, each once, and which probes stand there.
struct ProbePoints {
  std::vector<glm::dvec3> at;
  std::vector<std::size_t> probe;    ///< valid probes
  std::vector<std::size_t> position; ///< of each of these, in `at`

  ProbePoints(const ProbeSet& probes, const glm::dvec3& mesh_origin);
  /// Rows of positions to rows of probes.
  std::vector<float> spread(std::vector<float> rows) const;
};

} // namespace daylit::precompute::detail
