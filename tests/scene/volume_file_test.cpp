#include "scene/volume/volume_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <limits>

#include <gtest/gtest.h>

#include "scene/core/atomic_file.h"
#include "scene/core/checksum.h"
#include "tests/scene/volume_versions.h"

namespace daylit {
namespace {

std::filesystem::path scratch(const std::string& name) { return std::filesystem::path(testing::TempDir()) / name; }

BasisVolume sample_volume() {
  BasisVolume volume = test::grid_volume(test::room_with_hole({1e6, 0, 0}).room, {2, 3, 2}, 5);
  volume.room.materials.push_back({"window_\"süd\"", Rgb(0), Rgb(0.7f, 0.8f, 0.9f), true});
  volume.stored_region = {0, 3, 4, 17, 63};
  volume.probes.valid[2] = 0;
  volume.apertures = {{{{1, 0, 1}, {3, 0, 1}, {3, 0, 2}, {1, 0, 2}}, {0, 1, 0}, Rgb(1)},
                      {{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {0, -1, 0}, Rgb(0.5f)}};
  volume.provenance = {"0.1", "daylit-precompute room.obj -o \"a b\"", "room.obj", "0123456789abcdef",
                       "{\"t\": [1, 2]}"};
  return volume;
}

std::vector<std::uint8_t> file_of(const BasisVolume& volume, const std::string& name);

TEST(VolumeFile, refractive_indices_return_and_constant_panes_stay_version_1) {
  BasisVolume volume = sample_volume();
  const auto says = [](const std::vector<std::uint8_t>& file, const std::string& text) {
    return std::search(file.begin(), file.end(), text.begin(), text.end()) != file.end();
  };
  const std::vector<std::uint8_t> constant = file_of(volume, "constant.volume");
  EXPECT_TRUE(says(constant, "\"format_version\":\"1\""));
  EXPECT_FALSE(says(constant, "refractive_index"));
  volume.room.materials.back().refractive_index = 1.52f;
  volume.apertures[1].refractive_index = 1.52f;
  const std::vector<std::uint8_t> glass = file_of(volume, "glass.volume");
  EXPECT_TRUE(says(glass, "\"format_version\":\"2\""));
  const auto read = parse_volume(glass, "glass.volume");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->room.materials.back().refractive_index, 1.52f);
  EXPECT_EQ(read->apertures[0].refractive_index, 0.0f);
  EXPECT_EQ(read->apertures[1].refractive_index, 1.52f);
  volume.apertures[1].refractive_index = 0.5f;
  EXPECT_FALSE(check_volume(volume));
}

std::vector<std::uint8_t> file_of(const BasisVolume& volume, const std::string& name) {
  const std::filesystem::path path = scratch(name);
  const Result<void> written = write_volume(path, volume);
  EXPECT_TRUE(written) << written.error().message();
  return *read_whole_file(path);
}

void replace_text(std::vector<std::uint8_t>& file, const std::string& from, const std::string& to) {
  ASSERT_EQ(from.size(), to.size());
  const auto at = std::search(file.begin(), file.end(), from.begin(), from.end());
  ASSERT_NE(at, file.end()) << from;
  std::copy(to.begin(), to.end(), at);
  test::sign_volume(file);
}

std::uint64_t xxh64(const std::string& text) {
  Checksum hash;
  for (const char c : text) // byte by byte: the hardest way to feed a hash of 32-byte stripes
    hash.add(std::as_bytes(std::span(&c, 1)));
  return hash.digest();
}

TEST(VolumeFile, checksum_is_xxh64) {
  EXPECT_EQ(xxh64(""), 0xef46db3751d8e999u);
  EXPECT_EQ(xxh64("abc"), 0x44bc2cf5ad770999u);
  const std::string text = "Nobody inspects the spammish repetition";
  EXPECT_EQ(xxh64(text), 0xfbcea83c8a378bf1u);
  Checksum at_once;
  at_once.add(std::as_bytes(std::span(text)));
  EXPECT_EQ(at_once.digest(), xxh64(text));
}

TEST(VolumeFile, round_trip_is_bit_identical) {
  const BasisVolume volume = sample_volume();
  const std::vector<std::uint8_t> file = file_of(volume, "round.volume");
  const Result<BasisVolume> read = read_volume(scratch("round.volume"));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(std::memcmp(read->basis.data(), volume.basis.data(), volume.basis.size() * sizeof(float)), 0);
  EXPECT_EQ(read->stored_region, volume.stored_region);
  EXPECT_EQ(read->probes.positions, volume.probes.positions);
  EXPECT_EQ(read->probes.valid, volume.probes.valid);
  EXPECT_EQ(read->partition.name(), "uniform:64");
  EXPECT_EQ(read->partition.size(), 64);
  EXPECT_EQ(read->room.vertices, volume.room.vertices);
  EXPECT_EQ(read->room.materials[1].name, volume.room.materials[1].name);
  EXPECT_TRUE(read->room.materials[1].is_window);
  EXPECT_EQ(read->apertures[1].corners, volume.apertures[1].corners);
  EXPECT_EQ(read->provenance.command_line, volume.provenance.command_line);
  EXPECT_EQ(file_of(*read, "again.volume"), file);
}

TEST(VolumeFile, unequal_regions_return_as_version_5) {
  BasisVolume volume = sample_volume();
  volume.partition = test::rectangles();
  volume.stored_region = {0, 1, 2, 4, 6};
  EXPECT_EQ(volume_format_version(volume), 5);
  const std::vector<std::uint8_t> file = file_of(volume, "rectangles.volume");
  const Result<BasisVolume> read = parse_volume(file, "rectangles");
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->partition.size(), volume.partition.size());
  for (int r = 0; r < volume.partition.size(); ++r)
    EXPECT_EQ(read->partition.centre(r), volume.partition.centre(r));
  EXPECT_EQ(file_of(*read, "rectangles2.volume"), file);
}

TEST(VolumeFile, tensors_are_aligned_to_64_bytes_and_leave_no_hole) {
  const std::vector<std::uint8_t> file = file_of(sample_volume(), "aligned.volume");
  std::uint64_t length = 0;
  std::memcpy(&length, file.data(), sizeof(length));
  EXPECT_EQ((8 + length) % 64, 0u);
  EXPECT_EQ(file.size() % 64, 0u); // the reader itself refuses holes
}

TEST(VolumeFile, volume_with_free_points_and_no_light_round_trips) {
  BasisVolume volume = sample_volume();
  volume.probes.is_grid = false;
  volume.stored_region.clear();
  volume.basis.clear();
  volume.apertures.clear();
  const std::vector<std::uint8_t> file = file_of(volume, "points.volume");
  const Result<BasisVolume> read = parse_volume(file, "points");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_FALSE(read->probes.is_grid);
  EXPECT_TRUE(read->stored_region.empty());
}

TEST(VolumeFile, version_mismatch_names_its_version_and_those_that_are_read) {
  std::vector<std::uint8_t> file = file_of(sample_volume(), "version.volume");
  replace_text(file, "\"format_version\":\"1\"", "\"format_version\":\"7\"");
  const Result<BasisVolume> read = parse_volume(file, "other.volume");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::file_version);
  EXPECT_NE(read.error().message().find("version 7"), std::string::npos) << read.error().message();
  EXPECT_NE(read.error().message().find("versions 1, 2, 5, 8 and 9"), std::string::npos) << read.error().message();
}

TEST(VolumeFile, every_truncation_and_extension_is_refused) {
  const std::vector<std::uint8_t> file = file_of(sample_volume(), "cut.volume");
  for (std::size_t size = 0; size < file.size(); size += size < 4096 ? 1 : 61)
    EXPECT_FALSE(parse_volume(std::span(file).first(size), "cut")) << size;
  std::vector<std::uint8_t> longer = file;
  longer.push_back(0);
  EXPECT_FALSE(parse_volume(longer, "longer"));
}

TEST(VolumeFile, half_precision_rows_are_scaled_back) {
  // A minimal F16 file, written here by hand: the large file's basis replaced by halves and scales.
  const BasisVolume volume = sample_volume();
  std::vector<std::uint8_t> file = file_of(volume, "f32.volume");
  std::uint64_t length = 0;
  std::memcpy(&length, file.data(), sizeof(length));
  const std::size_t floats = volume.basis.size(), old_bytes = (floats * 4 + 63) / 64 * 64;
  std::string header(file.begin() + 8, file.begin() + 8 + static_cast<std::ptrdiff_t>(length));
  std::vector<std::uint16_t> halves(old_bytes / 2 - 10, 0x3c00); // 1.0
  halves[0] = 0x0001;                                            // 2^-24, subnormal
  halves[1] = 0xc000;                                            // -2
  halves[2] = 0x7bff;                                            // 65504, the largest
  const std::vector<float> scale{2.0f, 3.0f, 4.0f, 5.0f, 0.5f};
  // The halves take half of the old place, the scales follow, padding keeps every other offset.
  halves.resize(floats);
  const std::size_t half_bytes = 2 * floats, rest = old_bytes - half_bytes - 20;
  const std::string from =
      "\"basis\":{\"dtype\":\"F32\",\"shape\":[5,12,9,3],\"data_offsets\":[0," + std::to_string(4 * floats) + "]}";
  const std::size_t at = header.find(from);
  ASSERT_NE(at, std::string::npos);
  std::string to = "\"basis\":{\"dtype\":\"F16\",\"shape\":[5,12,9,3],\"data_offsets\":[0," +
                   std::to_string(half_bytes) +
                   "]},\"basis.scale\":{\"dtype\":\"F32\",\"shape\":[5],\"data_offsets\":[" +
                   std::to_string(half_bytes) + "," + std::to_string(half_bytes + 20) +
                   "]},\"_padding_x\":{\"dtype\":\"U8\",\"shape\":[" + std::to_string(4 * floats - half_bytes - 20) +
                   "],\"data_offsets\":[" + std::to_string(half_bytes + 20) + "," + std::to_string(4 * floats) + "]}";
  header.replace(at, from.size(), to);
  std::vector<std::uint8_t> made(8 + header.size());
  const std::uint64_t new_length = header.size();
  std::memcpy(made.data(), &new_length, 8);
  std::copy(header.begin(), header.end(), made.begin() + 8);
  made.insert(made.end(), file.begin() + 8 + static_cast<std::ptrdiff_t>(length), file.end());
  std::memcpy(made.data() + 8 + new_length, halves.data(), half_bytes);
  std::memcpy(made.data() + 8 + new_length + half_bytes, scale.data(), 20);
  ASSERT_GT(rest, 0u);
  test::sign_volume(made);
  const Result<BasisVolume> read = parse_volume(made, "half");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->basis[0], 2.0f * 0x1p-24f);
  EXPECT_EQ(read->basis[1], -4.0f);
  EXPECT_EQ(read->basis[2], 2.0f * 65504.0f);
  EXPECT_EQ(read->basis[3], 2.0f);
  EXPECT_EQ(read->basis[read->row_floats() * 4], 0.5f);
}

TEST(VolumeFile, volume_that_breaks_a_rule_is_not_written) {
  BasisVolume volume = sample_volume();
  volume.basis[100] = std::numeric_limits<float>::quiet_NaN();
  const std::filesystem::path path = scratch("never.volume");
  EXPECT_FALSE(write_volume(path, volume));
  EXPECT_FALSE(std::filesystem::exists(path));
  volume = sample_volume();
  volume.stored_region[1] = 64;
  EXPECT_FALSE(write_volume(path, volume));
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(VolumeFile, missing_file_and_folder_are_named) {
  for (const std::filesystem::path& path : {scratch("gone.volume"), std::filesystem::path(testing::TempDir())}) {
    const Result<BasisVolume> read = read_volume(path);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::file_missing);
    EXPECT_NE(read.error().message().find(path.string()), std::string::npos);
  }
}

} // namespace
} // namespace daylit
