// Large tensors of a volume are packed in its file, come back bit for bit, and do not multiply in memory.

#include <algorithm>
#include <random>
#include <string_view>

#include <gtest/gtest.h>

#include "scene/volume/packed_tensors.h"
#include "scene/volume/volume_file.h"
#include "tests/scene/allocations.h"
#include "tests/scene/volume_kinds.h"

namespace daylit {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Strings = std::vector<std::byte>;

/// The last cluster has two components of 16 bits; of so many sources they are large enough to be packed.
BasisVolume wide_volume(bool all_zero) {
  BasisVolume volume = test::compact_volume(1);
  CompactBasis basis = *volume.compact;
  CompactFactors& f = basis.nine;
  constexpr std::uint32_t kMore = 300000;
  f.source.insert(f.source.end(), kMore, f.source.back());
  f.strong.source_factor.resize(f.strong.source_factor.size() + f.cluster.back().strong * kMore, 0);
  f.cluster.back().sources += kMore;
  std::mt19937 random(7);
  for (std::size_t k = 0; !all_zero && k < f.strong.source_factor.size(); ++k)
    f.strong.source_factor[k] = static_cast<std::int16_t>(random() % 11);
  volume.compact = std::make_shared<const CompactBasis>(std::move(basis));
  return volume;
}

std::size_t factor_bytes(const BasisVolume& volume) { return 2 * volume.compact->nine.strong.source_factor.size(); }

TEST(PackedTensors, large_ones_are_packed_and_return_bit_for_bit) {
  const BasisVolume volume = wide_volume(false);
  const Bytes file = *volume_bytes(volume);
  EXPECT_LT(file.size(), 1.5 * double(factor_bytes(volume))) << "the sources, all one number, take as much again";
  const Result<BasisVolume> read = parse_volume(file, "packed");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->compact->nine.strong.source_factor, volume.compact->nine.strong.source_factor);
  EXPECT_EQ(read->compact->nine.source, volume.compact->nine.source);
  EXPECT_EQ(*volume_bytes(*read), file);
}

TEST(PackedTensors, what_would_unpack_to_far_more_than_its_file_stays_as_it_is) {
  const BasisVolume volume = wide_volume(true);
  const Bytes file = *volume_bytes(volume);
  EXPECT_GT(file.size(), 2 * factor_bytes(volume));
  EXPECT_TRUE(parse_volume(file, "zeros"));
}

TEST(PackedTensors, damage_that_somebody_signed_is_refused_or_read_in_bounded_memory) {
  const Bytes file = *volume_bytes(wide_volume(false));
  const std::string_view line = "compact.strong.source_factor I16 ";
  const auto text = std::ranges::search(file, line);
  ASSERT_FALSE(text.empty());
  const std::size_t digit = static_cast<std::size_t>(text.end() - file.begin()), data = 8 + test::header_length(file);
  int refused = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    Bytes damaged = file;
    if (i < 8)
      damaged[digit + i % 4] = i < 4 ? '9' : ' ';
    else
      damaged[data + i * (file.size() - data) / 300] ^= static_cast<std::uint8_t>(1u << i % 8);
    test::sign_volume(damaged);
    test::reset_largest_allocation();
    refused += parse_volume(damaged, "damaged") ? 0 : 1;
    EXPECT_LE(test::largest_allocation(), detail::kMostPacked * file.size());
  }
  EXPECT_GT(refused, 200);
}

TEST(PackedTensors, a_stream_of_another_length_is_no_tensor) {
  std::mt19937 random(7);
  Strings zeros(100000), eleven(100000);
  for (std::byte& x : eleven)
    x = static_cast<std::byte>(random() % 11);
  std::vector<detail::TensorToWrite> tensors{{"a", "U8", {100000}, eleven}, {"b", "F32", {25000}, zeros}};
  std::vector<Strings> streams;
  EXPECT_EQ(detail::pack_tensors(tensors, streams), "a U8 100000\n");
  const std::span stream(reinterpret_cast<const std::uint8_t*>(streams[0].data()), streams[0].size());
  Strings exact(100000), shorter(99999), longer(100001);
  EXPECT_TRUE(detail::unpack(stream, exact));
  EXPECT_EQ(exact, eleven);
  EXPECT_FALSE(detail::unpack(stream, shorter));
  EXPECT_FALSE(detail::unpack(stream, longer));
  EXPECT_FALSE(detail::unpack(stream.first(stream.size() - 1), exact));
}

} // namespace
} // namespace daylit
