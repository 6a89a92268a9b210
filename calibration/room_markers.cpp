#include "calibration/room_markers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/core.hpp>

#include "calibration/room_marker_fit.h"
#include "calibration/rotation_match.h"
#include "capture/markers/marker_pose.h"

namespace daylit::calibration {

namespace {

using namespace room_markers;

constexpr std::size_t kMostPairs = 10; ///< markers of a photograph whose second pose is tried, too

std::size_t surface_named(const std::string& name) {
  const auto found = std::ranges::find_if(kSurfaces, [&](const Surface& s) { return name == s.name; });
  return static_cast<std::size_t>(found - kSurfaces.begin());
}

/// Where the surfaces face in the room and in the camera's frame; bit i of `choice`: the second pose of marker i. Empty
/// where a marker has none.
std::vector<std::array<glm::dvec3, 2>> facing(const std::vector<Sighting*>& seen, const std::vector<Marker>& markers,
                                              std::size_t choice) {
  std::vector<std::array<glm::dvec3, 2>> pairs;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const std::size_t which = i < kMostPairs ? choice >> i & 1 : 0;
    if (which >= seen[i]->camera_from_marker.size())
      return {};
    pairs.push_back(
        {kSurfaces[markers[seen[i]->marker].surface].normal(), glm::dvec3(seen[i]->camera_from_marker[which][2])});
  }
  return pairs;
}

/// The turn of a camera from the directions that the surfaces face, of both poses of each marker those that agree best.
/// Nothing where all surfaces face along one line.
std::optional<Camera> first_turn(const std::vector<Sighting*>& seen, const std::vector<Marker>& markers) {
  const auto axis = [&](const Sighting* s) { return kSurfaces[markers[s->marker].surface].axis; };
  if (std::ranges::none_of(seen, [&](const Sighting* s) { return axis(s) != axis(seen.front()); }))
    return std::nullopt;
  double least = std::numeric_limits<double>::infinity();
  Camera best;
  std::size_t chosen = 0;
  for (std::size_t choice = 0; choice < std::size_t{1} << std::min(seen.size(), kMostPairs); ++choice) {
    const auto pairs = facing(seen, markers, choice);
    if (pairs.empty())
      continue;
    const glm::dmat3 turn = rotation_between(pairs);
    double off = 0;
    for (const auto& [room, camera] : pairs)
      off += glm::dot(room - turn * camera, room - turn * camera);
    if (off < least) {
      least = off;
      best.turn = turn;
      chosen = choice;
    }
  }
  for (std::size_t i = 0; i < std::min(seen.size(), kMostPairs); ++i)
    if (chosen >> i & 1)
      std::swap(seen[i]->camera_from_marker[0], seen[i]->camera_from_marker[1]);
  return best;
}

/// Camera positions and places of surfaces from the markers' distances: what lies on a surface, and what two cameras
/// see is in one place. False: some of it follows from nothing.
bool first_places(const std::vector<Sighting>& seen, State& s) {
  const int cameras = static_cast<int>(s.camera.size()), n = 3 * cameras + static_cast<int>(kPlaces);
  cv::Mat1d a(0, n), b(0, 1), x;
  const auto row = [&](std::initializer_list<std::pair<int, double>> terms, double right) {
    cv::Mat1d line(1, n, 0.0);
    for (const auto& [k, value] : terms)
      line(k) = value;
    a.push_back(line);
    b.push_back(cv::Mat1d(1, 1, right));
  };
  std::set<std::size_t> known;
  const auto offset = [&](const Sighting& g) {
    return s.camera[g.camera].turn * glm::dvec3(g.camera_from_marker[0][3]);
  };
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const std::size_t surface = s.marker[seen[i].marker].surface;
    const int axis = kSurfaces[surface].axis, at = 3 * static_cast<int>(seen[i].camera);
    const glm::dvec3 way = offset(seen[i]);
    known.insert(surface);
    row({{at + axis, 1.0}, {3 * cameras + static_cast<int>(surface), kSurfaces[surface].is_far ? -1.0 : 0.0}},
        -way[axis]);
    for (std::size_t j = 0; j < i; ++j)
      if (seen[j].marker == seen[i].marker) {
        const glm::dvec3 other = offset(seen[j]);
        for (int k = 0; k < 3; ++k)
          row({{at + k, 1.0}, {3 * static_cast<int>(seen[j].camera) + k, -1.0}}, other[k] - way[k]);
      }
  }
  for (std::size_t k = 0; k < kPlaces; ++k)
    if (!kSurfaces[k].is_far || !known.contains(k))
      row({{3 * cameras + static_cast<int>(k), 1.0}}, 0.0);
  cv::Mat1d values;
  cv::SVD::compute(a, values);
  if (values(values.rows - 1) < 1e-6 * values(0) || !cv::solve(a, b, x, cv::DECOMP_SVD))
    return false;
  for (int c = 0; c < cameras; ++c)
    s.camera[static_cast<std::size_t>(c)].position = {x(3 * c), x(3 * c + 1), x(3 * c + 2)};
  for (std::size_t k = 0; k < kPlaces; ++k)
    s.place[k] = x(3 * cameras + static_cast<int>(k));
  return true;
}

void first_markers(const std::vector<Sighting>& seen, State& s) {
  for (const Sighting& g : seen) { // of several sightings the last
    Marker& m = s.marker[g.marker];
    const Surface& surface = kSurfaces[m.surface];
    const Camera& camera = s.camera[g.camera];
    const glm::dvec3 middle = camera.position + camera.turn * glm::dvec3(g.camera_from_marker[0][3]),
                     right = camera.turn * glm::dvec3(g.camera_from_marker[0][0]);
    m.place = {glm::dot(middle, surface.u), glm::dot(middle, surface.v)};
    m.turn = std::atan2(glm::dot(right, surface.v), glm::dot(right, surface.u));
  }
}

/// The poses that each marker of a photograph allows by itself.
std::vector<Sighting> sightings_in(const RoomPhotograph& photograph, const RoomMarkers& markers, const LensModel& lens,
                                   std::size_t camera, std::map<int, std::size_t>& number) {
  std::vector<Sighting> all;
  for (const SeenMarker& one : photograph.seen) {
    if (!markers.on.contains(one.id))
      continue;
    const auto pose =
        marker_pose({one}, lens, BoardLayout::single(markers.dictionary, one.id, markers.side_m), glm::dmat4(1.0));
    if (!pose)
      continue;
    Sighting s{camera, number.emplace(one.id, number.size()).first->second, one.corner_px, {}};
    s.camera_from_marker.push_back(glm::inverse(pose->world_from_camera));
    if (std::isfinite(pose->second_rms_px))
      s.camera_from_marker.push_back(glm::inverse(pose->second_world_from_camera));
    all.push_back(std::move(s));
  }
  return all;
}

Error not_tied(const std::string& what, const std::string& hint) { return {ErrorCode::not_found, what, "room", hint}; }

/// The surfaces that a room cannot do without and that no marker was seen on.
std::vector<std::string> missing_surfaces(const State& s) {
  std::vector<std::string> missing;
  for (const char* name : {"floor", "x0", "x1", "y0", "y1"})
    if (std::ranges::none_of(s.marker, [&](const Marker& m) { return kSurfaces[m.surface].name == std::string(name); }))
      missing.emplace_back(name);
  return missing;
}

void describe(const Fit& fit, const State& s, const std::array<double, kPlaces>& variance, MeasuredRoom& room) {
  std::map<int, std::pair<double, int>> sums;
  double all = 0;
  for (const Sighting& seen : fit.sightings()) {
    auto& [sum, count] = sums[s.marker[seen.marker].id];
    for (const double r : fit.residual(s, seen))
      sum += r * r, all += r * r;
    count += 4;
  }
  const double sightings = static_cast<double>(fit.sightings().size());
  room.rms_px = std::sqrt(all / (4.0 * sightings));
  // Of one coordinate, from what more than the unknowns is known.
  const double spare = 8.0 * sightings - static_cast<double>(6 * s.camera.size() + 3 * s.marker.size() + kPlaces),
               noise_px = std::sqrt(all / std::max(spare, 1.0));
  for (const auto& [id, sum] : sums)
    room.marker_rms_px[id] = std::sqrt(sum.first / sum.second);
  for (std::size_t k = 0; k < s.marker.size(); ++k) {
    const Marker& m = s.marker[k];
    for (std::size_t c = 0; c < 4; ++c)
      room.corner_m[m.id][c] = corner_in_room(s, k, fit.corners()[c]);
    if (!kSurfaces[m.surface].is_far)
      continue;
    room.place_m[kSurfaces[m.surface].name] = s.place[m.surface];
    room.sigma_m[kSurfaces[m.surface].name] = noise_px * std::sqrt(variance[m.surface]);
  }
}

} // namespace

Result<MeasuredRoom> measure_room(const RoomMarkers& markers, const LensModel& lens,
                                  std::span<const RoomPhotograph> photographs) {
  MeasuredRoom room;
  State state;
  std::map<int, std::size_t> number;
  std::vector<Sighting> all;
  for (const RoomPhotograph& photograph : photographs) {
    std::map<int, std::size_t> then = number;
    auto seen = sightings_in(photograph, markers, lens, state.camera.size(), then);
    std::vector<Marker> known(then.size());
    for (const auto& [id, k] : then)
      known[k] = {id, surface_named(markers.on.at(id)), glm::dvec2(0.0), 0.0};
    std::vector<Sighting*> each;
    for (Sighting& s : seen)
      each.push_back(&s);
    const auto camera = seen.size() < 2 ? std::nullopt : first_turn(each, known);
    if (!camera) {
      room.dropped.push_back({photograph.file, "shows no markers on two surfaces that meet at an angle"});
      continue;
    }
    number = std::move(then);
    state.marker = std::move(known);
    state.camera.push_back(*camera);
    room.used.push_back(photograph.file);
    all.insert(all.end(), seen.begin(), seen.end());
  }
  if (const auto missing = missing_surfaces(state); !missing.empty())
    return not_tied(fmt::format("no photograph that counts shows a marker on {}", fmt::join(missing, ", ")),
                    "let each photograph show markers on two surfaces at least, and all of them each surface");
  if (!first_places(all, state))
    return not_tied("the photographs do not hang together",
                    "let neighbouring photographs show one marker in common at least");
  first_markers(all, state);
  const Fit fit(lens, markers.side_m, std::move(all));
  const auto variance = fit.refine(state);
  describe(fit, state, variance, room);
  return room;
}

} // namespace daylit::calibration
