// Ten thousand damaged volumes of every kind: refused, or read with the same content, in little memory.

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <random>

#include <gtest/gtest.h>

#include "scene/atomic_file.h"
#include "scene/detail/volume_identity.h"
#include "scene/volume_file.h"
#include "tests/scene/allocations.h"
#include "tests/scene/test_rooms.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

using Bytes = std::vector<std::uint8_t>;

BasisVolume plain_volume() { return test::grid_volume(test::room_with_hole().room, {2, 3, 2}, 5); }

/// Two bricks of different rank over the nodes of a small partition.
BasisVolume compact_volume() {
  BasisVolume volume = plain_volume();
  volume.partition = *SkyPartition::fine(16);
  volume.stored_region.clear();
  volume.basis.clear();
  auto basis = std::make_shared<CompactBasis>();
  basis->sources = 4;
  basis->light.scale = {1.0f, 0.5f, 2.0f, 0.25f};
  basis->light.first_run = {0, 1, 1, 3, 4};
  basis->light.first_weight = {0, 3, 3, 6, 8};
  basis->light.run = {{0, 3}, {2, 1}, {9, 2}, {14, 2}};
  basis->light.weight.assign(8, 0x3900);
  basis->brick = {{7, 1, 2}, {5, 2, 0}};
  for (std::uint32_t p = 0; p < 12; ++p)
    basis->probe.push_back(11 - p);
  basis->half_scale = {1.0f, 0.5f, 0.25f};
  basis->byte_scale = {0.01f, 0.02f};
  basis->source_half.assign(4 * 128, 0x3800);
  basis->source_byte.assign(4 * 128, -5);
  basis->probe_half.assign(3 * 128 * 3, 0x3555);
  basis->probe_byte.assign(3 * 128 * 2, 77);
  volume.compact = std::move(basis);
  return volume;
}

BasisVolume rectangle_volume() {
  BasisVolume volume = plain_volume();
  volume.partition = test::rectangles();
  return volume;
}

Bytes file_of(const BasisVolume& volume, BasisPrecision precision) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "damage.volume";
  const Result<void> written = write_volume(path, volume, precision);
  EXPECT_TRUE(written) << written.error().message();
  return *read_whole_file(path);
}

/// The right checksum for changed content, where the header is whole enough to hold one.
void sign(Bytes& file) {
  std::uint64_t length = 0;
  if (file.size() < 8)
    return;
  std::memcpy(&length, file.data(), sizeof(length));
  if (length > file.size() - 8)
    return;
  const std::span<const std::byte> bytes = std::as_bytes(std::span(file)), head = bytes.first(8 + length);
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const std::size_t key = text.find(detail::kChecksumKey), digits = key + detail::kChecksumKey.size();
  if (key == std::string_view::npos || digits + 16 > text.size())
    return;
  const std::span<const std::byte> data = bytes.subspan(8 + length);
  const std::string sum = detail::volume_checksum(head, digits, std::span(&data, 1));
  std::copy(sum.begin(), sum.end(), file.begin() + static_cast<std::ptrdiff_t>(digits));
}

bool same_content(const BasisVolume& a, const BasisVolume& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0;
  };
  if (!same(a.basis, b.basis) || !same(a.stored_region, b.stored_region) ||
      !same(a.probes.positions, b.probes.positions) || (a.compact == nullptr) != (b.compact == nullptr))
    return false;
  return !a.compact ||
         (same(a.compact->probe_half, b.compact->probe_half) && same(a.compact->source_byte, b.compact->source_byte) &&
          same(a.compact->probe, b.compact->probe));
}

/// Reads within twice the file, and uses what was read.
Result<BasisVolume> read_sparingly(const Bytes& file) {
  test::reset_largest_allocation();
  Result<BasisVolume> read = parse_volume(file, "damaged");
  EXPECT_LE(test::largest_allocation(), std::max<std::size_t>(2 * file.size(), 4096));
  if (read) {
    EXPECT_TRUE(check_volume(*read));
    (void)combine(*read, std::vector<Rgb>(static_cast<std::size_t>(read->partition.size()), Rgb(1)));
  }
  return read;
}

TEST(VolumeDamage, ten_thousand_damaged_files_are_refused_or_read_as_they_were) {
  std::mt19937 random(5);
  const Bytes files[] = {
      file_of(plain_volume(), BasisPrecision::float32), file_of(plain_volume(), BasisPrecision::float16),
      file_of(compact_volume(), BasisPrecision::float32), file_of(rectangle_volume(), BasisPrecision::float32)};
  int refused = 0, read_anyway = 0;
  for (const Bytes& file : files) {
    const Result<BasisVolume> whole = parse_volume(file, "whole");
    ASSERT_TRUE(whole) << whole.error().message();
    for (int i = 0; i < 1280; ++i) {
      Bytes damaged = file;
      if (i % 4 == 0)
        damaged.resize(random() % file.size());
      else
        for (int flips = 1 + i % 3; flips > 0; --flips)
          damaged[random() % file.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      const Result<BasisVolume> read = read_sparingly(damaged);
      if (read)
        ASSERT_TRUE(damaged == file || same_content(*read, *whole)) << i;
      else
        ++refused;
    }
    // Signed again, so that the content itself has to be judged: half of them in the header.
    std::uint64_t length = 0;
    std::memcpy(&length, file.data(), sizeof(length));
    for (int i = 0; i < 1280; ++i) {
      Bytes damaged = file;
      const std::size_t from = i % 2 == 0 ? 8 : 8 + length, size = i % 2 == 0 ? length : file.size() - 8 - length;
      const std::uint32_t words[] = {0xffffffffu, 0x7f800000u, 0u, 0x80000000u, 0x7fffffffu, 1u << 20, 0x39393939u};
      const std::size_t at = from + random() % (size - 4);
      if (i % 4 == 2)
        damaged[at] ^= static_cast<std::uint8_t>(1u << random() % 8);
      else
        std::memcpy(damaged.data() + at, &words[random() % 7], i % 3 == 0 ? 4 : 1);
      sign(damaged);
      (read_sparingly(damaged) ? read_anyway : refused) += 1;
    }
  }
  EXPECT_GT(refused, 6000);
  EXPECT_GT(read_anyway, 100); // numbers of the basis, text for people: any value is one
}

TEST(VolumeDamage, half_float_files_are_half_as_large_and_within_2_5e_4) {
  BasisVolume volume = test::grid_volume(test::closed_room(), {8, 8, 8}, 64);
  const Bytes full = file_of(volume, BasisPrecision::float32), half = file_of(volume, BasisPrecision::float16);
  EXPECT_LT(half.size() * 100, full.size() * 51);
  const Result<BasisVolume> read = parse_volume(half, "half");
  ASSERT_TRUE(read) << read.error().message();
  for (std::size_t k = 0; k < volume.basis.size(); ++k) // rows hold random numbers in -1..1
    ASSERT_NEAR(double(read->basis[k]), double(volume.basis[k]), 2.5e-4);
}

} // namespace
} // namespace daylit
