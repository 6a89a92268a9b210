#include "scene/room/face_collector.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/room/polygon.h"

namespace daylit::detail {

namespace {

// A face lower than this fraction of its longest side, or than the rounding of its coordinates, has no area.
constexpr double kFlatTolerance = 1e-9, kFlatUlps = 8.0 * 2.220446049250313e-16;
constexpr double kWarpTolerance = 1e-3; // corners further than this from the face's plane are reported

/// Height of the flattest box around the outline that still counts as a surface, metres.
double flat_tolerance(std::span<const glm::dvec3> corners) {
  double largest = 0.0;
  for (const glm::dvec3& p : corners)
    largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return kFlatTolerance * extent(corners) + kFlatUlps * largest;
}

struct LessByCoordinates {
  bool operator()(const glm::dvec3& a, const glm::dvec3& b) const {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  }
};

/// Turns the polygons of a file into the triangles of a room: drops what has no area or is there twice.
class FaceCollector {
public:
  FaceCollector(const ObjText& obj, const std::string& name, Room& room, RoomReport& report)
      : obj_(obj), name_(name), room_(room), report_(report) {
    std::map<glm::dvec3, std::uint32_t, LessByCoordinates> first;
    same_position_.reserve(room.vertices.size());
    for (const glm::dvec3& v : room.vertices)
      same_position_.push_back(first.try_emplace(v, static_cast<std::uint32_t>(same_position_.size())).first->second);
  }

  Result<void> run() {
    for (const ObjFace& face : obj_.faces)
      if (const Result<void> done = add(face); !done)
        return done;
    if (warped_ > 0)
      report_.notes.push_back(
          fmt::format("{} faces are not flat: triangulated as seen along their mean normal", warped_));
    return {};
  }

private:
  Result<void> add(const ObjFace& face) {
    const std::vector<std::uint32_t> outline = distinct_corners(face);
    std::vector<glm::dvec3> corners;
    corners.reserve(outline.size());
    for (const std::uint32_t v : outline)
      corners.push_back(room_.vertices[v]);
    if (outline.size() < 3 || !has_area(corners)) {
      drop(report_.zero_area_faces, face.line);
      return {};
    }
    if (!seen_.insert(canonical(outline)).second) {
      drop(report_.duplicate_faces, face.line);
      return {};
    }
    const std::optional<TriangleList> triangles = triangulate(corners);
    if (!triangles)
      return Error{ErrorCode::geometry_invalid, "the outline of this face crosses itself",
                   name_ + (report_.counted_in_faces ? ", face " : ", line ") + std::to_string(face.line),
                   "triangulate faces on export"};
    count_warp(corners);
    for (const auto& t : *triangles)
      add_triangle({outline[t[0]], outline[t[1]], outline[t[2]]}, face, triangles->size() > 1);
    return {};
  }

  void drop(std::size_t& count, std::size_t line) {
    ++count;
    if (report_.first_dropped_line == 0)
      report_.first_dropped_line = static_cast<int>(line);
  }

  void add_triangle(const std::array<std::uint32_t, 3>& vertex, const ObjFace& face, bool part_of_polygon) {
    if (part_of_polygon && !seen_.insert(canonical({vertex.begin(), vertex.end()})).second) {
      drop(report_.duplicate_faces, face.line);
      return;
    }
    room_.triangles.push_back({vertex, face.material});
  }

  std::vector<std::uint32_t> distinct_corners(const ObjFace& face) const {
    std::vector<std::uint32_t> outline;
    for (std::uint32_t k = 0; k < face.corner_count; ++k) {
      const std::uint32_t v = obj_.corners[face.first_corner + k].vertex;
      if (outline.empty() || same_position_[outline.back()] != same_position_[v])
        outline.push_back(v);
    }
    while (outline.size() > 1 && same_position_[outline.front()] == same_position_[outline.back()])
      outline.pop_back();
    return outline;
  }

  static bool has_area(std::span<const glm::dvec3> corners) {
    const double length = extent(corners);
    return length > 0.0 && glm::length(newell_normal(corners)) / length > flat_tolerance(corners);
  }

  /// The outline as positions, starting at the smallest, in the direction of the smaller neighbour.
  std::vector<std::uint32_t> canonical(std::vector<std::uint32_t> outline) const {
    for (std::uint32_t& v : outline)
      v = same_position_[v];
    std::rotate(outline.begin(), std::min_element(outline.begin(), outline.end()), outline.end());
    if (outline[1] > outline.back())
      std::reverse(outline.begin() + 1, outline.end());
    return outline;
  }

  void count_warp(std::span<const glm::dvec3> corners) {
    const auto frame = PlaneFrame::make(corners[0], glm::normalize(newell_normal(corners)));
    double warp = 0.0;
    for (const glm::dvec3& p : corners)
      warp = std::max(warp, std::abs(frame.height(p)));
    warped_ += warp > kWarpTolerance * extent(corners) ? 1 : 0;
  }

  const ObjText& obj_;
  const std::string& name_;
  Room& room_;
  RoomReport& report_;
  std::vector<std::uint32_t> same_position_; // smallest vertex at exactly the same coordinates
  std::set<std::vector<std::uint32_t>> seen_;
  std::size_t warped_ = 0;
};

void add_summary(RoomReport& report) {
  if (report.zero_area_faces > 0)
    report.notes.push_back(fmt::format("{} faces without area dropped", report.zero_area_faces));
  if (report.duplicate_faces > 0)
    report.notes.push_back(fmt::format("{} duplicate faces dropped (faces are two-sided)", report.duplicate_faces));
}

} // namespace

Result<void> collect_faces(const ObjText& faces, const std::string& name, Room& room, RoomReport& report) {
  report.faces_read = faces.faces.size();
  if (const Result<void> done = FaceCollector(faces, name, room, report).run(); !done)
    return done;
  if (room.triangles.empty())
    return Error{ErrorCode::geometry_invalid, fmt::format("no face with an area (of {} read)", report.faces_read), name,
                 "check that the export contains the room as polygons"};
  add_summary(report);
  return {};
}

} // namespace daylit::detail
