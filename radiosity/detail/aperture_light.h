#pragma once

// Direct light through openings on one patch.

#include <atomic>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/sky_sweep.h"
#include "radiosity/first_bounce.h"
#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"

namespace daylit::radiosity {

/// What light can meet between the sky and a patch, on its way through an opening.
enum class Way {
  clear,       ///< nothing but the opening
  one_opening, ///< facets, but no other opening
  any,
};

/// Decides without rays what can stand between a patch and an opening, and outside the opening.
class OpenPaths {
public:
  OpenPaths(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures, const std::vector<AperturePart>& parts);
  /// `clear` and `one_opening` are proofs: no facet, or no other opening, meets the hull of the two, except by touching
  /// it, or lies beyond the opening. `front`: the corners of the part that count.
  Way way(const Patch& patch, std::size_t part, const std::vector<glm::dvec3>& front) const;

private:
  struct Box {
    glm::dvec3 lo, hi;
    void include(const glm::dvec3& p);
  };
  struct Sheet {
    glm::dvec3 point, normal;
    Box box;
  };
  void add_sheets(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures);
  bool parted(const Sheet& sheet, const Patch& patch, const std::vector<glm::dvec3>& front, const Box& hull) const;

  std::vector<Sheet> sheets_; ///< planes of the mesh, then the openings
  std::size_t first_opening_ = 0;
  std::vector<bool> facet_outside_, opening_outside_; ///< per part
  const std::vector<AperturePart>& parts_;
  double tolerance_m_ = 0;
};

/// What is the same for all patches.
struct DirectLight {
  const PatchSet& set;
  const SurfaceMesh& mesh;
  const RayScene& scene;
  const std::vector<Aperture>& apertures;
  ApertureCrossings crossings;
  const SkyPartition& partition;
  std::vector<AperturePart> parts;
  int directions;      ///< FirstBounceOptions
  SkySweep fine, wide; ///< for narrow and for wide views of an opening: half as many do
  OpenPaths paths;
  // Counted: rays, pairs of patch and opening without and with samples, patches that see the open sky.
  std::atomic<std::uint64_t> rays{0}, clear{0}, sampled{0};
  std::atomic<int> open_sky{0};

  DirectLight(const PatchSet& patches, const SurfaceMesh& facets, const RayScene& rays_of_facets,
              const std::vector<Aperture>& openings, const SkyPartition& regions, const FirstBounceOptions& options)
      : set(patches), mesh(facets), scene(rays_of_facets), apertures(openings), crossings(openings), partition(regions),
        parts(aperture_parts(openings, facets.origin)), directions(options.directions),
        fine(regions, parts, directions), wide(regions, parts, directions / 2), paths(facets, openings, parts) {}

  /// Nothing blocks the ray.
  bool escapes(const glm::dvec3& from, const glm::dvec3& direction) const {
    return !scene.occluded(scene.to_local(from), glm::vec3(direction), 2.0f * scene.surface_offset(),
                           std::numeric_limits<float>::infinity());
  }
};

/// What one patch receives through one part of the openings or all of them, dense over regions.
struct Received {
  std::vector<glm::dvec3> region;
  double opening = 0;
};

/// Adds what patch `patch` receives through part `index` of the openings, sr per unit radiance of each region:
/// integral of visibility, pane transmittance and cosine, mean over the patch.
void receive_through(DirectLight& task, std::size_t patch, std::size_t index, Received& out);

} // namespace daylit::radiosity
