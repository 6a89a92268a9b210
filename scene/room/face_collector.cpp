#include "scene/room/face_collector.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/room/polygon.h"

namespace daylit::detail {

namespace {

// A face lower than this fraction of its longest side, or than the rounding of its coordinates, has no area.
constexpr double kFlatTolerance = 1e-9, kFlatUlps = 8.0 * 2.220446049250313e-16;
constexpr std::size_t kMostNamed = 5;   // of the faces that are dropped
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
    add_dropped("faces without area dropped:", report_.zero_area_faces, flat_);
    add_dropped("duplicate faces dropped (faces are two-sided):", report_.duplicate_faces, doubled_);
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
      if (++report_.zero_area_faces <= kMostNamed)
        flat_ += fmt::format("{}{}", flat_.empty() ? " " : ", ", place(face.line));
      return {};
    }
    const Result<bool> is_new = note_outline(outline, face);
    if (!is_new || !*is_new)
      return is_new ? Result<void>{} : is_new.error();
    const std::optional<TriangleList> triangles = triangulate(corners);
    if (!triangles)
      return Error{ErrorCode::geometry_invalid, "the outline of this face crosses itself",
                   name_ + ", " + place(face.line), "triangulate faces on export"};
    count_warp(corners);
    for (const auto& t : *triangles)
      if (const Result<void> done =
              add_triangle({outline[t[0]], outline[t[1]], outline[t[2]]}, face, triangles->size() > 1);
          !done)
        return done;
    return {};
  }

  Result<void> add_triangle(const std::array<std::uint32_t, 3>& vertex, const ObjFace& face, bool part_of_polygon) {
    const Result<bool> is_new =
        part_of_polygon ? note_outline({vertex.begin(), vertex.end()}, face) : Result<bool>(true);
    if (!is_new)
      return is_new.error();
    if (*is_new)
      room_.triangles.push_back({vertex, face.material});
    return {};
  }

  /// False for an outline that was there before. Error: it was of another material.
  Result<bool> note_outline(const std::vector<std::uint32_t>& outline, const ObjFace& face) {
    const auto [entry, is_new] = seen_.try_emplace(canonical(outline), &face);
    if (is_new)
      return true;
    const ObjFace& first = *entry->second;
    const Material &a = room_.materials[first.material], &b = room_.materials[face.material];
    if (!same_for_light(a, b))
      return Error{ErrorCode::geometry_invalid,
                   fmt::format("the same face twice, of material \"{}\" and of \"{}\"", a.name, b.name),
                   fmt::format("{}, {} and {}", name_, place(first.line), place(face.line)),
                   a.is_window != b.is_window ? "cut the wall open where the window is" : "delete one of them"};
    if (++report_.duplicate_faces <= kMostNamed)
      doubled_ += fmt::format("{}{} (\"{}\", as {})", doubled_.empty() ? " " : ", ", place(face.line), b.name,
                              place(first.line));
    return false;
  }

  void add_dropped(const char* what, std::size_t count, const std::string& named) {
    if (count > 0)
      report_.notes.push_back(fmt::format("{} {}{}{}", count, what, named,
                                          count > kMostNamed ? fmt::format(", {} more", count - kMostNamed) : ""));
  }

  std::string place(int line) const { return fmt::format("{} {}", report_.counted_in_faces ? "face" : "line", line); }

  static bool same_for_light(const Material& a, const Material& b) {
    return a.is_window == b.is_window &&
           (a.is_window ? a.transmittance == b.transmittance && a.refractive_index == b.refractive_index
                        : a.reflectance == b.reflectance);
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
  std::map<std::vector<std::uint32_t>, const ObjFace*> seen_;
  std::size_t warped_ = 0;
  std::string flat_, doubled_; // the first ones of what is dropped
};

} // namespace

Result<void> collect_faces(const ObjText& faces, const std::string& name, Room& room, RoomReport& report) {
  report.faces_read = faces.faces.size();
  if (const Result<void> done = FaceCollector(faces, name, room, report).run(); !done)
    return done;
  if (room.triangles.empty())
    return Error{ErrorCode::geometry_invalid, fmt::format("no face with an area (of {} read)", report.faces_read), name,
                 "check that the export contains the room as polygons"};
  return {};
}

} // namespace daylit::detail
