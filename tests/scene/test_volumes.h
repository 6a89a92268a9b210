#pragma once

// Volumes with arbitrary content for tests of what is done with volumes.

#include <random>
#include <vector>

#include <glm/common.hpp>

#include "scene/volume/probe_planes.h"
#include "scene/volume/volume.h"
#include "tests/scene/test_rooms.h"

namespace daylit::test {

/// 4 x 5 x 3 m without an opening.
inline Room closed_room() {
  RoomBuilder b;
  b.box({0, 0, 0}, {4, 5, 3}, b.material("grey"));
  return b.room;
}

inline Room room_with_table() {
  RoomBuilder b;
  b.box({0, 0, 0}, {4, 5, 3}, b.material("grey"));
  b.quad({2, 1, 0.8}, {3.5, 1, 0.8}, {3.5, 2, 0.8}, {2, 2, 0.8}, 0);
  return b.room;
}

/// Grid half a spacing from the walls of the room's box; the basis is random; the first `rows` of 64 regions stored.
inline BasisVolume grid_volume(Room room, glm::ivec3 count, int rows) {
  BasisVolume volume;
  volume.partition = *SkyPartition::uniform(64);
  const Bounds bounds = room.bounds();
  volume.room = std::move(room);
  volume.probes.is_grid = true;
  volume.probes.count = count;
  volume.probes.spacing = glm::dvec3(4, 5, 3) / glm::dvec3(count);
  volume.probes.origin = bounds.centre();
  for (int z = 0; z < count.z; ++z)
    for (int y = 0; y < count.y; ++y)
      for (int x = 0; x < count.x; ++x)
        volume.probes.positions.push_back(
            glm::vec3(volume.probes.spacing * (glm::dvec3(x, y, z) + 0.5) - glm::dvec3(2, 2.5, 1.5)));
  volume.probes.valid.assign(volume.probes.size(), 1);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
  for (int r = 0; r < rows; ++r)
    volume.stored_region.push_back(r);
  volume.basis.resize(rows * volume.row_floats());
  for (float& x : volume.basis)
    x = unit(random);
  return volume;
}

/// The same probes on planes that stand closer together towards the lower end of each axis; `by` in 0..1, 0: the
/// regular coordinates, kept as a graded grid.
inline BasisVolume graded(BasisVolume volume, double by = 0.6) {
  ProbeSet& probes = volume.probes;
  const ProbePlanes regular(probes);
  for (int k = 0; k < 3; ++k) {
    auto& planes = probes.planes[static_cast<std::size_t>(k)] = regular.along(k);
    const double first = planes.front(), length = planes.back() - first;
    for (double& x : planes)
      x -= length > 0.0 ? by * (x - first) * (planes.back() - x) / length : 0.0;
  }
  std::size_t i = 0;
  for (const double z : probes.planes[2])
    for (const double y : probes.planes[1])
      for (const double x : probes.planes[0])
        probes.positions[i++] = glm::vec3(x, y, z);
  return volume;
}

/// Seven unequal rectangles of 4 bands of 8 cells.
inline SkyPartition rectangles() {
  const std::vector<SkyBand> bands{
      {-1, -0.4, 8, 0, false}, {-0.4, 0, 8, 8, false}, {0, 0.5, 8, 16, false}, {0.5, 1, 8, 24, false}};
  return *SkyPartition::from_rectangles(
      bands, {{0, 0, 2, 8}, {2, 0, 1, 3}, {2, 3, 2, 1}, {2, 4, 1, 4}, {3, 0, 1, 1}, {3, 1, 1, 2}, {3, 4, 1, 4}},
      "rectangles");
}

inline std::vector<Rgb> random_radiance(const BasisVolume& volume, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> ten(0.0f, 10.0f);
  std::vector<Rgb> radiance(volume.partition.size());
  for (Rgb& c : radiance)
    c = {ten(random), ten(random), ten(random)};
  return radiance;
}

} // namespace daylit::test
