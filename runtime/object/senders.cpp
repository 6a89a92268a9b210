#include "runtime/object/senders.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <unordered_map>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit {

namespace {

// Of the longest side:
constexpr float kCells = 40.0f, kFootCells = 160.0f; // along it,
constexpr float kCoarsest = 10.0f;                   // at least
constexpr float kFoot = 0.04f;                       // height of the foot
constexpr float kLying = 0.002f;                     // nearer to the floor, what faces it is seen by nothing else
constexpr float kFacesFloor = -0.9f;                 // cosine
constexpr std::size_t kMostAtFoot = 4096;            // senders: coarser cells where there are more

struct Box {
  glm::vec3 low{std::numeric_limits<float>::infinity()};
  float longest_side = 1e-9f;
};

Box box_of(const std::vector<glm::vec3>& positions) {
  Box box;
  glm::vec3 high = -box.low;
  for (const glm::vec3& p : positions) {
    box.low = glm::min(box.low, p);
    high = glm::max(high, p);
  }
  for (int axis = 0; axis < 3; ++axis)
    box.longest_side = std::max(box.longest_side, high[axis] - box.low[axis]);
  return box;
}

/// Per vertex: it is at the foot.
std::vector<std::uint8_t> foot_of(const ObjectMesh& mesh, const glm::vec3& up, float longest_side) {
  float lowest = std::numeric_limits<float>::infinity();
  for (const glm::vec3& p : mesh.positions)
    lowest = std::min(lowest, glm::dot(up, p));
  std::vector<std::uint8_t> foot(mesh.positions.size());
  for (std::size_t v = 0; v < foot.size(); ++v) {
    const float height = (glm::dot(up, mesh.positions[v]) - lowest) / longest_side;
    foot[v] = height < kFoot && !(height < kLying && glm::dot(up, mesh.normals[v]) < kFacesFloor);
  }
  return foot;
}

/// Which cell and octant a vertex lies in; `cells`: along the longest side, at most 256.
std::uint32_t key_of(const ObjectMesh& mesh, std::size_t v, const Box& box, float cells) {
  const glm::vec3 cell = glm::floor(cells / box.longest_side * (mesh.positions[v] - box.low)), &n = mesh.normals[v];
  std::uint32_t key = (n.x < 0.0f ? 1u : 0u) + (n.y < 0.0f ? 2u : 0u) + (n.z < 0.0f ? 4u : 0u);
  for (int axis = 0; axis < 3; ++axis)
    key = key << 8 | static_cast<std::uint32_t>(cell[axis]);
  return key;
}

/// From `finest` on the half, and so on down to `coarsest`, until no more than `most` cells have vertices of the foot
/// in them, or of the rest.
float cells_for(const ObjectMesh& mesh, const std::vector<std::uint8_t>& foot, bool of_foot, const Box& box,
                float finest, float coarsest, std::size_t most) {
  for (float cells = finest; cells > coarsest; cells /= 2.0f) {
    std::vector<std::uint32_t> keys;
    for (std::size_t v = 0; v < foot.size(); ++v)
      if ((foot[v] != 0) == of_foot)
        keys.push_back(key_of(mesh, v, box, cells));
    std::ranges::sort(keys);
    keys.erase(std::ranges::unique(keys).begin(), keys.end());
    if (keys.size() <= most)
      return cells;
  }
  return coarsest;
}

} // namespace

MeshSenders find_senders(const ObjectMesh& mesh, const glm::vec3& up, std::size_t most) {
  MeshSenders senders;
  senders.of.resize(mesh.positions.size());
  if (senders.of.size() <= most) {
    std::iota(senders.of.begin(), senders.of.end(), 0u);
    senders.vertex = senders.of;
    return senders;
  }
  const Box box = box_of(mesh.positions);
  senders.at_foot = foot_of(mesh, up, box.longest_side);
  const float fine = cells_for(mesh, senders.at_foot, true, box, kFootCells, kCells, std::min(kMostAtFoot, most));
  if (fine == kCells)
    std::ranges::fill(senders.at_foot, std::uint8_t{0}); // too large a foot: as elsewhere
  const float coarse = cells_for(mesh, senders.at_foot, false, box, kCells, kCoarsest, most);
  std::unordered_map<std::uint64_t, std::uint32_t> first;
  for (std::uint32_t v = 0; v < senders.of.size(); ++v) {
    const std::uint64_t foot = senders.at_foot[v];
    const std::uint64_t key = foot << 32 | key_of(mesh, v, box, foot != 0 ? fine : coarse);
    const auto [known, made] = first.emplace(key, static_cast<std::uint32_t>(senders.vertex.size()));
    if (made)
      senders.vertex.push_back(v);
    senders.of[v] = known->second;
  }
  return senders;
}

} // namespace daylit
