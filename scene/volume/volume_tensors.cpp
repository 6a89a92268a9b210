#include "scene/volume/volume_tensors.h"

#include <utility>

#include <nlohmann/json.hpp>

namespace daylit::detail {

namespace {

constexpr std::int64_t kMostSkyCells = 1000000;

Error disagree(const char* what) { return {ErrorCode::file_malformed, what, "volume", ""}; }

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

/// A list has an entry for each of `count`, or is optional and empty.
template <class T>
bool is_optional_list(const std::vector<T>& list, std::size_t count) {
  return list.empty() || list.size() == count;
}

} // namespace

/// The number of cells is bounded before anything of that size is made: by kMostSkyCells, and with rectangles, whose
/// map from cells is larger in memory than in the file, by the size of the file.
Result<SkyPartition> restore_partition(FlatTensors& flat, const std::string& name, std::size_t file_bytes) {
  if (flat.band_cells.size() != flat.band.size())
    return disagree("the sky bands disagree in number");
  std::vector<SkyBand> bands;
  bands.reserve(flat.band.size()); // growing by doubling would take more than twice the file
  std::int64_t first = 0;
  for (std::size_t i = 0; i < flat.band.size(); ++i) {
    const auto [cells, centred] = flat.band_cells[i];
    if (cells < 1 || first + cells > kMostSkyCells)
      return disagree("a sky band has too few or too many cells");
    bands.push_back({flat.band[i][0], flat.band[i][1], cells, static_cast<int>(first), centred != 0});
    first += cells;
  }
  if (flat.rectangle.empty())
    return SkyPartition::from_bands(std::move(bands), name);
  if (static_cast<std::size_t>(first) * sizeof(std::int32_t) > file_bytes)
    return disagree("more cells of the sky than the file has room for");
  return SkyPartition::from_rectangles(std::move(bands), std::move(flat.rectangle), name);
}

Result<void> restore_probes(const FlatTensors& flat, bool is_grid, ProbeSet& probes) {
  if (flat.origin.size() != 3 || flat.grid_count.size() != 3 || flat.grid_spacing.size() != 3)
    return disagree("the origin, counts or spacing of the probes are not three numbers");
  probes.is_grid = is_grid;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    probes.origin[k] = flat.origin[i];
    probes.count[k] = flat.grid_count[i];
    probes.spacing[k] = flat.grid_spacing[i];
  }
  return {};
}

/// A material takes more memory than its numbers in the file: as many as twice the file holds.
Result<void> restore_room(const FlatTensors& flat, const std::string& names_json, std::size_t file_bytes, Room& room) {
  const std::size_t triangles = flat.triangle.size(), materials = flat.reflectance.size();
  if (flat.triangle_material.size() != triangles)
    return disagree("the tensors of the room's triangles disagree in number");
  if (materials * sizeof(Material) > 2 * file_bytes || flat.transmittance.size() != materials ||
      flat.is_window.size() != materials || !is_optional_list(flat.refractive_index, materials))
    return disagree("the tensors of the materials disagree in number");
  room.triangles.resize(triangles);
  for (std::size_t i = 0; i < triangles; ++i)
    room.triangles[i] = {flat.triangle[i], flat.triangle_material[i]};
  room.materials.resize(materials);
  for (std::size_t i = 0; i < materials; ++i)
    room.materials[i] = {"", flat.reflectance[i], flat.transmittance[i], flat.is_window[i] != 0,
                         flat.refractive_index.empty() ? 0.0f : flat.refractive_index[i]};
  NameList names(room.materials);
  if (!nlohmann::json::sax_parse(names_json, &names) || !names.complete())
    return disagree("the names of the materials are no list of as many names");
  return {};
}

/// Corners follow each other, corner_count[i] of them for aperture i.
Result<void> restore_apertures(const FlatTensors& flat, std::vector<Aperture>& apertures) {
  const std::size_t count = flat.corner_count.size();
  if (flat.inward.size() != count || flat.aperture_transmittance.size() != count ||
      !is_optional_list(flat.aperture_index, count))
    return disagree("the tensors of the apertures disagree in number");
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t corners = flat.corner_count[i];
    if (corners < 3 || static_cast<std::size_t>(corners) > flat.corner.size() - next)
      return disagree("an aperture has too few corners, or more than there are");
    const auto begin = flat.corner.begin() + static_cast<std::ptrdiff_t>(next);
    apertures.push_back({{begin, begin + corners},
                         flat.inward[i],
                         flat.aperture_transmittance[i],
                         flat.aperture_index.empty() ? 0.0f : flat.aperture_index[i]});
    next += static_cast<std::size_t>(corners);
  }
  return next == flat.corner.size() ? Result<void>{} : disagree("there are corners of no aperture");
}

} // namespace daylit::detail
