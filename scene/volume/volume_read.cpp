#include <algorithm>
#include <cstring>
#include <map>
#include <memory>

#include <Imath/half.h>
#include <fmt/format.h>

#include "scene/core/read_file.h"
#include "scene/format/safetensors.h"
#include "scene/volume/packed_tensors.h"
#include "scene/volume/volume_file.h"
#include "scene/volume/volume_identity.h"
#include "scene/volume/volume_tensors.h"

namespace daylit {

namespace {

using detail::Presence;
using Shape = std::vector<std::uint64_t>;

std::string text_of(const detail::SafetensorsHeader& header, const std::string& key) {
  const auto entry = header.metadata.find(key);
  return entry == header.metadata.end() ? std::string() : entry->second;
}

/// Copies tensors out of a file whose sizes are already known to be consistent.
class TensorReader {
public:
  TensorReader(std::span<const std::uint8_t> file, const detail::SafetensorsHeader& header)
      : data_(file.subspan(header.data_offset)), tensors_(header.tensors),
        packed_(detail::packed_tensors(text_of(header, "packed"), header.tensors)) {
    for (const auto& [name, entry] : packed_)
      tensors_[name] = entry;
  }

  /// Empty: all tensors asked for were there, with the right type and shape.
  const std::string& problem() const { return problem_; }

  bool has(const std::string& name) const { return tensors_.contains(name); }
  bool has(const std::string& name, const char* type) const {
    const auto entry = tensors_.find(name);
    return entry != tensors_.end() && entry->second.dtype == type;
  }

  /// `tail`: all dimensions but the first.
  template <class T>
  void operator()(const std::string& name, const char* type, const Shape& tail, std::vector<T>& list,
                  Presence presence) {
    const auto entry = tensors_.find(name);
    if (entry == tensors_.end() && presence == Presence::optional)
      return;
    if (entry == tensors_.end() || entry->second.dtype != type || entry->second.shape.size() != tail.size() + 1 ||
        !std::equal(tail.begin(), tail.end(), entry->second.shape.begin() + 1)) {
      note("tensor \"" + name + "\" is missing or has another type or shape");
      return;
    }
    const detail::TensorEntry& e = entry->second;
    list.resize(e.count() * detail::dtype_bytes(type) / sizeof(T));
    const std::span<const std::uint8_t> stored = data_.subspan(e.begin, e.end - e.begin);
    if (list.empty())
      return;
    if (!packed_.contains(name))
      std::memcpy(static_cast<void*>(list.data()), stored.data(), stored.size());
    else if (!detail::unpack(stored, std::as_writable_bytes(std::span(list))))
      note("tensor \"" + name + "\" does not unpack to its shape");
  }

private:
  void note(std::string problem) {
    if (problem_.empty())
      problem_ = std::move(problem);
  }

  std::span<const std::uint8_t> data_;
  std::map<std::string, detail::TensorEntry> tensors_, packed_; ///< those that are packed as what they hold
  std::string problem_;
};

Error malformed(const std::string& what, const std::string& name) {
  return {ErrorCode::file_malformed, what, name, "bake it again with daylit-precompute"};
}

/// basis[r] = scale[r] * stored[r]
Result<void> read_rows(TensorReader& reader, const std::string& name, const BasisVolume& volume,
                       std::vector<float>& basis) {
  const Shape row{volume.probes.size(), 9, 3};
  std::vector<float> scale;
  reader(name + ".scale", "F32", {}, scale, Presence::always);
  if (reader.has(name, "F16")) {
    std::vector<std::uint16_t> half;
    reader(name, "F16", row, half, Presence::always);
    basis.resize(half.size());
    std::ranges::transform(half, basis.begin(), [](std::uint16_t h) { return imath_half_to_float(h); });
  } else {
    reader(name, "F32", row, basis, Presence::always);
  }
  if (basis.size() != scale.size() * volume.row_floats())
    return malformed("the scales of the basis disagree in number", name);
  for (std::size_t r = 0; r < scale.size(); ++r)
    for (std::size_t k = r * volume.row_floats(); k < (r + 1) * volume.row_floats(); ++k)
      basis[k] *= scale[r];
  return {};
}

/// A fine sky where there are clusters, else rows of constant regions.
Result<void> read_basis(TensorReader& reader, BasisVolume& volume) {
  if (reader.has("compact.cluster")) {
    volume.partition = volume.partition.with_interpolation(true);
    CompactBasis basis;
    detail::visit_compact_tensors(basis, reader.has("compact.band4.cluster"), reader);
    basis.light.colours = basis.light.scale.size() > basis.aggregate_weight.size() ? 3 : 1;
    volume.compact = std::make_shared<const CompactBasis>(std::move(basis));
    return {};
  }
  reader("region.stored", "I32", {}, volume.stored_region, Presence::always);
  if (const Result<void> good = read_rows(reader, "basis", volume, volume.basis); !good)
    return good;
  return reader.has("basis.band4") ? read_rows(reader, "basis.band4", volume, volume.band4) : Result<void>{};
}

/// Format, version and checksum, in this order.
Result<void> check_identity(std::span<const std::uint8_t> bytes, const detail::SafetensorsHeader& header,
                            const std::string& name) {
  const std::string format = text_of(header, "format"), version = text_of(header, "format_version").substr(0, 20);
  if (format != detail::kVolumeFormat && format != detail::kOldVolumeFormat)
    return Error{ErrorCode::file_malformed, "this is a safetensors file, but no volume", name, ""};
  if (format == detail::kOldVolumeFormat || version != std::to_string(kVolumeFormatVersion))
    return Error{ErrorCode::file_version,
                 fmt::format("a volume of {}version {}; this program reads version {} of the format {}",
                             format == detail::kOldVolumeFormat ? "the earlier format, " : "", version,
                             kVolumeFormatVersion, detail::kVolumeFormat),
                 name, "bake it again with the daylit-precompute of this version"};
  const std::span<const std::byte> file = std::as_bytes(bytes), head = file.first(header.data_offset);
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const std::size_t key = text.find(detail::kChecksumKey), digits = key + detail::kChecksumKey.size();
  const std::span<const std::byte> data = file.subspan(header.data_offset);
  if (key == std::string_view::npos || digits + detail::kNoChecksum.size() > text.size() ||
      text.substr(digits, detail::kNoChecksum.size()) != detail::volume_checksum(head, digits, std::span(&data, 1)))
    return Error{ErrorCode::file_malformed, "the checksum does not match: the file is damaged", name,
                 "copy it again, or bake it again with daylit-precompute"};
  return {};
}

/// All of the volume but its provenance.
Result<BasisVolume> read_tensors(TensorReader& reader, const detail::SafetensorsHeader& header,
                                 std::size_t file_bytes) {
  BasisVolume volume;
  detail::FlatTensors flat;
  detail::visit_common_tensors(volume, flat, reader);
  if (const Result<void> good = detail::restore_probes(flat, text_of(header, "probe_layout") == "grid", volume.probes);
      !good)
    return good.error();
  Result<SkyPartition> partition = detail::restore_partition(flat, text_of(header, "partition"), file_bytes);
  if (!partition)
    return partition.error();
  volume.partition = std::move(*partition);
  if (const Result<void> good = detail::restore_room(flat, text_of(header, "material_names"), file_bytes, volume.room);
      !good)
    return good.error();
  if (const Result<void> good = detail::restore_apertures(flat, volume.apertures); !good)
    return good.error();
  if (const Result<void> good = read_basis(reader, volume); !good)
    return good.error();
  return volume;
}

} // namespace

/// From the outside in: container, identity and checksum, tensors, and last what check_volume() asks of every volume.
Result<BasisVolume> parse_volume(std::span<const std::uint8_t> bytes, const std::string& name) {
  const Result<detail::SafetensorsHeader> header = detail::parse_safetensors(bytes, name);
  if (!header)
    return header.error();
  if (const Result<void> good = check_identity(bytes, *header, name); !good)
    return good.error();
  TensorReader reader(bytes, *header);
  Result<BasisVolume> volume = read_tensors(reader, *header, bytes.size());
  if (!reader.problem().empty())
    return malformed(reader.problem(), name);
  if (!volume)
    return malformed(volume.error().what, name);
  if (const Result<void> good = check_volume(*volume); !good)
    return malformed(good.error().what, name);
  volume->provenance = {text_of(*header, "program_version"), text_of(*header, "command_line"),
                        text_of(*header, "room_name"), text_of(*header, "room_hash"), text_of(*header, "report")};
  return volume;
}

Result<BasisVolume> read_volume(const std::filesystem::path& path) {
  const Result<InputFile> file = InputFile::open(path);
  if (!file) {
    Error error = file.error();
    error.hint = "make the volume with daylit-precompute";
    return error;
  }
  // Memory that is not cleared first, and no mapping: a mapped file that shrinks meanwhile would end the process.
  const std::unique_ptr<std::uint8_t[]> bytes(new std::uint8_t[file->size()]);
  return parse_volume({bytes.get(), file->read({bytes.get(), file->size()})}, path.string());
}

} // namespace daylit
