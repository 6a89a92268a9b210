#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>

#include "runtime/object/transfer.h"
#include "scene/core/atomic_file.h"
#include "scene/core/checksum.h"
#include "scene/core/read_file.h"

namespace daylit {

namespace {

constexpr std::uint32_t kTransferVersion = 8;
// |C_lm| <= integral max(0, n.w) |Y_lm| dw, largest for Y_20 facing the pole: below pi everywhere.
constexpr float kLargestCoefficient = 3.1416f;

constexpr std::uint32_t kCoefficients = 18; // twice nine
static_assert(sizeof(VertexTransfer) == kCoefficients * sizeof(float));

/// Little-endian file: this header, then vertices x 18 floats.
struct Header {
  char magic[8] = {'d', 'a', 'y', 'l', 'i', 't', 'T', 'V'};
  std::uint32_t version = kTransferVersion;
  std::uint32_t coefficients = kCoefficients;
  std::uint64_t vertices = 0;
  char key[16] = {};
  std::uint64_t checksum = 0; ///< XXH64 of the floats
};
static_assert(sizeof(Header) == 48);

Error malformed(const std::filesystem::path& path, const std::string& what) {
  return {ErrorCode::file_malformed, what, path.string(), "delete the file, it is computed again"};
}

} // namespace

/// Over all that the vectors follow from.
std::string transfer_key(const ObjectMesh& mesh, const TransferSettings& settings) {
  Checksum hash;
  hash.add(mesh.positions);
  hash.add(mesh.normals);
  hash.add(mesh.triangles);
  hash.add(std::vector<int>{settings.rays_per_vertex, settings.closed});
  return hash.hex();
}

/// Sizes are checked before anything is allocated, numbers before they are used.
Result<std::vector<VertexTransfer>> parse_transfer(std::span<const std::uint8_t> bytes,
                                                   const std::filesystem::path& path, const std::string& key,
                                                   std::size_t vertices) {
  if (bytes.size() < sizeof(Header) || bytes.size() - sizeof(Header) != vertices * sizeof(VertexTransfer))
    return malformed(path, "the size does not fit the object");
  Header header, reference;
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (std::memcmp(header.magic, reference.magic, sizeof(header.magic)) != 0)
    return malformed(path, "not a transfer file");
  if (header.version != kTransferVersion)
    return Error{ErrorCode::file_version, "transfer file of another version", path.string(), "delete the file"};
  if (header.coefficients != kCoefficients || header.vertices != vertices ||
      key != std::string(header.key, sizeof(header.key)))
    return malformed(path, "belongs to another object");
  Checksum hash;
  hash.add(std::as_bytes(bytes.subspan(sizeof(header))));
  if (hash.digest() != header.checksum)
    return malformed(path, "wrong checksum");
  std::vector<VertexTransfer> transfer(vertices);
  if (vertices > 0)
    std::memcpy(transfer.data(), bytes.data() + sizeof(header), vertices * sizeof(VertexTransfer));
  for (const VertexTransfer& t : transfer)
    for (const TransferVector* side : {&t.front, &t.back})
      for (const float c : *side)
        if (!(std::fabs(c) <= kLargestCoefficient))
          return malformed(path, "a coefficient is out of range");
  return transfer;
}

Result<std::vector<VertexTransfer>> read_transfer(const std::filesystem::path& path, const std::string& key,
                                                  std::size_t vertices) {
  const auto bytes = read_whole_file(path, sizeof(Header) + vertices * sizeof(VertexTransfer));
  if (!bytes)
    return bytes.error();
  return parse_transfer(*bytes, path, key, vertices);
}

Result<void> write_transfer(const std::filesystem::path& path, const std::string& key,
                            const std::vector<VertexTransfer>& transfer) {
  Header header;
  header.vertices = transfer.size();
  std::memcpy(header.key, key.data(), std::min(key.size(), sizeof(header.key)));
  Checksum hash;
  hash.add(transfer);
  header.checksum = hash.digest();
  const std::span<const std::byte> parts[] = {std::as_bytes(std::span(&header, 1)),
                                              std::as_bytes(std::span<const VertexTransfer>(transfer))};
  return write_file_atomically(path, parts);
}

/// A file that is damaged or belongs to another object is computed again and written over.
Result<CachedTransfer> cached_transfer(const ObjectMesh& mesh, const std::filesystem::path& folder,
                                       const std::string& model_stem, const TransferSettings& settings,
                                       const Progress& progress) {
  const std::string key = transfer_key(mesh, settings);
  const std::filesystem::path path = folder / (model_stem + "-" + key + ".transfer");
  CachedTransfer result;
  auto stored = read_transfer(path, key, mesh.positions.size());
  if (stored) {
    result.transfer = std::move(*stored);
    result.from_cache = true;
    return result;
  }
  if (stored.error().code != ErrorCode::file_missing)
    result.note = stored.error().message();
  auto computed = compute_transfer(mesh, settings, progress);
  if (!computed)
    return computed.error();
  result.transfer = std::move(*computed);
  if (const auto written = write_transfer(path, key, result.transfer); !written)
    result.note = "transfer vectors not cached: " + written.error().message();
  return result;
}

} // namespace daylit
