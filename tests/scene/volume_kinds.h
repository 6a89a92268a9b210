#pragma once

// A small volume of every kind that a file can hold. A new kind enters the tests of damaged files as one line of
// volume_kinds().

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "scene/volume/volume_file.h"
#include "scene/volume/volume_identity.h"
#include "tests/scene/test_volumes.h"

namespace daylit::test {

struct VolumeKind {
  const char* name;
  BasisVolume volume;
  BasisPrecision precision = BasisPrecision::float32;
};

inline BasisVolume plain_volume() {
  BasisVolume volume = grid_volume(room_with_hole().room, {2, 3, 2}, 5);
  volume.room.materials.push_back({"window_\"süd\"", Rgb(0), Rgb(0.7f, 0.8f, 0.9f), true});
  volume.apertures = {{{{1, 0, 1}, {3, 0, 1}, {3, 0, 2}, {1, 0, 2}}, {0, 1, 0}, Rgb(1)},
                      {{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {0, -1, 0}, Rgb(0.5f)}};
  volume.provenance = {"0.1", "daylit-precompute room.obj", "room.obj", "0123456789abcdef", "{\"t\": [1, 2]}"};
  return volume;
}

inline BasisVolume with_clear_glass(BasisVolume volume) {
  volume.room.materials.back().refractive_index = 1.52f;
  volume.apertures.back().refractive_index = 1.52f;
  return volume;
}

/// No two numbers alike beside each other.
template <class T>
void fill(std::vector<T>& list, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k)
    list.push_back(static_cast<T>((static_cast<int>(k % 101) - 50) * (sizeof(T) == 2 ? 600 : 2)));
}
inline void fill_factors(CompactFactors& f) {
  const ClusterOffsets end = cluster_offsets(f).back();
  fill(f.strong.source_factor, end.strong.source_factor);
  fill(f.strong.probe_factor, end.strong.probe_factor);
  fill(f.weak.source_factor, end.weak.source_factor);
  fill(f.weak.probe_factor, end.weak.probe_factor);
}

/// Two clusters of different rank over the nodes of a small partition; light rows for `colours` = 1 (clear panes) or 3.
inline BasisVolume compact_volume(int colours) {
  BasisVolume volume = plain_volume();
  volume.partition = *SkyPartition::fine(16);
  volume.stored_region.clear();
  volume.basis.clear();
  auto basis = std::make_shared<CompactBasis>();
  FirstLight& light = basis->light;
  light.colours = static_cast<std::uint32_t>(colours);
  light.first_block = {0};
  for (int c = 0; c < colours; ++c) {
    light.scale.insert(light.scale.end(), {1.0f, 0.5f, 2.0f, 0.25f});
    light.block.insert(light.block.end(), {0, 0, 1, 1}); // of rows 0, 2, 2 and 3
    for (const std::uint32_t blocks : {1u, 0u, 2u, 1u})
      light.first_block.push_back(light.first_block.back() + blocks);
    for (const std::size_t lit : {3, 1, 7, 2})
      for (std::size_t k = 0; k < FirstLight::kBlock; ++k)
        light.weight.push_back(k < lit ? 0x3900 : 0);
  }
  basis->aggregate = {{1, 3}};
  basis->aggregate_weight = {0.0f, 0.75f, 0.5f, 0.0f};
  CompactFactors& nine = basis->nine;
  nine.cluster = {{7, 3, 1, 2}, {5, 4, 2, 0}};
  nine.source = {0, 4, 3, 0, 1, 2, 3};
  nine.strong.scale = {1e-9f, 5e-10f, 2.5e-10f};
  nine.weak.scale = {1e-3f, 2e-3f};
  for (std::uint32_t p = 0; p < 12; ++p)
    nine.probe.push_back(11 - p);
  fill_factors(nine);
  volume.compact = std::move(basis);
  return volume;
}

/// With l = 4 at five of the probes, or in the rows of all.
inline BasisVolume with_band4(BasisVolume volume) {
  if (!volume.compact) {
    for (const float x : volume.basis)
      volume.band4.push_back(0.25f - 2.0f * x);
    return volume;
  }
  auto basis = std::make_shared<CompactBasis>(*volume.compact);
  CompactFactors& band4 = basis->band4;
  band4.cluster = {{2, 2, 0, 1}, {3, 4, 1, 1}};
  band4.source = {4, 0, 3, 2, 1, 0};
  band4.probe = {3, 1, 10, 0, 7};
  band4.strong.scale = {2e-10f};
  band4.weak.scale = {3e-4f, 5e-4f};
  fill_factors(band4);
  volume.compact = std::move(basis);
  return volume;
}

/// Eight cells as four regions of unequal size.
inline BasisVolume rectangle_volume() {
  BasisVolume volume = grid_volume(room_with_hole().room, {2, 3, 2}, 4);
  volume.partition =
      *SkyPartition::from_rectangles({{-1.0, 0.0, 4, 0, false}, {0.0, 1.0, 4, 4, false}},
                                     {{0, 0, 1, 4}, {1, 0, 1, 2}, {1, 2, 1, 1}, {1, 3, 1, 1}}, "adaptive");
  return volume;
}

/// The middle of three probes along y between the two others.
inline BasisVolume with_interpolated_probe(BasisVolume volume) {
  volume.probes.interpolated.assign(volume.probes.size(), 0);
  volume.probes.interpolated[2] = 2;
  volume.probes.valid[2] = 0;
  return volume;
}

inline BasisVolume with_simplified_surfaces(BasisVolume volume) {
  volume.simplified = {{{0, 0, 0}, {4, 0, 0}, {4, 5, 0.01}, {0, 5, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  return volume;
}

inline std::vector<VolumeKind> volume_kinds() {
  std::vector<VolumeKind> list;
  list.push_back({"constant panes", plain_volume()});
  list.push_back({"constant panes, half floats", plain_volume(), BasisPrecision::float16});
  list.push_back({"clear glass", with_clear_glass(plain_volume())});
  list.push_back({"clear glass, half floats", with_clear_glass(plain_volume()), BasisPrecision::float16});
  list.push_back({"compact", compact_volume(1)});
  list.push_back({"compact, tinted", compact_volume(3)});
  list.push_back({"compact, clear glass", with_clear_glass(compact_volume(1))});
  list.push_back({"compact, l = 4", with_band4(compact_volume(1))});
  list.push_back({"l = 4", with_band4(plain_volume())});
  list.push_back({"l = 4, half floats", with_band4(plain_volume()), BasisPrecision::float16});
  list.push_back({"rectangles", rectangle_volume()});
  list.push_back({"rectangles, half floats", rectangle_volume(), BasisPrecision::float16});
  list.push_back({"graded", graded(plain_volume()), BasisPrecision::float16});
  list.push_back({"graded, compact", graded(with_band4(compact_volume(1)))});
  list.push_back({"interpolated probe", with_interpolated_probe(graded(compact_volume(1)))});
  list.push_back({"simplified surfaces", with_simplified_surfaces(compact_volume(1))});
  list.push_back({"graded, rectangles", graded(rectangle_volume())});
  return list;
}

inline std::uint64_t header_length(std::span<const std::uint8_t> file) {
  std::uint64_t length = 0;
  if (file.size() >= sizeof(length))
    std::memcpy(&length, file.data(), sizeof(length));
  return length;
}

/// Puts the right checksum into a file that was changed, where its header is whole enough to hold one: what somebody
/// with intent would do.
inline void sign_volume(std::span<std::uint8_t> file) {
  if (file.size() < 8 || header_length(file) > file.size() - 8)
    return;
  const std::span<const std::byte> bytes = std::as_bytes(file), head = bytes.first(8 + header_length(file));
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const std::size_t key = text.find(detail::kChecksumKey), digits = key + detail::kChecksumKey.size();
  if (key == std::string_view::npos || digits + detail::kNoChecksum.size() > text.size())
    return;
  const std::span<const std::byte> data = bytes.subspan(head.size());
  const std::string sum = detail::volume_checksum(head, digits, std::span(&data, 1));
  std::copy(sum.begin(), sum.end(), file.begin() + static_cast<std::ptrdiff_t>(digits));
}

} // namespace daylit::test
