#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/core/atomic_file.h"
#include "scene/core/parallel.h"
#include "scene/core/tile_kernels.h"
#include "scene/format/safetensors.h"
#include "scene/volume/volume_file.h"
#include "scene/volume/volume_identity.h"

namespace daylit {

namespace {

/// Tensors of a volume as flat arrays; those that BasisVolume keeps otherwise are copied here while writing.
struct FlatVolume {
  std::vector<double> bands, apertures, inward;
  std::vector<std::int32_t> rectangles;
  std::vector<std::int32_t> band_cells, aperture_corners;
  std::vector<std::uint32_t> triangles, triangle_material;
  std::vector<float> reflectance, transmittance, refractive_index, aperture_transmittance, aperture_index;
  /// Rows as half floats, each divided by its scale.
  struct HalfRows {
    std::vector<std::uint16_t> number;
    std::vector<float> scale;
  };
  HalfRows basis, band4;
  std::vector<std::uint32_t> sources, groups, bricks, band4_bricks;
  std::vector<std::uint8_t> is_window;
};

template <class T, class Vec>
void append3(std::vector<T>& list, const Vec& v) {
  list.insert(list.end(), {v.x, v.y, v.z});
}

std::vector<std::uint32_t> flat_bricks(const CompactFactors& factors) {
  std::vector<std::uint32_t> flat;
  for (const CompactFactors::Brick& b : factors.brick)
    flat.insert(flat.end(), {b.probes, b.pieces, b.word_rank, b.byte_rank});
  return flat;
}

FlatVolume flatten(const BasisVolume& volume) {
  FlatVolume flat;
  for (const SkyBand& band : volume.partition.bands()) {
    flat.bands.insert(flat.bands.end(), {band.sin_low, band.sin_high});
    flat.band_cells.insert(flat.band_cells.end(), {band.cells, band.centred ? 1 : 0});
  }
  for (const SkyRectangle& r : volume.partition.rectangles())
    flat.rectangles.insert(flat.rectangles.end(), {r.band, r.cell, r.bands, r.cells});
  for (const RoomTriangle& t : volume.room.triangles) {
    flat.triangles.insert(flat.triangles.end(), t.vertex.begin(), t.vertex.end());
    flat.triangle_material.push_back(t.material);
  }
  for (const Material& m : volume.room.materials) {
    append3(flat.reflectance, m.reflectance);
    append3(flat.transmittance, m.transmittance);
    flat.is_window.push_back(m.is_window ? 1 : 0);
    flat.refractive_index.push_back(m.refractive_index);
  }
  for (const Aperture& a : volume.apertures) {
    for (const glm::dvec3& corner : a.corners)
      append3(flat.apertures, corner);
    flat.aperture_corners.push_back(static_cast<std::int32_t>(a.corners.size()));
    append3(flat.inward, a.inward);
    append3(flat.aperture_transmittance, a.transmittance);
    flat.aperture_index.push_back(a.refractive_index);
  }
  if (volume.compact) {
    flat.bricks = flat_bricks(volume.compact->nine);
    flat.band4_bricks = flat_bricks(volume.compact->band4);
    for (const CompactBasis::Group& g : volume.compact->group)
      flat.groups.insert(flat.groups.end(), {g.first, g.end});
    flat.sources = {volume.compact->sources};
  }
  return flat;
}

/// Each row scaled so that its largest number is 1.
FlatVolume::HalfRows halved(const BasisVolume& volume, const std::vector<float>& basis) {
  const std::size_t rows = volume.stored_region.size(), floats = volume.row_floats();
  FlatVolume::HalfRows half{std::vector<std::uint16_t>(rows * floats), std::vector<float>(rows)};
  parallel_for(std::size_t{0}, rows, [&](std::size_t r) {
    const float* row = basis.data() + r * floats;
    float most = 0;
    for (std::size_t k = 0; k < floats; ++k)
      most = std::max(most, std::abs(row[k]));
    half.scale[r] = most > 0 ? most : 1.0f;
    for (std::size_t k = 0; k < floats; ++k)
      half.number[r * floats + k] = detail::to_half(row[k] / half.scale[r]);
  });
  return half;
}

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& list) {
  return std::as_bytes(std::span(list));
}
std::span<const std::byte> bytes_of(const glm::dvec3& v) { return std::as_bytes(std::span(&v.x, 3)); }
std::span<const std::byte> bytes_of(const glm::ivec3& v) { return std::as_bytes(std::span(&v.x, 3)); }

/// Panes of which a reader has to know the angle of incidence.
bool has_clear_glass(const BasisVolume& volume) {
  return std::ranges::any_of(volume.apertures, [](const Aperture& a) { return a.refractive_index > 0.0f; });
}

using Tensors = std::vector<detail::TensorToWrite>;

void add_rows(const std::string& name, const BasisVolume& volume, const std::vector<float>& basis,
              const FlatVolume::HalfRows& half, Tensors& list) {
  const std::uint64_t rows = volume.stored_region.size();
  const std::vector<std::uint64_t> shape{rows, volume.probes.size(), 9, 3};
  if (half.scale.empty()) {
    list.push_back({name, "F32", shape, bytes_of(basis)});
    return;
  }
  list.push_back({name, "F16", shape, bytes_of(half.number)});
  list.push_back({name + ".scale", "F32", {rows}, bytes_of(half.scale)});
}

Tensors basis_tensors(const BasisVolume& volume, const FlatVolume& flat) {
  Tensors list;
  add_rows("basis", volume, volume.basis, flat.basis, list);
  list.push_back({"region.stored", "I32", {volume.stored_region.size()}, bytes_of(volume.stored_region)});
  if (volume.has_band4())
    add_rows("basis.band4", volume, volume.band4, flat.band4, list);
  return list;
}

/// `prefix`: of all names.
void add_factors(const std::string& prefix, const CompactFactors& factors, const std::vector<std::uint32_t>& bricks,
                 Tensors& list) {
  const auto add = [&](const char* name, const char* type, const std::vector<std::uint64_t>& shape,
                       const auto& numbers) {
    list.push_back({prefix + name, type, shape, bytes_of(numbers)});
  };
  add("brick", "U32", {bricks.size() / 4, 4}, bricks);
  add("probe", "U32", {factors.probe.size()}, factors.probe);
  add("piece", "U32", {factors.piece.size()}, factors.piece);
  add("scale", "F32", {factors.scale.size()}, factors.scale);
  add("source_factor", "I8", {factors.source_factor.size()}, factors.source_factor);
  add("probe_factor", "I8", {factors.probe_factor.size()}, factors.probe_factor);
}

Tensors compact_tensors(const CompactBasis& basis, const FlatVolume& flat) {
  const std::uint64_t rows = basis.light.rows();
  Tensors list = {
      {"compact.sources", "U32", {1}, bytes_of(flat.sources)},
      {"compact.light_scale", "F32", {rows}, bytes_of(basis.light.scale)},
      {"compact.light_first_block", "U32", {rows + 1}, bytes_of(basis.light.first_block)},
      {"compact.light_block", "U16", {basis.light.block.size()}, bytes_of(basis.light.block)},
      {"compact.light_weight", "F16", {basis.light.block.size(), FirstLight::kBlock}, bytes_of(basis.light.weight)},
      {"compact.group", "U32", {basis.group.size(), 2}, bytes_of(flat.groups)},
      {"compact.group_weight", "F32", {basis.group_weight.size()}, bytes_of(basis.group_weight)},
  };
  add_factors("compact.", basis.nine, flat.bricks, list);
  if (!basis.band4.brick.empty())
    add_factors("compact.band4.", basis.band4, flat.band4_bricks, list);
  return list;
}

Tensors room_tensors(const BasisVolume& volume, const FlatVolume& flat) {
  const std::uint64_t probes = volume.probes.size(), apertures = volume.apertures.size(),
                      triangles = volume.room.triangles.size(), materials = volume.room.materials.size();
  Tensors list = {
      {"probe.position", "F32", {probes, 3}, bytes_of(volume.probes.positions)},
      {"probe.valid", "U8", {probes}, bytes_of(volume.probes.valid)},
      {"probe.origin", "F64", {3}, bytes_of(volume.probes.origin)},
      {"probe.grid_count", "I32", {3}, bytes_of(volume.probes.count)},
      {"probe.grid_spacing", "F64", {3}, bytes_of(volume.probes.spacing)},
      {"sky.band", "F64", {flat.band_cells.size() / 2, 2}, bytes_of(flat.bands)},
      {"sky.band_cells", "I32", {flat.band_cells.size() / 2, 2}, bytes_of(flat.band_cells)},
      {"room.vertex", "F64", {volume.room.vertices.size(), 3}, bytes_of(volume.room.vertices)},
      {"room.triangle", "U32", {triangles, 3}, bytes_of(flat.triangles)},
      {"room.triangle_material", "U32", {triangles}, bytes_of(flat.triangle_material)},
      {"material.reflectance", "F32", {materials, 3}, bytes_of(flat.reflectance)},
      {"material.transmittance", "F32", {materials, 3}, bytes_of(flat.transmittance)},
      {"material.is_window", "U8", {materials}, bytes_of(flat.is_window)},
      {"aperture.corner", "F64", {flat.apertures.size() / 3, 3}, bytes_of(flat.apertures)},
      {"aperture.corner_count", "I32", {apertures}, bytes_of(flat.aperture_corners)},
      {"aperture.inward", "F64", {apertures, 3}, bytes_of(flat.inward)},
      {"aperture.transmittance", "F32", {apertures, 3}, bytes_of(flat.aperture_transmittance)},
  };
  if (volume.probes.is_grid && volume.probes.is_graded())
    for (std::size_t k = 0; k < 3; ++k) {
      const std::vector<double>& planes = volume.probes.planes[k];
      list.push_back({detail::kProbePlanes[k], "F64", {planes.size()}, bytes_of(planes)});
    }
  if (!flat.rectangles.empty())
    list.push_back({"sky.rectangle", "I32", {flat.rectangles.size() / 4, 4}, bytes_of(flat.rectangles)});
  if (has_clear_glass(volume)) {
    list.push_back({"material.refractive_index", "F32", {materials}, bytes_of(flat.refractive_index)});
    list.push_back({"aperture.refractive_index", "F32", {apertures}, bytes_of(flat.aperture_index)});
  }
  return list;
}

std::map<std::string, std::string> metadata_of(const BasisVolume& volume) {
  nlohmann::json names = nlohmann::json::array();
  for (const Material& m : volume.room.materials)
    names.push_back(m.name);
  const VolumeProvenance& p = volume.provenance;
  return {{"format", detail::kVolumeFormat},
          {"format_version", std::to_string(volume_format_version(volume))},
          {"checksum", detail::kNoChecksum},
          {"frame", "right-handed, z up; directions point to where the light comes from"},
          {"units", "metres; basis: steradian (indirect radiance coefficient per region radiance)"},
          {"spherical_harmonics", volume.has_band4()
                                      ? "real, orthonormal, index l*l+l+m, l <= 2, no Condon-Shortley phase; band4: "
                                        "l = 4, index m+4"
                                      : "real, orthonormal, index l*l+l+m, l <= 2, no Condon-Shortley phase"},
          {"probe_layout", volume.probes.is_grid ? "grid" : "points"},
          {"partition", volume.partition.name()},
          {"material_names", names.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)},
          {"program_version", p.program_version},
          {"command_line", p.command_line},
          {"room_name", p.room_name},
          {"room_hash", p.room_hash},
          {"report", p.report_json}};
}

using Parts = std::span<const std::span<const std::byte>>;

/// Hands the file, in parts that live as long as the call, to `take`.
template <class Take>
Result<void> with_file_parts(const BasisVolume& volume, BasisPrecision precision, Take take) {
  if (Result<void> good = check_volume(volume); !good)
    return good;
  FlatVolume flat = flatten(volume);
  if (precision == BasisPrecision::float16 && !volume.compact) {
    flat.basis = halved(volume, volume.basis);
    if (volume.has_band4())
      flat.band4 = halved(volume, volume.band4);
  }
  Tensors tensors = volume.compact ? compact_tensors(*volume.compact, flat) : basis_tensors(volume, flat);
  const Tensors room = room_tensors(volume, flat);
  tensors.insert(tensors.end(), room.begin(), room.end());
  detail::SafetensorsImage image = detail::layout_safetensors(tensors, metadata_of(volume));
  const std::size_t digits = image.header.find(detail::kChecksumKey) + detail::kChecksumKey.size();
  const std::string checksum = detail::volume_checksum(std::as_bytes(std::span(image.header)), digits, image.parts);
  image.header.replace(digits, checksum.size(), checksum);
  std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(image.header))};
  parts.insert(parts.end(), image.parts.begin(), image.parts.end());
  return take(Parts(parts));
}

} // namespace

int volume_format_version(const BasisVolume& volume) {
  if (volume.probes.is_grid && volume.probes.is_graded())
    return kVolumeFormatGraded;
  if (!volume.partition.rectangles().empty())
    return kVolumeFormatRectangles;
  if (volume.compact)
    return kVolumeFormatCompact;
  return has_clear_glass(volume) ? kVolumeFormatClearGlass : kVolumeFormatConstantPanes;
}

Result<std::vector<std::uint8_t>> volume_bytes(const BasisVolume& volume, BasisPrecision precision) {
  std::vector<std::uint8_t> bytes;
  const Result<void> laid_out = with_file_parts(volume, precision, [&](Parts parts) -> Result<void> {
    for (const std::span<const std::byte> part : parts) {
      const auto* first = reinterpret_cast<const std::uint8_t*>(part.data());
      bytes.insert(bytes.end(), first, first + part.size());
    }
    return {};
  });
  if (!laid_out)
    return laid_out.error();
  return bytes;
}

Result<void> write_volume(const std::filesystem::path& path, const BasisVolume& volume, BasisPrecision precision) {
  Result<void> written =
      with_file_parts(volume, precision, [&](Parts parts) { return write_file_atomically(path, parts); });
  if (written)
    return written;
  Error error = written.error();
  error.where = path.string();
  return error;
}

} // namespace daylit
