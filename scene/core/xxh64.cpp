#include "scene/core/xxh64.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace daylit::detail {

namespace {

constexpr std::uint64_t kPrime1 = 0x9E3779B185EBCA87u, kPrime2 = 0xC2B2AE3D27D4EB4Fu, kPrime3 = 0x165667B19E3779F9u,
                        kPrime4 = 0x85EBCA77C2B2AE63u, kPrime5 = 0x27D4EB2F165667C5u;
static_assert(std::endian::native == std::endian::little, "volume files and their checksum are little-endian");

template <class Word>
Word load(const std::byte* p) {
  Word word;
  std::memcpy(&word, p, sizeof(word));
  return word;
}

std::uint64_t round(std::uint64_t lane, std::uint64_t word) { return std::rotl(lane + word * kPrime2, 31) * kPrime1; }

} // namespace

void Xxh64::stripes(const std::byte* p, std::size_t count) {
  // Local: bytes may alias the members, and the four chains must stay in registers.
  std::array<std::uint64_t, 4> lane = lane_;
  for (; count > 0; --count, p += 32)
    for (std::size_t k = 0; k < 4; ++k)
      lane[k] = round(lane[k], load<std::uint64_t>(p + 8 * k));
  lane_ = lane;
}

void Xxh64::add(std::span<const std::byte> bytes) {
  total_ += bytes.size();
  if (buffered_ > 0) {
    const std::size_t taken = std::min(bytes.size(), buffer_.size() - buffered_);
    std::copy_n(bytes.begin(), taken, buffer_.begin() + static_cast<std::ptrdiff_t>(buffered_));
    buffered_ += taken;
    bytes = bytes.subspan(taken);
    if (buffered_ < buffer_.size())
      return;
    stripes(buffer_.data(), 1);
    buffered_ = 0;
  }
  stripes(bytes.data(), bytes.size() / 32);
  buffered_ = bytes.size() % 32;
  std::copy_n(bytes.end() - static_cast<std::ptrdiff_t>(buffered_), buffered_, buffer_.begin());
}

std::uint64_t Xxh64::digest() const {
  std::uint64_t hash = kPrime5;
  if (total_ >= 32) {
    hash = std::rotl(lane_[0], 1) + std::rotl(lane_[1], 7) + std::rotl(lane_[2], 12) + std::rotl(lane_[3], 18);
    for (const std::uint64_t lane : lane_)
      hash = (hash ^ round(0, lane)) * kPrime1 + kPrime4;
  }
  hash += total_;
  const std::byte* p = buffer_.data();
  std::size_t left = buffered_;
  for (; left >= 8; left -= 8, p += 8)
    hash = std::rotl(hash ^ round(0, load<std::uint64_t>(p)), 27) * kPrime1 + kPrime4;
  if (left >= 4) {
    hash = std::rotl(hash ^ (load<std::uint32_t>(p) * kPrime1), 23) * kPrime2 + kPrime3;
    left -= 4;
    p += 4;
  }
  for (; left > 0; --left, ++p)
    hash = std::rotl(hash ^ (std::to_integer<std::uint64_t>(*p) * kPrime5), 11) * kPrime1;
  hash = (hash ^ (hash >> 33)) * kPrime2;
  hash = (hash ^ (hash >> 29)) * kPrime3;
  return hash ^ (hash >> 32);
}

} // namespace daylit::detail
