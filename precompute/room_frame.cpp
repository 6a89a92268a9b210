#include "precompute/room_frame.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

namespace daylit::precompute {

namespace {

constexpr double kSize = 8.0, kLattice = 0x1p-22; // units

BakeOptions options_in_frame(const BakeOptions& world, const RoomFrame& frame) {
  BakeOptions local = world;
  local.facet_edge_m /= frame.unit_m;
  local.near_m /= frame.unit_m;
  // Where the grid is given the spacing only bounds the distance from the walls: the same part of every room.
  if (std::min({world.grid.x, world.grid.y, world.grid.z}) <= 0)
    local.spacing_m /= frame.unit_m;
  for (int k = 0; k < 3; ++k)
    for (ProbePlane& plane : local.near_surfaces[static_cast<std::size_t>(k)]) {
      plane.at = (plane.at - frame.origin[k]) / frame.unit_m;
      for (std::vector<Bounds>* boxes : {&plane.where, &plane.beside})
        for (Bounds& box : *boxes)
          box = {frame.to_local(box.min), frame.to_local(box.max)};
    }
  for (glm::dvec3& p : local.points)
    p = frame.to_local(p);
  if (!local.box.empty())
    local.box = {frame.to_local(world.box.min), frame.to_local(world.box.max)};
  for (std::vector<glm::dvec3>* points : {&local.receivers, &local.held_out, &local.held_out_standing})
    for (glm::dvec3& p : *points)
      p = frame.to_local(p);
  for (RoomPoints& room : local.held_out_rooms) {
    room.box = {frame.to_local(room.box.min), frame.to_local(room.box.max)};
    for (glm::dvec3& p : room.points)
      p = frame.to_local(p);
  }
  return local;
}

void report_in_world(const RoomFrame& frame, BakeReport& report) {
  report.facet_edge_m *= frame.unit_m;
  report.doubled_m2 *= frame.unit_m * frame.unit_m;
  report.mean_facet_m2 *= frame.unit_m * frame.unit_m;
  report.apertures.window_area_m2 *= frame.unit_m * frame.unit_m;
  report.apertures.hole_area_m2 *= frame.unit_m * frame.unit_m;
  for (std::vector<glm::dvec3>* points : {&report.audit.points, &report.audit.standing})
    for (glm::dvec3& p : *points)
      p = frame.to_world(p);
  for (RoomPoints& room : report.audit.rooms) {
    room.box = {frame.to_world(room.box.min), frame.to_world(room.box.max)};
    for (glm::dvec3& p : room.points)
      p = frame.to_world(p);
  }
}

void volume_in_world(const RoomFrame& frame, const RoomFile& file, const BakeOptions& options, BasisVolume& volume) {
  ProbeSet& probes = volume.probes;
  const glm::dvec3 local_origin = probes.origin;
  probes.origin = frame.to_world(local_origin);
  probes.spacing *= frame.unit_m;
  for (std::vector<double>& planes : probes.planes)
    for (double& x : planes)
      x *= frame.unit_m;
  for (std::size_t i = 0; i < probes.size(); ++i)
    probes.positions[i] = options.points.empty() ? glm::vec3(glm::dvec3(probes.positions[i]) * frame.unit_m)
                                                 : glm::vec3(options.points[i] - probes.origin); // as they were given
  for (Aperture& a : volume.apertures)
    for (glm::dvec3& c : a.corners)
      c = frame.to_world(c);
  for (std::array<glm::vec3, 3>& element : volume.elements.corner)
    for (glm::vec3& c : element)
      c = glm::vec3(glm::dvec3(c) * frame.unit_m);
  volume.room = file.room;
}

/// What the apertures of the world's room are called by: notes and errors name positions.
Result<void> name_positions(const Room& room, BakeReport& report) {
  const Result<RayScene> scene = RayScene::build(room);
  if (!scene)
    return scene.error();
  const Result<Apertures> apertures = find_apertures(room, *scene);
  if (!apertures)
    return apertures.error();
  report.apertures.notes = apertures->report.notes;
  return {};
}

/// The same refusal, with positions in the world.
Error in_world(const Error& refusal, const Room& room, BakeReport& report) {
  const Result<void> named = name_positions(room, report);
  return named ? refusal : named.error();
}

} // namespace

/// Unit: an eighth of the longest side, so that every room is eight units long.
RoomFrame RoomFrame::of(const Room& room) {
  const Bounds bounds = room.bounds();
  const glm::dvec3 size = bounds.size();
  const double longest = std::max({size.x, size.y, size.z});
  return {bounds.centre(), longest > 0.0 && std::isfinite(longest) ? longest / kSize : 1.0};
}

/// Rounded to the lattice 2^-22 of a unit: the same room elsewhere, or in other units, gives the same coordinates.
glm::dvec3 RoomFrame::snapped(const glm::dvec3& world) const {
  return kLattice * glm::round(to_local(world) / kLattice);
}

/// Corners on the lattice, vertices sorted and joined; faces without area after that are counted and left out.
Room room_in_frame(const Room& room, const RoomFrame& frame, std::size_t& collapsed) {
  const auto before = [](const glm::dvec3& a, const glm::dvec3& b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  };
  Room local;
  local.materials = room.materials;
  // One vertex per position, in one order: how a file orders or repeats its vertices changes nothing.
  for (const RoomTriangle& t : room.triangles)
    for (int k = 0; k < 3; ++k)
      local.vertices.push_back(frame.snapped(room.corner(t, k)));
  const std::vector<glm::dvec3> corners = local.vertices;
  std::ranges::sort(local.vertices, before);
  const auto repeated = std::ranges::unique(local.vertices);
  local.vertices.erase(repeated.begin(), repeated.end());
  for (std::size_t i = 0; i < room.triangles.size(); ++i) {
    RoomTriangle t = room.triangles[i];
    for (std::size_t k = 0; k < 3; ++k)
      t.vertex[k] = static_cast<std::uint32_t>(std::ranges::lower_bound(local.vertices, corners[3 * i + k], before) -
                                               local.vertices.begin());
    if (area_m2(local, t) > 0.0)
      local.triangles.push_back(t);
  }
  collapsed = room.triangles.size() - local.triangles.size();
  return local;
}

/// Bakes the room in its own frame and carries volume, report and errors back to the world.
Result<BasisVolume> bake_room(const RoomFile& file, const SkyPartition& partition, const BakeOptions& options,
                              const Progress& progress, BakeReport& report) {
  const RoomFrame frame = RoomFrame::of(file.room);
  std::size_t collapsed = 0;
  const RoomFile local{room_in_frame(file.room, frame, collapsed), file.report, file.content_hash};
  Result<BasisVolume> volume = bake(local, partition, options_in_frame(options, frame), progress, report);
  if (!volume)
    return in_world(volume.error(), file.room, report);
  if (collapsed > 0)
    report.room.notes.push_back(std::to_string(collapsed) +
                                " faces thinner than 3e-8 of the room are left out of the light transport");
  report_in_world(frame, report);
  volume_in_world(frame, file, options, *volume);
  if (!report.apertures.notes.empty())
    if (const Result<void> named = name_positions(file.room, report); !named)
      return named.error();
  return volume;
}

Result<BakeReport> count_room_bake(const RoomFile& file, const SkyPartition& partition, const BakeOptions& options) {
  const RoomFrame frame = RoomFrame::of(file.room);
  std::size_t collapsed = 0;
  const RoomFile local{room_in_frame(file.room, frame, collapsed), file.report, file.content_hash};
  Result<BakeReport> report = count_bake(local, partition, options_in_frame(options, frame));
  if (!report) {
    BakeReport none;
    return in_world(report.error(), file.room, none);
  }
  report_in_world(frame, *report);
  return report;
}

} // namespace daylit::precompute
