// Damaged volumes of every kind: refused, or read as they are, in little memory.

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "scene/core/atomic_file.h"
#include "scene/core/read_file.h"
#include "scene/volume/volume_file.h"
#include "tests/scene/allocations.h"
#include "tests/scene/volume_kinds.h"

namespace daylit {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Json = nlohmann::ordered_json;

Bytes file_of(const BasisVolume& volume, BasisPrecision precision = BasisPrecision::float32) {
  const Result<Bytes> bytes = volume_bytes(volume, precision);
  EXPECT_TRUE(bytes) << bytes.error().message();
  return *bytes;
}

/// Allocates at most twice the file (errors have a text: 4 KiB), and what is accepted can be used.
Result<BasisVolume> read_sparingly(const Bytes& file) {
  test::reset_largest_allocation();
  Result<BasisVolume> read = parse_volume(file, "damaged");
  EXPECT_LE(test::largest_allocation(), std::max<std::size_t>(2 * file.size(), 4096));
  if (read) {
    EXPECT_TRUE(check_volume(*read));
    (void)combine(*read, std::vector<Rgb>(static_cast<std::size_t>(read->partition.size()), Rgb(1)), ShOrder::fourth);
  }
  return read;
}

struct Tally {
  int refused = 0, read = 0;
  int by_checksum = 0; ///< of the refused
};

/// For content that somebody signed: any numbers may be in it, but writing and reading keeps every bit of them.
void expect_refused_or_exact(const Bytes& file, const std::string& what, Tally& tally) {
  const Result<BasisVolume> read = read_sparingly(file);
  ++(read ? tally.read : tally.refused);
  if (!read) {
    tally.by_checksum += read.error().message().find("checksum") != std::string::npos ? 1 : 0;
    return;
  }
  const Bytes again = file_of(*read);
  const Result<BasisVolume> second = parse_volume(again, "again");
  ASSERT_TRUE(second) << what;
  EXPECT_EQ(file_of(*second), again) << what;
}

TEST(VolumeDamage, every_kind_comes_back_as_it_was_written) {
  for (const test::VolumeKind& v : test::volume_kinds()) {
    const Bytes file = file_of(v.volume, v.precision);
    const Result<BasisVolume> read = parse_volume(file, v.name);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(file_of(*read, v.precision), file) << v.name;
    const std::filesystem::path path =
        std::filesystem::path(testing::TempDir()) / ("kind" + std::to_string(::getpid()) + ".volume");
    ASSERT_TRUE(write_volume(path, v.volume, v.precision));
    EXPECT_EQ(*read_whole_file(path), file) << v.name;
    test::reset_largest_allocation();
    EXPECT_TRUE(read_volume(path));
    EXPECT_LE(test::largest_allocation(), 2 * file.size()) << v.name;
    std::filesystem::remove(path);
  }
}

TEST(VolumeDamage, ten_thousand_damaged_files_of_every_kind_are_refused) {
  std::mt19937 random(5);
  Tally tally;
  for (const test::VolumeKind& v : test::volume_kinds()) {
    const Bytes file = file_of(v.volume, v.precision);
    for (int i = 0; i < 1200; ++i) {
      Bytes damaged = file;
      if (i % 4 == 0)
        damaged.resize(random() % file.size());
      else if (i % 8 == 1)
        damaged.insert(damaged.end(), 1 + random() % 200, static_cast<std::uint8_t>(random()));
      else // half of the flips hit the header, where they can do most harm
        for (int flips = 1 + i % 3; flips > 0; --flips)
          damaged[random() % (i % 2 ? file.size() : test::header_length(file))] ^=
              static_cast<std::uint8_t>(1u << random() % 8);
      const Result<BasisVolume> read = read_sparingly(damaged);
      ++(read ? tally.read : tally.refused);
      ASSERT_EQ(bool(read), damaged == file) << v.name << ", file " << i; // two flips may meet
    }
  }
  EXPECT_GE(tally.refused, 10000);
  std::printf("%d damaged files refused, %d undamaged ones read\n", tally.refused, tally.read);
}

TEST(VolumeDamage, signed_content_is_refused_or_read_as_it_is) {
  std::mt19937 random(6);
  Tally tally;
  for (const test::VolumeKind& v : test::volume_kinds()) {
    const Bytes file = file_of(v.volume, v.precision);
    const std::uint64_t length = test::header_length(file);
    for (int i = 0; i < 400; ++i) {
      Bytes damaged = file;
      const std::size_t from = i % 2 == 0 ? 8 : 8 + length, size = i % 2 == 0 ? length : file.size() - 8 - length;
      const std::uint32_t words[] = {0xffffffffu, 0x7f800000u, 0u, 0x80000000u, 0x7fffffffu, 1u << 20, 0x39393939u};
      const std::size_t at = from + random() % (size - 4);
      if (i % 4 == 2)
        damaged[at] ^= static_cast<std::uint8_t>(1u << random() % 8);
      else
        std::memcpy(damaged.data() + at, &words[random() % 7], i % 3 == 0 ? 4 : 1);
      test::sign_volume(damaged);
      expect_refused_or_exact(damaged, std::string(v.name) + ", file " + std::to_string(i), tally);
    }
  }
  EXPECT_GT(tally.refused, 1000);
  EXPECT_LT(tally.by_checksum, 10); // only where the word "checksum" itself is hit: the others are judged by content
  EXPECT_GT(tally.read, 100);       // numbers of the basis, text for people: any value is one
}

Bytes with_header(const Bytes& file, const std::string& text) {
  std::string header = text;
  header.append((64 - (header.size() + 8) % 64) % 64, ' ');
  const std::uint64_t length = header.size();
  Bytes made(8 + header.size());
  std::memcpy(made.data(), &length, 8);
  std::memcpy(made.data() + 8, header.data(), header.size());
  made.insert(made.end(), file.begin() + static_cast<std::ptrdiff_t>(8 + test::header_length(file)), file.end());
  test::sign_volume(made);
  return made;
}

/// What a hostile header may say of one tensor.
std::vector<Json> hostile_tensors(const Json& good) {
  constexpr std::uint64_t huge = ~0ull;
  const std::uint64_t begin = good["data_offsets"][0], end = good["data_offsets"][1];
  std::vector<Json> list{nullptr, 7, "text", Json::array(), Json::object(), Json::array({good})};
  const auto with = [&](const char* key, Json value) {
    list.push_back(good);
    list.back()[key] = std::move(value);
  };
  for (const char* type : {"F64", "F32", "F16", "I32", "U32", "I16", "U16", "I8", "U8", "BF16", ""})
    with("dtype", type);
  for (const Json& shape : {Json::array(), Json{0}, Json{huge}, Json{huge, huge}, Json{1ull << 32, 1ull << 32},
                            Json{1ull << 62, 4, 4}, Json{-1}, Json{1.5}, Json{"3"}, Json{Json{3}}, Json{end - begin}})
    with("shape", shape);
  for (std::size_t d = 0; d < good["shape"].size(); ++d)
    for (const int change : {-1, 1}) {
      list.push_back(good);
      list.back()["shape"][d] = good["shape"][d].get<std::int64_t>() + change;
    }
  std::vector<std::uint64_t> turned = good["shape"];
  std::ranges::reverse(turned);
  with("shape", turned);
  for (const Json& place : {Json{end, begin}, Json{begin + 1, end + 1}, Json{begin, end + 64}, Json{huge, huge},
                            Json{0, huge}, Json{begin}, Json{begin, end, end}, Json{0, end - begin}})
    with("data_offsets", place);
  with("more", Json{{"deep", Json::array({Json::object()})}});
  return list;
}

TEST(VolumeDamage, hostile_headers_are_refused_or_read_as_they_are) {
  Tally tally;
  std::set<std::string> attacked; // each tensor once, in the first kind that has it
  for (const test::VolumeKind& v : test::volume_kinds()) {
    const Bytes file = file_of(v.volume, v.precision);
    const Json header =
        Json::parse(file.begin() + 8, file.begin() + static_cast<std::ptrdiff_t>(8 + test::header_length(file)));
    const auto attack = [&](const Json& changed, const std::string& what) {
      expect_refused_or_exact(with_header(file, changed.dump()), v.name + (": " + what), tally);
    };
    for (const auto& [name, entry] : header.items()) {
      Json without = header;
      without.erase(name);
      attack(without, "without " + name);
      without["_padding_of_another"] = entry;
      attack(without, "other name than " + name);
      const std::string kind = name.starts_with("_padding") ? "_padding" : name + entry.value("dtype", "");
      if (name == "__metadata__" || !attacked.insert(kind).second)
        continue;
      for (const Json& hostile : hostile_tensors(entry)) {
        Json changed = header;
        changed[name] = hostile;
        attack(changed, name + " " + hostile.dump());
      }
    }
    for (const auto& [key, text] : header["__metadata__"].items())
      for (const Json& hostile : {Json(nullptr), Json(1), Json(""), Json("-1"), Json("99999999999999999999"),
                                  Json("[]"), Json(std::string(5000, '[')), Json::array(), Json{{"a", 1}}}) {
        Json changed = header;
        changed["__metadata__"][key] = hostile;
        attack(changed, key + " " + hostile.dump().substr(0, 40));
      }
    for (int version = -1; version < 8; ++version) {
      Json changed = header;
      changed["__metadata__"]["format_version"] = std::to_string(version);
      attack(changed, "version " + std::to_string(version));
    }
    const std::string text = header.dump();
    for (const std::string& other : {"[" + text + "]", text + text, text.substr(0, text.size() - 1), std::string(),
                                     std::string(100000, '{'), "{\"basis\":" + text + "}"})
      expect_refused_or_exact(with_header(file, other), other.substr(0, 20), tally);
  }
  EXPECT_GE(tally.refused, 2000);
  EXPECT_EQ(tally.by_checksum, 0);
  std::printf("%d hostile headers refused, %d harmless ones read\n", tally.refused, tally.read);
}

// Content that takes more memory than disk: each entry small in the file, large as an object.
TEST(VolumeDamage, many_nameless_materials_do_not_multiply_in_memory) {
  BasisVolume volume = test::plain_volume();
  volume.probes.positions.resize(1);
  volume.probes.valid.resize(1);
  volume.probes.is_grid = false;
  volume.stored_region.clear();
  volume.basis.clear();
  volume.room.materials.resize(200000);
  volume.room.triangles.resize(1);
  EXPECT_FALSE(read_sparingly(file_of(volume)));
}

TEST(VolumeDamage, many_bands_of_sky_do_not_multiply_in_memory) {
  std::vector<SkyBand> bands;
  for (int i = 0; i < 65537 + 65537; ++i)
    bands.push_back({i == 65537 ? 0.0 : i / 65537.0 - 1, i == 65536 ? 0.0 : (i + 1) / 65537.0 - 1, 1, i, false});
  BasisVolume volume = test::plain_volume();
  volume.partition = *SkyPartition::from_bands(std::move(bands), "bands");
  EXPECT_TRUE(read_sparingly(file_of(volume)));
}

TEST(VolumeDamage, half_float_files_are_half_as_large_and_within_2_5e_4) {
  BasisVolume volume = test::grid_volume(test::closed_room(), {8, 8, 8}, 64);
  const Bytes full = file_of(volume), half = file_of(volume, BasisPrecision::float16);
  EXPECT_LT(half.size() * 100, full.size() * 51);
  const Result<BasisVolume> read = parse_volume(half, "half");
  ASSERT_TRUE(read) << read.error().message();
  for (std::size_t k = 0; k < volume.basis.size(); ++k) // rows hold random numbers in -1..1
    ASSERT_NEAR(double(read->basis[k]), double(volume.basis[k]), 2.5e-4);
}

} // namespace
} // namespace daylit
