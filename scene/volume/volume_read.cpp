#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <memory>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "scene/core/tile_kernels.h"
#include "scene/format/safetensors.h"
#include "scene/volume/volume_file.h"
#include "scene/volume/volume_identity.h"

namespace daylit {

namespace {

/// Copies tensors out of a file whose sizes are already known to be consistent.
class TensorReader {
public:
  TensorReader(std::span<const std::uint8_t> file, const detail::SafetensorsHeader& header)
      : data_(file.subspan(header.data_offset)), header_(header) {}

  /// Empty problem: all tensors asked for were there, with the right type and shape.
  const std::string& problem() const { return problem_; }

  /// `tail`: the fixed last dimensions. Returns the leading dimension.
  template <class T>
  std::uint64_t read(const std::string& name, const char* dtype, const std::vector<std::uint64_t>& tail,
                     std::vector<T>& list) {
    const detail::TensorEntry* entry = find(name, dtype, tail);
    if (!entry)
      return 0;
    list.resize((entry->end - entry->begin) / sizeof(T));
    if (!list.empty())
      std::memcpy(list.data(), data_.data() + entry->begin, entry->end - entry->begin);
    return entry->shape[0];
  }

  template <class Vec>
  void read3(const std::string& name, const char* dtype, Vec& v) {
    const auto entry = header_.tensors.find(name);
    if (entry == header_.tensors.end() || entry->second.dtype != dtype ||
        entry->second.shape != std::vector<std::uint64_t>{3})
      return fail(name);
    std::memcpy(&v.x, data_.data() + entry->second.begin, sizeof(v));
  }

  bool has(const std::string& name, const char* dtype) const {
    const auto entry = header_.tensors.find(name);
    return entry != header_.tensors.end() && entry->second.dtype == dtype;
  }

  /// Of any type. What is optional is there as a whole or not at all.
  bool has_any(const std::string& prefix) const {
    const auto entry = header_.tensors.lower_bound(prefix);
    return entry != header_.tensors.end() && entry->first.starts_with(prefix);
  }

private:
  const detail::TensorEntry* find(const std::string& name, const char* dtype, const std::vector<std::uint64_t>& tail) {
    const auto entry = header_.tensors.find(name);
    const bool good = entry != header_.tensors.end() && entry->second.dtype == dtype &&
                      entry->second.shape.size() == tail.size() + 1 &&
                      std::equal(tail.begin(), tail.end(), entry->second.shape.begin() + 1);
    if (good)
      return &entry->second;
    fail(name);
    return nullptr;
  }

  void fail(const std::string& name) {
    if (problem_.empty())
      problem_ = "tensor \"" + name + "\" is missing or has another type or shape";
  }

  std::span<const std::uint8_t> data_;
  const detail::SafetensorsHeader& header_;
  std::string problem_;
};

/// False: its parts disagree in number.
bool read_basis(TensorReader& reader, const std::string& name, const BasisVolume& volume, std::vector<float>& basis) {
  const std::vector<std::uint64_t> row{volume.probes.size(), 9, 3};
  if (!reader.has(name, "F16")) {
    reader.read(name, "F32", row, basis);
    return true;
  }
  std::vector<std::uint16_t> halves;
  std::vector<float> scale;
  const std::uint64_t rows = reader.read(name, "F16", row, halves);
  if (reader.read(name + ".scale", "F32", {}, scale) != rows || !reader.problem().empty())
    return false;
  basis.resize(halves.size());
  for (std::size_t r = 0; r < scale.size(); ++r)
    for (std::size_t k = r * volume.row_floats(); k < (r + 1) * volume.row_floats(); ++k)
      basis[k] = scale[r] * detail::from_half(halves[k]);
  return true;
}

/// Any shape: check_compact() knows the sizes.
void read_factors(TensorReader& reader, const std::string& prefix, CompactFactors& factors) {
  std::vector<std::uint32_t> bricks;
  reader.read(prefix + "brick", "U32", {4}, bricks);
  reader.read(prefix + "probe", "U32", {}, factors.probe);
  reader.read(prefix + "piece", "U32", {}, factors.piece);
  reader.read(prefix + "scale", "F32", {}, factors.scale);
  reader.read(prefix + "source_factor", "I8", {}, factors.source_factor);
  reader.read(prefix + "probe_factor", "I8", {}, factors.probe_factor);
  factors.brick.reserve(bricks.size() / 4);
  for (std::size_t b = 0; b < bricks.size(); b += 4)
    factors.brick.push_back({bricks[b], bricks[b + 1], bricks[b + 2], bricks[b + 3]});
}

std::shared_ptr<const CompactBasis> read_compact(TensorReader& reader) {
  auto basis = std::make_shared<CompactBasis>();
  std::vector<std::uint32_t> groups, sources;
  reader.read("compact.sources", "U32", {}, sources);
  basis->sources = sources.size() == 1 ? sources[0] : 0; // no factor fits 0 sources: check_compact() refuses it
  FirstLight& light = basis->light;
  reader.read("compact.light_scale", "F32", {}, light.scale);
  reader.read("compact.light_first_block", "U32", {}, light.first_block);
  reader.read("compact.light_block", "U16", {}, light.block);
  reader.read("compact.light_weight", "F16", {FirstLight::kBlock}, light.weight);
  reader.read("compact.group", "U32", {2}, groups);
  basis->group.reserve(groups.size() / 2);
  for (std::size_t g = 0; g < groups.size(); g += 2)
    basis->group.push_back({groups[g], groups[g + 1]});
  reader.read("compact.group_weight", "F32", {}, basis->group_weight);
  read_factors(reader, "compact.", basis->nine);
  if (reader.has_any("compact.band4."))
    read_factors(reader, "compact.band4.", basis->band4);
  return basis;
}

/// The map from cells to rectangles is larger in memory than in the file, so the file's size bounds it.
Result<SkyPartition> read_partition(TensorReader& reader, const std::string& name, bool rectangles_of_cells,
                                    std::size_t file_bytes) {
  std::vector<double> limits;
  std::vector<std::int32_t> cells;
  const std::uint64_t count = reader.read("sky.band", "F64", {2}, limits);
  if (reader.read("sky.band_cells", "I32", {2}, cells) != count)
    return Error{ErrorCode::file_malformed, "the sky bands disagree in number", "sky partition", "bake it again"};
  std::vector<SkyBand> bands;
  bands.reserve(count); // growing by doubling would take more than twice the file
  std::int64_t first = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t n = cells[2 * i];
    if (n < 1 || first + n > 1000000)
      return Error{ErrorCode::file_malformed, "a sky band has too few or too many cells", "sky partition", ""};
    bands.push_back({limits[2 * i], limits[2 * i + 1], n, static_cast<int>(first), cells[2 * i + 1] != 0});
    first += n;
  }
  if (!rectangles_of_cells)
    return SkyPartition::from_bands(std::move(bands), name);
  if (static_cast<std::size_t>(first) * sizeof(std::int32_t) > file_bytes)
    return Error{ErrorCode::file_malformed, "more cells of the sky than the file has room for", "sky partition", ""};
  std::vector<std::int32_t> numbers;
  reader.read("sky.rectangle", "I32", {4}, numbers);
  std::vector<SkyRectangle> rectangles;
  for (std::size_t i = 0; i + 3 < numbers.size(); i += 4)
    rectangles.push_back({numbers[i], numbers[i + 1], numbers[i + 2], numbers[i + 3]});
  return SkyPartition::from_rectangles(std::move(bands), std::move(rectangles), name);
}

void read_probes(TensorReader& reader, bool is_grid, bool is_graded, ProbeSet& probes) {
  reader.read("probe.position", "F32", {3}, probes.positions);
  reader.read("probe.valid", "U8", {}, probes.valid);
  reader.read3("probe.origin", "F64", probes.origin);
  reader.read3("probe.grid_count", "I32", probes.count);
  reader.read3("probe.grid_spacing", "F64", probes.spacing);
  probes.is_grid = is_grid;
  if (is_graded)
    for (std::size_t k = 0; k < 3; ++k)
      reader.read(detail::kProbePlanes[k], "F64", {}, probes.planes[k]);
}

/// A JSON list of strings; stops at anything else, so that nothing nested builds up.
class NameList : public nlohmann::json_sax<nlohmann::json> {
public:
  explicit NameList(std::vector<Material>& materials) : materials_(materials) {}
  bool complete() const { return next_ == materials_.size(); }

  bool string(string_t& name) override {
    if (!inside_ || complete())
      return false;
    materials_[next_++].name = std::move(name);
    return true;
  }
  bool start_array(std::size_t) override { return !std::exchange(inside_, true); }
  bool end_array() override { return true; }
  bool null() override { return false; }
  bool boolean(bool) override { return false; }
  bool number_integer(number_integer_t) override { return false; }
  bool number_unsigned(number_unsigned_t) override { return false; }
  bool number_float(number_float_t, const string_t&) override { return false; }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return false; }
  bool key(string_t&) override { return false; }
  bool end_object() override { return false; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

private:
  std::vector<Material>& materials_;
  std::size_t next_ = 0;
  bool inside_ = false;
};

/// A material is larger in memory than in the file, so the file's size bounds them.
bool read_materials(TensorReader& reader, const std::string& names_json, std::size_t file_bytes,
                    std::vector<Material>& materials) {
  std::vector<Rgb> reflectance, transmittance;
  std::vector<std::uint8_t> is_window;
  const std::uint64_t count = reader.read("material.reflectance", "F32", {3}, reflectance);
  if (count * sizeof(Material) > 2 * file_bytes ||
      reader.read("material.transmittance", "F32", {3}, transmittance) != count ||
      reader.read("material.is_window", "U8", {}, is_window) != count)
    return false;
  std::vector<float> index;
  if (reader.has("material.refractive_index", "F32") &&
      reader.read("material.refractive_index", "F32", {}, index) != count)
    return false;
  materials.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    materials[i] = {"", reflectance[i], transmittance[i], is_window[i] != 0, index.empty() ? 0.0f : index[i]};
  NameList names(materials);
  return nlohmann::json::sax_parse(names_json, &names) && names.complete();
}

bool read_room(TensorReader& reader, const std::string& names_json, std::size_t file_bytes, Room& room) {
  std::vector<std::array<std::uint32_t, 3>> corners;
  std::vector<std::uint32_t> material;
  reader.read("room.vertex", "F64", {3}, room.vertices);
  const std::uint64_t count = reader.read("room.triangle", "U32", {3}, corners);
  if (reader.read("room.triangle_material", "U32", {}, material) != count)
    return false;
  room.triangles.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    room.triangles[i] = {corners[i], material[i]};
  return read_materials(reader, names_json, file_bytes, room.materials);
}

bool read_apertures(TensorReader& reader, std::vector<Aperture>& apertures) {
  std::vector<glm::dvec3> corners, inward;
  std::vector<std::int32_t> corner_count;
  std::vector<Rgb> transmittance;
  reader.read("aperture.corner", "F64", {3}, corners);
  const std::uint64_t count = reader.read("aperture.corner_count", "I32", {}, corner_count);
  if (reader.read("aperture.inward", "F64", {3}, inward) != count ||
      reader.read("aperture.transmittance", "F32", {3}, transmittance) != count)
    return false;
  std::vector<float> index;
  if (reader.has("aperture.refractive_index", "F32") &&
      reader.read("aperture.refractive_index", "F32", {}, index) != count)
    return false;
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t n = corner_count[i];
    if (n < 3 || static_cast<std::size_t>(n) > corners.size() - next)
      return false;
    const auto begin = corners.begin() + static_cast<std::ptrdiff_t>(next);
    apertures.push_back({{begin, begin + n}, inward[i], transmittance[i], index.empty() ? 0.0f : index[i]});
    next += static_cast<std::size_t>(n);
  }
  return next == corners.size();
}

std::string text_of(const detail::SafetensorsHeader& header, const std::string& key) {
  const auto entry = header.metadata.find(key);
  return entry == header.metadata.end() ? std::string() : entry->second;
}

/// Format, version and checksum, in this order.
Result<void> check_identity(std::span<const std::uint8_t> bytes, const detail::SafetensorsHeader& header,
                            const std::string& name) {
  if (text_of(header, "format") != detail::kVolumeFormat)
    return Error{ErrorCode::file_malformed, "this is a safetensors file, but no volume", name, ""};
  const std::string version = text_of(header, "format_version").substr(0, 20);
  if (version != std::to_string(kVolumeFormatConstantPanes) && version != std::to_string(kVolumeFormatClearGlass) &&
      version != std::to_string(kVolumeFormatCompact) && version != std::to_string(kVolumeFormatRectangles) &&
      version != std::to_string(kVolumeFormatGraded))
    return Error{ErrorCode::file_version,
                 fmt::format("volume format version {}; this program reads versions {}, {}, {}, {} and {}", version,
                             kVolumeFormatConstantPanes, kVolumeFormatClearGlass, kVolumeFormatRectangles,
                             kVolumeFormatCompact, kVolumeFormatGraded),
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

Error malformed(const std::string& what, const std::string& name) {
  return {ErrorCode::file_malformed, what, name, "bake it again with daylit-precompute"};
}

} // namespace

Result<BasisVolume> parse_volume(std::span<const std::uint8_t> bytes, const std::string& name) {
  const Result<detail::SafetensorsHeader> header = detail::parse_safetensors(bytes, name);
  if (!header)
    return header.error();
  if (const Result<void> good = check_identity(bytes, *header, name); !good)
    return good.error();
  TensorReader reader(bytes, *header);
  BasisVolume volume;
  const std::string version = text_of(*header, "format_version");
  // A graded grid may stand under any sky: then the tensors tell which.
  const bool graded = version == std::to_string(kVolumeFormatGraded);
  const bool rectangles = graded ? reader.has_any("sky.rectangle") : version == std::to_string(kVolumeFormatRectangles);
  const bool compact = graded ? reader.has_any("compact.") : version == std::to_string(kVolumeFormatCompact);
  Result<SkyPartition> partition = read_partition(reader, text_of(*header, "partition"), rectangles, bytes.size());
  if (!partition)
    return malformed(partition.error().what, name);
  volume.partition = std::move(*partition);
  read_probes(reader, text_of(*header, "probe_layout") == "grid", graded, volume.probes);
  if (graded && !volume.probes.is_graded())
    return malformed(reader.problem().empty() ? "the grid has no coordinates" : reader.problem(), name);
  if (compact) {
    volume.partition = volume.partition.with_interpolation(true);
    volume.compact = read_compact(reader);
  } else {
    reader.read("region.stored", "I32", {}, volume.stored_region);
    if (!read_basis(reader, "basis", volume, volume.basis) ||
        (reader.has_any("basis.band4") && !read_basis(reader, "basis.band4", volume, volume.band4)))
      return malformed(reader.problem().empty() ? "the scales of the basis disagree in number" : reader.problem(),
                       name);
  }
  if (!read_room(reader, text_of(*header, "material_names"), bytes.size(), volume.room))
    return malformed(reader.problem().empty() ? "the tensors of the room disagree in number" : reader.problem(), name);
  if (!read_apertures(reader, volume.apertures) || !reader.problem().empty())
    return malformed(reader.problem().empty() ? "the tensors of the apertures disagree" : reader.problem(), name);
  volume.provenance = {text_of(*header, "program_version"), text_of(*header, "command_line"),
                       text_of(*header, "room_name"), text_of(*header, "room_hash"), text_of(*header, "report")};
  if (const Result<void> good = check_volume(volume); !good)
    return malformed(good.error().what, name);
  return volume;
}

namespace {

std::size_t read_up_to(int fd, std::span<std::uint8_t> bytes) {
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t n = ::read(fd, bytes.data() + got, bytes.size() - got);
    if (n < 0 && errno == EINTR)
      continue;
    if (n <= 0)
      break;
    got += static_cast<std::size_t>(n);
  }
  return got;
}

} // namespace

Result<BasisVolume> read_volume(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status = {};
  if (fd < 0 || ::fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) {
    const Error error{ErrorCode::file_missing,
                      fd < 0 ? std::string("cannot open the volume: ") + std::strerror(errno)
                             : "this is no regular file",
                      path.string(), "make it with daylit-precompute"};
    if (fd >= 0)
      ::close(fd);
    return error;
  }
  // Memory that is not cleared first, and no mapping: a mapped file that shrinks meanwhile would end the process.
  const auto size = static_cast<std::size_t>(status.st_size);
  const std::unique_ptr<std::uint8_t[]> bytes(new std::uint8_t[size]);
  const std::size_t got = read_up_to(fd, {bytes.get(), size});
  ::close(fd);
  return parse_volume({bytes.get(), got}, path.string());
}

} // namespace daylit
