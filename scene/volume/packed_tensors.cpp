#include "scene/volume/packed_tensors.h"

#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include "scene/core/parallel.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kSmall = 65536; ///< bytes, below which a tensor stays as it is
constexpr double kWorthIt = 0.9;      ///< of them, at most

/// Empty where it does not pay, or where a reader would refuse it. Factors of a few bits are little but entropy: a
/// longer search for repeated strings takes two to four times as long for 0 to 4 % fewer bytes.
std::vector<std::byte> packed(std::span<const std::byte> bytes) {
  uLongf size = compressBound(bytes.size());
  std::vector<std::byte> stream(size);
  if (compress2(reinterpret_cast<Bytef*>(stream.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                bytes.size(), Z_BEST_SPEED) != Z_OK ||
      static_cast<double>(size) > kWorthIt * static_cast<double>(bytes.size()) || size * kMostPacked < bytes.size())
    return {};
  stream.resize(size);
  stream.shrink_to_fit();
  return stream;
}

} // namespace

std::string pack_tensors(std::vector<TensorToWrite>& tensors, std::vector<std::vector<std::byte>>& streams) {
  streams.resize(tensors.size());
  parallel_for(std::size_t{0}, tensors.size(), [&](std::size_t i) {
    if (tensors[i].bytes.size() >= kSmall)
      streams[i] = packed(tensors[i].bytes);
  });
  std::string text;
  for (std::size_t i = 0; i < tensors.size(); ++i)
    if (TensorToWrite& t = tensors[i]; !streams[i].empty()) {
      text += fmt::format("{} {} {}\n", t.name, t.dtype, fmt::join(t.shape, " "));
      t = {t.name, "U8", {streams[i].size()}, streams[i]};
    }
  return text;
}

std::map<std::string, TensorEntry> packed_tensors(const std::string& text,
                                                  const std::map<std::string, TensorEntry>& tensors) {
  std::map<std::string, TensorEntry> list;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, dtype;
    words >> name >> dtype;
    const auto stream = tensors.find(name);
    if (stream == tensors.end() || stream->second.dtype != "U8")
      return {};
    TensorEntry entry{dtype, {}, stream->second.begin, stream->second.end};
    double bytes = static_cast<double>(dtype_bytes(dtype)); // of numbers below 2^64: no overflow
    for (std::uint64_t d; words >> d; entry.shape.push_back(d))
      bytes *= static_cast<double>(d);
    if (bytes > static_cast<double>(kMostPacked * (entry.end - entry.begin)))
      return {};
    list[name] = std::move(entry);
  }
  return list;
}

bool unpack(std::span<const std::uint8_t> stream, std::span<std::byte> bytes) {
  uLongf size = bytes.size();
  uLong used = stream.size();
  return uncompress2(reinterpret_cast<Bytef*>(bytes.data()), &size, stream.data(), &used) == Z_OK &&
         size == bytes.size() && used == stream.size();
}

} // namespace daylit::detail
