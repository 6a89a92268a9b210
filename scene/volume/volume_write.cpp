#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <Imath/half.h>
#include <nlohmann/json.hpp>

#include "scene/core/atomic_file.h"
#include "scene/core/parallel.h"
#include "scene/format/safetensors.h"
#include "scene/volume/packed_tensors.h"
#include "scene/volume/volume_file.h"
#include "scene/volume/volume_identity.h"
#include "scene/volume/volume_tensors.h"

namespace daylit {

namespace {

using detail::FlatTensors;
using detail::Presence;
using Shape = std::vector<std::uint64_t>;

/// Indices of refraction are written only where some pane is of clear glass.
void flatten_room(const BasisVolume& volume, FlatTensors& flat) {
  const bool clear_glass =
      std::ranges::any_of(volume.apertures, [](const Aperture& a) { return a.refractive_index > 0.0f; });
  for (const RoomTriangle& t : volume.room.triangles) {
    flat.triangle.push_back(t.vertex);
    flat.triangle_material.push_back(t.material);
  }
  for (const Material& m : volume.room.materials) {
    flat.reflectance.push_back(m.reflectance);
    flat.transmittance.push_back(m.transmittance);
    flat.is_window.push_back(m.is_window ? 1 : 0);
    if (clear_glass)
      flat.refractive_index.push_back(m.refractive_index);
  }
  for (const Aperture& a : volume.apertures) {
    flat.corner.insert(flat.corner.end(), a.corners.begin(), a.corners.end());
    flat.corner_count.push_back(static_cast<std::int32_t>(a.corners.size()));
    flat.inward.push_back(a.inward);
    flat.aperture_transmittance.push_back(a.transmittance);
    if (clear_glass)
      flat.aperture_index.push_back(a.refractive_index);
  }
}

/// Vectors of three become three numbers, structures one list for each member.
FlatTensors flatten(const BasisVolume& volume) {
  FlatTensors flat;
  const ProbeSet& probes = volume.probes;
  for (int k = 0; k < 3; ++k) {
    flat.origin.push_back(probes.origin[k]);
    flat.grid_count.push_back(probes.count[k]);
    flat.grid_spacing.push_back(probes.spacing[k]);
  }
  for (const SkyBand& band : volume.partition.bands()) {
    flat.band.push_back({band.sin_low, band.sin_high});
    flat.band_cells.push_back({band.cells, band.centred ? 1 : 0});
  }
  flat.rectangle = volume.partition.rectangles();
  flatten_room(volume, flat);
  return flat;
}

/// Rows as they are written: half floats, each row divided by its scale, or the floats themselves with a scale of 1.
struct StoredRows {
  std::vector<std::uint16_t> half;
  std::vector<float> scale;
};

/// scale[r] = max |basis[r]|, half[r] = basis[r] / scale[r]: rounding errs by at most 2^-12 of the largest number.
StoredRows stored_rows(const BasisVolume& volume, const std::vector<float>& basis, BasisPrecision precision) {
  const std::size_t rows = volume.stored_region.size(), floats = volume.row_floats();
  StoredRows stored{{}, std::vector<float>(rows, 1.0f)};
  if (precision == BasisPrecision::float32)
    return stored;
  stored.half.resize(rows * floats);
  parallel_for(std::size_t{0}, rows, [&](std::size_t r) {
    const float* row = basis.data() + r * floats;
    float most = 0;
    for (std::size_t k = 0; k < floats; ++k)
      most = std::max(most, std::abs(row[k]));
    stored.scale[r] = most > 0 ? most : 1.0f;
    for (std::size_t k = 0; k < floats; ++k)
      stored.half[r * floats + k] = imath_float_to_half(row[k] / stored.scale[r]);
  });
  return stored;
}

/// Takes the tensors of a volume in turn.
class TensorList {
public:
  template <class T>
  void operator()(const std::string& name, const char* type, const Shape& tail, const std::vector<T>& list,
                  Presence presence) {
    if (presence == Presence::optional && list.empty())
      return;
    std::uint64_t entry_bytes = detail::dtype_bytes(type);
    for (const std::uint64_t d : tail)
      entry_bytes *= d;
    const std::span<const std::byte> bytes = std::as_bytes(std::span(list));
    Shape shape{entry_bytes > 0 ? bytes.size() / entry_bytes : 0};
    shape.insert(shape.end(), tail.begin(), tail.end());
    tensors.push_back({name, type, std::move(shape), bytes});
  }

  /// The basis of constant regions.
  void add_rows(const std::string& name, const BasisVolume& volume, const std::vector<float>& basis,
                const StoredRows& stored, BasisPrecision precision) {
    const Shape shape{volume.stored_region.size(), volume.probes.size(), 9, 3};
    if (precision == BasisPrecision::float16)
      tensors.push_back({name, "F16", shape, std::as_bytes(std::span(stored.half))});
    else
      tensors.push_back({name, "F32", shape, std::as_bytes(std::span(basis))});
    (*this)(name + ".scale", "F32", {}, stored.scale, Presence::always);
  }

  std::vector<detail::TensorToWrite> tensors;
};

/// What a reader needs beside the tensors, text for people, and where the volume comes from.
std::map<std::string, std::string> metadata_of(const BasisVolume& volume) {
  nlohmann::json names = nlohmann::json::array();
  for (const Material& m : volume.room.materials)
    names.push_back(m.name);
  const VolumeProvenance& p = volume.provenance;
  return {{"format", detail::kVolumeFormat},
          {"format_version", std::to_string(kVolumeFormatVersion)},
          {"checksum", detail::kNoChecksum},
          {"frame", "right-handed, z up; directions point to where the light comes from"},
          {"units", "metres; basis: steradian (indirect radiance coefficient per region radiance)"},
          {"spherical_harmonics", "real, orthonormal, index l*l+l+m, l <= 2, no Condon-Shortley phase; band4: l = 4, "
                                  "index m+4"},
          {"probe_layout", volume.probes.is_grid ? "grid" : "points"},
          {"partition", volume.partition.name()},
          {"material_names", names.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)},
          {"program_version", p.program_version},
          {"command_line", p.command_line},
          {"room_name", p.room_name},
          {"room_hash", p.room_hash},
          {"report", p.report_json}};
}

/// Puts the checksum of the whole file into its header; the digits are as long as their place holder.
void sign(detail::SafetensorsImage& image) {
  const std::size_t digits = image.header.find(detail::kChecksumKey) + detail::kChecksumKey.size();
  const std::string checksum = detail::volume_checksum(std::as_bytes(std::span(image.header)), digits, image.parts);
  image.header.replace(digits, checksum.size(), checksum);
}

using Parts = std::span<const std::span<const std::byte>>;

/// Hands the file, in parts that live as long as the call, to `take`.
template <class Take>
Result<void> with_file_parts(const BasisVolume& volume, BasisPrecision precision, Take take) {
  if (Result<void> good = check_volume(volume); !good)
    return good;
  const FlatTensors flat = flatten(volume);
  TensorList list;
  StoredRows basis, band4;
  std::map<std::string, std::string> metadata = metadata_of(volume);
  std::vector<std::vector<std::byte>> streams;
  if (volume.compact) {
    detail::visit_compact_tensors(*volume.compact, volume.has_band4(), list);
    if (std::string packed = detail::pack_tensors(list.tensors, streams); !packed.empty())
      metadata["packed"] = std::move(packed);
  } else {
    basis = stored_rows(volume, volume.basis, precision);
    list.add_rows("basis", volume, volume.basis, basis, precision);
    list("region.stored", "I32", {}, volume.stored_region, Presence::always);
    if (volume.has_band4()) {
      band4 = stored_rows(volume, volume.band4, precision);
      list.add_rows("basis.band4", volume, volume.band4, band4, precision);
    }
  }
  detail::visit_common_tensors(volume, flat, list);
  detail::SafetensorsImage image = detail::layout_safetensors(list.tensors, metadata);
  sign(image);
  std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(image.header))};
  parts.insert(parts.end(), image.parts.begin(), image.parts.end());
  return take(Parts(parts));
}

} // namespace

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
