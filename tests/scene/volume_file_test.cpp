#include "scene/volume/volume_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <limits>

#include <gtest/gtest.h>

#include "scene/core/atomic_file.h"
#include "scene/core/checksum.h"
#include "scene/core/read_file.h"
#include "tests/scene/volume_kinds.h"

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

TEST(VolumeFile, refractive_indices_are_written_where_glass_is_clear) {
  BasisVolume volume = sample_volume();
  const auto says = [](const std::vector<std::uint8_t>& file, const std::string& text) {
    return std::search(file.begin(), file.end(), text.begin(), text.end()) != file.end();
  };
  const std::vector<std::uint8_t> constant = file_of(volume, "constant.volume");
  EXPECT_FALSE(says(constant, "refractive_index"));
  volume.room.materials.back().refractive_index = 1.52f;
  volume.apertures[1].refractive_index = 1.52f;
  const std::vector<std::uint8_t> glass = file_of(volume, "glass.volume");
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

TEST(VolumeFile, unequal_regions_return) {
  BasisVolume volume = sample_volume();
  volume.partition = test::rectangles();
  volume.stored_region = {0, 1, 2, 4, 6};
  const std::vector<std::uint8_t> file = file_of(volume, "rectangles.volume");
  const Result<BasisVolume> read = parse_volume(file, "rectangles");
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->partition.size(), volume.partition.size());
  for (int r = 0; r < volume.partition.size(); ++r)
    EXPECT_EQ(read->partition.centre(r), volume.partition.centre(r));
  EXPECT_EQ(file_of(*read, "rectangles2.volume"), file);
}

TEST(VolumeFile, simplified_surfaces_return_and_name_vertices_that_exist) {
  BasisVolume volume = test::with_simplified_surfaces(sample_volume());
  const Result<BasisVolume> read = parse_volume(file_of(volume, "simplified.volume"), "simplified");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->simplified.vertices, volume.simplified.vertices);
  EXPECT_EQ(read->simplified.triangles, volume.simplified.triangles);
  volume.simplified.triangles[1][2] = 4;
  EXPECT_FALSE(check_volume(volume));
  volume.simplified.triangles[1][2] = 3;
  volume.simplified.vertices[0].x = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(check_volume(volume));
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

TEST(VolumeFile, other_versions_are_refused_in_one_line) {
  const std::vector<std::uint8_t> file = file_of(sample_volume(), "version.volume");
  const auto error_with = [&](const std::string& from, const std::string& to) {
    std::vector<std::uint8_t> other = file;
    replace_text(other, from, to);
    const Result<BasisVolume> read = parse_volume(other, "other.volume");
    EXPECT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::file_version);
    const std::string message = read.error().message();
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_NE(message.find("bake it again"), std::string::npos) << message;
    EXPECT_NE(message.find("reads version 2"), std::string::npos) << message;
    return message;
  };
  EXPECT_NE(error_with("\"format_version\":\"2\"", "\"format_version\":\"7\"").find("version 7"), std::string::npos);
  // All versions before this format, its own version 1 too.
  error_with("\"format\":\"daylit-volume\"", "\"format\":\"daylit.volume\"");
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
  BasisVolume volume = sample_volume();
  const std::size_t row = volume.row_floats();
  std::fill(volume.basis.begin(), volume.basis.end(), 0.0f);
  volume.basis[0] = 6.0f; // the scale of row 0
  volume.basis[1] = -3.0f;
  volume.basis[2] = 6.0f * 0x1p-24f; // the smallest half float above 0
  volume.basis[3] = 6.0f * (1.0f / 3);
  volume.basis[4 * row] = 0.5f;
  const Result<std::vector<std::uint8_t>> file = volume_bytes(volume, BasisPrecision::float16);
  ASSERT_TRUE(file);
  const Result<BasisVolume> read = parse_volume(*file, "half");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->basis[0], 6.0f);
  EXPECT_EQ(read->basis[1], -3.0f);
  EXPECT_EQ(read->basis[2], 6.0f * 0x1p-24f);
  EXPECT_NEAR(double(read->basis[3]), 2.0, 2.0 * 0x1p-12); // half of the last of eleven bits
  EXPECT_EQ(read->basis[4 * row], 0.5f);
  EXPECT_EQ(read->basis[2 * row], 0.0f); // a black row has the scale 1
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
