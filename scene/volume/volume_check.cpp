#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/room/glass.h"
#include "scene/volume/interpolated_probes.h"
#include "scene/volume/probe_planes.h"
#include "scene/volume/volume_file.h"

namespace daylit {

namespace {

constexpr double kLargestCoordinate_m = 1e9;

bool bounded(const glm::dvec3& p) {
  return std::abs(p.x) <= kLargestCoordinate_m && std::abs(p.y) <= kLargestCoordinate_m &&
         std::abs(p.z) <= kLargestCoordinate_m;
}

template <class Vec>
bool all_bounded(const std::vector<Vec>& points) {
  return std::all_of(points.begin(), points.end(), [](const Vec& p) { return bounded(glm::dvec3(p)); });
}

/// Counted on the bits: a loop that the compiler turns into vector code even for gigabytes.
bool all_finite(const std::vector<float>& values) {
  std::uint32_t bad = 0;
  for (const float x : values)
    bad |= (std::bit_cast<std::uint32_t>(x) & 0x7f800000u) == 0x7f800000u ? 1u : 0u;
  return bad == 0;
}

/// 0: no clear glass.
bool glass_index(float n) { return n == 0.0f || (n >= 1.0f && n <= static_cast<float>(kLargestGlassIndex)); }

bool in_unit_range(const Rgb& c) {
  return c.r >= 0.0f && c.r <= 1.0f && c.g >= 0.0f && c.g <= 1.0f && c.b >= 0.0f && c.b <= 1.0f;
}

Error broken(std::string what) {
  return {ErrorCode::file_malformed, std::move(what), "volume", "bake it again with daylit-precompute"};
}

/// Positions are finite, validity is 0 or 1, a grid's probes stand where its planes meet, and those that are
/// interpolated have neighbours.
Result<void> check_probes(const ProbeSet& probes) {
  if (probes.size() == 0 || probes.valid.size() != probes.size())
    return broken("no probes, or their validity is missing");
  if (!bounded(probes.origin) || !all_bounded(probes.positions))
    return broken("a probe position is not finite");
  if (std::any_of(probes.valid.begin(), probes.valid.end(), [](std::uint8_t v) { return v > 1; }))
    return broken("a probe is neither valid nor invalid");
  if (!probes.is_grid && probes.is_graded())
    return broken("probes that are no grid have coordinates of one");
  if (probes.is_grid)
    if (Result<void> good = check_grid(probes); !good)
      return good;
  const auto interpolated = interpolated_probes(probes);
  return interpolated ? Result<void>{} : Result<void>(interpolated.error());
}

/// None, or one for each source, whose unit is known then.
Result<void> check_elements(const SourceElements& elements, const CompactBasis& basis) {
  const std::size_t count = elements.corner.size();
  if (elements.reflectance.size() != count || (count > 0 && (count != basis.sources() || basis.light_unit.empty())))
    return broken("the elements of surface are not those of the sources");
  for (const std::array<glm::vec3, 3>& corner : elements.corner)
    for (const glm::vec3& c : corner)
      if (!bounded(glm::dvec3(c)))
        return broken("a corner of an element is not finite");
  if (!std::ranges::all_of(elements.reflectance, in_unit_range))
    return broken("the reflectance of an element is out of range");
  return {};
}

/// One basis: rows of constant regions, increasing and finite, or factors over nodes.
Result<void> check_rows(const BasisVolume& volume) {
  if (volume.compact) {
    if (!volume.partition.interpolated() || !volume.partition.rectangles().empty() || !volume.stored_region.empty() ||
        !volume.basis.empty() || !volume.band4.empty())
      return broken("a compact basis beside another one, or without nodes");
    if (const Result<void> good = check_compact(*volume.compact, volume.partition.size(), volume.probes.size()); !good)
      return good;
    return check_elements(volume.elements, *volume.compact);
  }
  if (!volume.elements.corner.empty() || !volume.elements.reflectance.empty())
    return broken("elements of surface without a compact basis");
  int last = -1;
  for (const std::int32_t region : volume.stored_region) {
    if (region <= last || region >= volume.partition.size())
      return broken(fmt::format("stored region {} is out of order or out of range", region));
    last = region;
  }
  if (volume.basis.size() != volume.stored_region.size() * volume.row_floats() ||
      (!volume.band4.empty() && volume.band4.size() != volume.basis.size()))
    return broken("the basis does not match the probes and regions");
  if (!all_finite(volume.basis) || !all_finite(volume.band4))
    return broken("the basis holds a number that is not finite");
  return {};
}

Result<void> check_simplified(const ReflectingSurfaces& surfaces) {
  if (!all_bounded(surfaces.vertices))
    return broken("a vertex of the simplified room is not finite");
  for (const auto& corners : surfaces.triangles)
    for (const std::uint32_t v : corners)
      if (v >= surfaces.vertices.size())
        return broken("a simplified triangle names a vertex that does not exist");
  return {};
}

/// Indices of vertices and materials exist; reflectance and transmittance are in 0..1, indices of glass 0 or physical.
Result<void> check_room(const Room& room) {
  if (!all_bounded(room.vertices))
    return broken("a vertex of the room is not finite");
  for (const RoomTriangle& t : room.triangles) {
    if (t.material >= room.materials.size())
      return broken("a triangle names a material that does not exist");
    for (const std::uint32_t v : t.vertex)
      if (v >= room.vertices.size())
        return broken("a triangle names a vertex that does not exist");
  }
  for (const Material& m : room.materials)
    if (!in_unit_range(m.reflectance) || !in_unit_range(m.transmittance) || !glass_index(m.refractive_index))
      return broken("a reflectance, transmittance or refractive index is out of range");
  return {};
}

/// Three corners at least, a unit normal (within 1e-6), transmittance in 0..1.
Result<void> check_apertures(const std::vector<Aperture>& apertures) {
  for (const Aperture& a : apertures)
    if (a.corners.size() < 3 || !all_bounded(a.corners) || !(std::abs(glm::length(a.inward) - 1.0) < 1e-6) ||
        !in_unit_range(a.transmittance) || !glass_index(a.refractive_index))
      return broken("an aperture is damaged");
  return {};
}

} // namespace

/// The order matters: later checks use indices that earlier ones have found good.
Result<void> check_volume(const BasisVolume& volume) {
  if (volume.partition.size() <= 0)
    return broken("no sky partition");
  if (Result<void> good = check_probes(volume.probes); !good)
    return good;
  if (Result<void> good = check_rows(volume); !good)
    return good;
  if (Result<void> good = check_room(volume.room); !good)
    return good;
  if (Result<void> good = check_simplified(volume.simplified); !good)
    return good;
  return check_apertures(volume.apertures);
}

} // namespace daylit
