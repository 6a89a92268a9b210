#pragma once

// Self-shadowed transfer vectors: what part of the light arriving at an object a vertex turns into reflected radiance
// (Sloan et al. 2002; equation 5 of Grosch et al. 2007).

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/model/object_mesh.h"

namespace daylit {

/// Progress of work that nobody watches or stops.
inline const Progress kUnwatched = [](const std::string& /*stage*/, double /*fraction*/) { return true; };

/// C_lm = integral V(w) max(0, n.w) Y_lm(w) dw, l <= 2, without A_l, reflectance or 1/pi. Object frame.
using TransferVector = std::array<float, 9>;

/// Both sides of the surface at a vertex. The back is what a camera sees through the opening of a thin shell, or of a
/// sheet; it is zero where the mesh is closed.
struct VertexTransfer {
  TransferVector front{}, back{};
  bool operator==(const VertexTransfer&) const = default;
};

/// What of the cosine-weighted hemisphere the object itself hides: 1 - C_00 / (pi Y_00).
float hidden_fraction(const TransferVector& transfer);

struct TransferSettings {
  int rays_per_vertex = 256; ///< from each side; a multiple of 64, others are rounded up
  bool closed = false;       ///< nobody sees a back (is_closed()): they are not looked at
};

/// One entry per vertex. The blocked part is integrated with cosine-weighted directions and subtracted from
/// the closed form A_l Y_lm(n), so a convex object has the exact unshadowed vector. A vertex buried in another
/// part of the object (most of its rays meet dark backs of faces) is seen by nobody but is interpolated into visible
/// triangles: it takes the mean of its neighbours that are not; without such neighbours it stays as it is. RMS error of
/// 256 rays in the folds of a mesh, against 2048: 1.5 % of an unshadowed vertex, less 3 % of the vertices, which one
/// takes for buried and the other not. Errors: no ray scene; interrupted.
Result<std::vector<VertexTransfer>> compute_transfer(const ObjectMesh& mesh, const TransferSettings& settings = {},
                                                     const Progress& progress = kUnwatched);

/// XXH64 of positions, normals, triangles and settings, 16 hex digits: what a cached result belongs to.
std::string transfer_key(const ObjectMesh& mesh, const TransferSettings& settings = {});

/// The vectors that belong to `key`, from the bytes of a file; `path` only appears in errors. Error: file_malformed
/// (size, key, checksum, non-finite or impossibly large values) or file_version; never trusts a size in the file.
Result<std::vector<VertexTransfer>> parse_transfer(std::span<const std::uint8_t> bytes,
                                                   const std::filesystem::path& path, const std::string& key,
                                                   std::size_t vertices);
/// The same from disk; reads no more than the object's vectors need.
Result<std::vector<VertexTransfer>> read_transfer(const std::filesystem::path& path, const std::string& key,
                                                  std::size_t vertices);
Result<void> write_transfer(const std::filesystem::path& path, const std::string& key,
                            const std::vector<VertexTransfer>& transfer);

struct CachedTransfer {
  std::vector<VertexTransfer> transfer;
  bool from_cache = false;
  std::string note; ///< why the cache was not used or not written; empty when all went well
};

/// From "<folder>/<model stem>-<key>.transfer" when it is there and sound, computed and stored there otherwise. A file
/// that is not sound is replaced, a folder that cannot be written to costs the computation only; `note` says so.
Result<CachedTransfer> cached_transfer(const ObjectMesh& mesh, const std::filesystem::path& folder,
                                       const std::string& model_stem, const TransferSettings& settings = {},
                                       const Progress& progress = kUnwatched);

} // namespace daylit
