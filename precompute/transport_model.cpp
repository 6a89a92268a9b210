#include "precompute/transport_model.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <meshoptimizer.h>

#include "scene/core/parallel.h"

namespace daylit::precompute {

namespace {

constexpr std::size_t kMany = 8000; ///< triangles that are left as they are
constexpr std::size_t kFew = 5000;  ///< that are wanted of more
constexpr std::array kDeviations_m{0.002, 0.004, 0.008, 0.015, 0.03};
constexpr double kSeam_m = 5e-5; ///< corners closer than that are one: less than a sheet of paper

using Corners = std::vector<std::vector<unsigned>>; ///< of each material's triangles, three each

/// Corners at one place are one: a seam that gapes by a rounding, as at the last row of a surface of revolution, would
/// let light into a cushion, and its borders could not be simplified.
struct Joined {
  std::vector<glm::dvec3> vertices; ///< world metres
  std::vector<glm::vec3> local;     ///< the same from the middle of the room
  Corners corners;
};

/// Places at which a corner stands already, in cells as wide as a seam; one for a cell.
class Places {
public:
  /// Index in `places` of the first found within a seam of `v` or in its cell; if there is none, `v` is added to them.
  unsigned index(std::vector<glm::dvec3>& places, const glm::dvec3& v) {
    const Cell cell = cell_of(v);
    for (int k = 0; k < 27; ++k) {
      const auto at = cells_.find({cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1});
      if (at != cells_.end() && (at->first == cell || glm::distance(places[at->second], v) <= kSeam_m))
        return at->second;
    }
    places.push_back(v);
    return cells_[cell] = static_cast<unsigned>(places.size() - 1);
  }

private:
  using Cell = std::array<std::int64_t, 3>;
  static Cell cell_of(const glm::dvec3& v) {
    const glm::i64vec3 cell(glm::floor(v / kSeam_m));
    return {cell.x, cell.y, cell.z};
  }

  std::map<Cell, unsigned> cells_;
};

Joined join_corners(const Room& room) {
  Joined joined;
  const glm::dvec3 middle = room.bounds().centre();
  Places places;
  std::vector<unsigned> joined_to;
  for (const glm::dvec3& v : room.vertices)
    joined_to.push_back(places.index(joined.vertices, v));
  for (const glm::dvec3& v : joined.vertices)
    joined.local.emplace_back(v - middle);
  joined.corners.resize(room.materials.size());
  for (const RoomTriangle& t : room.triangles)
    for (const std::uint32_t v : t.vertex)
      joined.corners[t.material].push_back(joined_to[v]);
  return joined;
}

std::vector<unsigned> collapsed(const Joined& joined, const std::vector<unsigned>& corners, double deviation_m,
                                unsigned options) {
  if (corners.empty())
    return {};
  std::vector<unsigned> out(corners.size());
  const float* positions = &joined.local.front().x;
  const float scale = meshopt_simplifyScale(positions, joined.local.size(), sizeof(glm::vec3));
  out.resize(meshopt_simplify(out.data(), corners.data(), corners.size(), positions, joined.local.size(),
                              sizeof(glm::vec3), 0, static_cast<float>(deviation_m) / scale, options, nullptr));
  return out;
}

Room with_triangles(const Room& room, const Joined& joined, const Corners& corners) {
  Room out{joined.vertices, {}, room.materials};
  for (std::uint32_t m = 0; m < corners.size(); ++m)
    for (std::size_t k = 0; k + 2 < corners[m].size(); k += 3) {
      const RoomTriangle t{{corners[m][k], corners[m][k + 1], corners[m][k + 2]}, m};
      if (area_m2(out, t) > 0.0)
        out.triangles.push_back(t);
    }
  return out;
}

} // namespace

Result<RoomFile> transport_model(RoomFile& file) {
  const Room& room = file.room;
  if (room.triangles.size() <= kMany)
    return file;
  const Joined joined = join_corners(room);
  Corners corners(joined.corners.size());
  std::size_t left = 0;
  for (const unsigned options : {static_cast<unsigned>(meshopt_SimplifyLockBorder), 0u})
    for (const double deviation_m : kDeviations_m) {
      parallel_for(std::size_t{0}, corners.size(), [&](std::size_t m) {
        corners[m] = room.materials[m].is_window ? joined.corners[m]
                                                 : collapsed(joined, joined.corners[m], deviation_m, options);
      });
      left = 0;
      for (const auto& c : corners)
        left += c.size() / 3;
      if (left > kFew)
        continue;
      file.report.notes.push_back(fmt::format(
          "{} triangles: light is exchanged between {}, of surfaces that moved by up to {:.0f} mm, which the stated "
          "errors do not see",
          room.triangles.size(), left, 1e3 * deviation_m));
      return RoomFile{with_triangles(room, joined, corners), file.report, file.content_hash};
    }
  return Error{ErrorCode::limit_exceeded,
               fmt::format("{} triangles, of which {} are left where surfaces move by {:.0f} mm", room.triangles.size(),
                           left, 1e3 * kDeviations_m.back()),
               "room", fmt::format("reduce the model to {} triangles", kMany)};
}

ReflectingSurfaces simplified_surfaces(const RoomFile& model, const RoomFile& file) {
  ReflectingSurfaces surfaces;
  if (model.room.triangles.size() == file.room.triangles.size())
    return surfaces;
  std::map<std::uint32_t, std::uint32_t> used; // of the vertices, by their place among all
  const auto place = [&](std::uint32_t v) {
    const auto [at, is_new] = used.try_emplace(v, static_cast<std::uint32_t>(used.size()));
    if (is_new)
      surfaces.vertices.push_back(model.room.vertices[v]);
    return at->second;
  };
  for (const RoomTriangle& t : model.room.triangles)
    if (!model.room.material(t).is_window)
      surfaces.triangles.push_back({place(t.vertex[0]), place(t.vertex[1]), place(t.vertex[2])});
  return surfaces;
}

} // namespace daylit::precompute
