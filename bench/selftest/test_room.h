#pragma once

// Rooms of the selftest and their solved light, on top of the radiosity library.

#include <vector>

#include "bench/room_parts.h"
#include "bench/selftest/closed_form_cases.h"
#include "bench/selftest/emission.h"
#include "bench/selftest/surface_irradiance.h"
#include "scene/room/aperture.h"
#include "scene/room/room.h"

namespace daylit::bench {

/// Material numbers of box_room(); each face has its own, so that a case can say what it emits and reflects.
enum Face : std::uint32_t { kFloor, kCeiling, kSouth, kNorth, kWest, kEast, kFurniture, kFaces };

/// Black faces of a box from the origin to `size`; bit f of `faces` keeps face f. South is y = 0, west is x = 0.
Room box_room(const glm::dvec3& size, unsigned faces = 0b111111u);
/// The whole surface of a box in the room's air.
void add_furniture(Room& room, const glm::dvec3& low, const glm::dvec3& high);
/// The frame of a rectangle lo..hi with the rectangle hole_lo..hole_hi cut out; both in the plane where the
/// coordinate `axis` is lo[axis].
void add_face_with_hole(Room& room, int axis, const glm::dvec3& lo, const glm::dvec3& hi, const glm::dvec3& hole_lo,
                        const glm::dvec3& hole_hi, std::uint32_t material);

/// Unknowns and exchange areas of a room; reflectances may be changed afterwards.
struct SolvedRoom {
  radiosity::SurfaceMesh mesh;
  RayScene rays;
  radiosity::PatchSet set;
  radiosity::ExchangeMatrix exchange;

  /// `seeds`: where the search for lit surfaces starts.
  static Result<SolvedRoom> make(const Room& room, const std::vector<Aperture>& seeds, const SelftestQuality& quality,
                                 const Progress& progress);
  /// A closed room: the search starts at a point in its air.
  static Result<SolvedRoom> closed(const Room& room, const glm::dvec3& inside, const SelftestQuality& quality,
                                   const Progress& progress);

  std::uint32_t material(std::size_t patch) const { return mesh.facets[set.patches[patch].facet].material; }
  void set_reflectance(std::uint32_t material, float reflectance);
  void set_reflectance(float reflectance);
  /// One value per patch.
  std::vector<Rgb> per_material(std::uint32_t material, float value) const;
  /// Sum of the exchange areas between the patches of two materials, m^2.
  double exchange_area_m2(std::uint32_t from, std::uint32_t to) const;
  double area_m2() const;

  /// What every patch sends out: its own exitance and what it reflects.
  Result<radiosity::Radiosity> solve(const std::vector<Rgb>& exitance, const Progress& progress) const;
  /// Irradiance at world points on surfaces.
  Result<std::vector<double>> irradiance(std::vector<SurfacePoint> world_points, const radiosity::Radiosity& light,
                                         const Progress& progress) const;
};

} // namespace daylit::bench
