#pragma once

// The tensors of a `.volume` file, one line each, for the writer and the reader alike (docs/volume-format.md).

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/volume/volume.h"

namespace daylit::detail {

/// What BasisVolume keeps in another form than the file.
struct FlatTensors {
  std::vector<double> origin, grid_spacing; ///< three numbers
  std::vector<std::int32_t> grid_count;     ///< three numbers
  std::vector<std::array<double, 2>> band;
  std::vector<std::array<std::int32_t, 2>> band_cells;
  std::vector<SkyRectangle> rectangle;
  std::vector<std::array<std::uint32_t, 3>> triangle;
  std::vector<std::uint32_t> triangle_material;
  std::vector<Rgb> reflectance, transmittance;
  std::vector<std::uint8_t> is_window;
  std::vector<float> refractive_index;
  std::vector<glm::dvec3> corner, inward;
  std::vector<std::int32_t> corner_count;
  std::vector<Rgb> aperture_transmittance;
  std::vector<float> aperture_index;
};

/// An optional tensor is written unless it is empty, and empty where the file has none.
enum class Presence { always, optional };

/// Calls visit(name, type, the last dimensions, list, presence) for the tensors of every volume; the first dimension is
/// the length of the list.
template <class Volume, class Flat, class Visit>
void visit_common_tensors(Volume& volume, Flat& flat, Visit& visit) {
  using enum Presence;
  visit("probe.position", "F32", {3}, volume.probes.positions, always);
  visit("probe.valid", "U8", {}, volume.probes.valid, always);
  visit("probe.interpolated", "U8", {}, volume.probes.interpolated, optional);
  visit("probe.origin", "F64", {}, flat.origin, always);
  visit("probe.grid_count", "I32", {}, flat.grid_count, always);
  visit("probe.grid_spacing", "F64", {}, flat.grid_spacing, always);
  visit("probe.plane_x", "F64", {}, volume.probes.planes[0], optional);
  visit("probe.plane_y", "F64", {}, volume.probes.planes[1], optional);
  visit("probe.plane_z", "F64", {}, volume.probes.planes[2], optional);
  visit("element.corner", "F32", {3, 3}, volume.elements.corner, optional);
  visit("element.reflectance", "F32", {3}, volume.elements.reflectance, optional);
  visit("sky.band", "F64", {2}, flat.band, always);
  visit("sky.band_cells", "I32", {2}, flat.band_cells, always);
  visit("sky.rectangle", "I32", {4}, flat.rectangle, optional);
  visit("room.vertex", "F64", {3}, volume.room.vertices, always);
  visit("room.triangle", "U32", {3}, flat.triangle, always);
  visit("room.triangle_material", "U32", {}, flat.triangle_material, always);
  visit("simplified.vertex", "F64", {3}, volume.simplified.vertices, optional);
  visit("simplified.triangle", "U32", {3}, volume.simplified.triangles, optional);
  visit("material.reflectance", "F32", {3}, flat.reflectance, always);
  visit("material.transmittance", "F32", {3}, flat.transmittance, always);
  visit("material.is_window", "U8", {}, flat.is_window, always);
  visit("material.refractive_index", "F32", {}, flat.refractive_index, optional);
  visit("aperture.corner", "F64", {3}, flat.corner, always);
  visit("aperture.corner_count", "I32", {}, flat.corner_count, always);
  visit("aperture.inward", "F64", {3}, flat.inward, always);
  visit("aperture.transmittance", "F32", {3}, flat.aperture_transmittance, always);
  visit("aperture.refractive_index", "F32", {}, flat.aperture_index, optional);
}

/// `part`: "compact." or "compact.band4.".
template <class Factors, class Visit>
void visit_factor_tensors(const std::string& part, Factors& factors, Visit& visit) {
  using enum Presence;
  visit(part + "cluster", "U32", {4}, factors.cluster, always);
  visit(part + "probe", "U32", {}, factors.probe, always);
  visit(part + "source", "U32", {}, factors.source, always);
  const auto visit_components = [&](const std::string& kind, const char* type, auto& components) {
    visit(part + kind + "scale", "F32", {}, components.scale, always);
    visit(part + kind + "source_factor", type, {}, components.source_factor, always);
    visit(part + kind + "probe_factor", type, {}, components.probe_factor, always);
  };
  visit_components("strong.", "I16", factors.strong);
  visit_components("weak.", "I8", factors.weak);
}

/// `band4`: these factors are there.
template <class Compact, class Visit>
void visit_compact_tensors(Compact& basis, bool band4, Visit& visit) {
  using enum Presence;
  visit("compact.aggregate", "U32", {2}, basis.aggregate, always);
  visit("compact.aggregate_weight", "F32", {}, basis.aggregate_weight, always);
  visit("compact.light_scale", "F32", {basis.aggregate_weight.size()}, basis.light.scale, always);
  visit("compact.light_first_block", "U32", {}, basis.light.first_block, always);
  visit("compact.light_block", "U16", {}, basis.light.block, always);
  visit("compact.light_weight", "F16", {FirstLight::kBlock}, basis.light.weight, always);
  visit("compact.light_unit", "F32", {}, basis.light_unit, optional);
  visit_factor_tensors("compact.", basis.nine, visit);
  if (band4)
    visit_factor_tensors("compact.band4.", basis.band4, visit);
}

/// From the tensors of a file to what BasisVolume keeps. Error: sizes or numbers that fit nothing. What is larger in
/// memory than in the file is bounded by `file_bytes`.
Result<SkyPartition> restore_partition(FlatTensors& flat, const std::string& name, std::size_t file_bytes);
Result<void> restore_probes(const FlatTensors& flat, bool is_grid, ProbeSet& probes);
/// `names_json`: a JSON list of the names of the materials.
Result<void> restore_room(const FlatTensors& flat, const std::string& names_json, std::size_t file_bytes, Room& room);
Result<void> restore_apertures(const FlatTensors& flat, std::vector<Aperture>& apertures);

} // namespace daylit::detail
