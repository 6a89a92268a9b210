#include "simulate/trace_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include "scene/material/fresnel.h"
#include "scene/room/aperture.h"
#include "scene/room/declared_gloss.h"

namespace daylit {

const std::array<std::uint8_t, 6> kMarker23 = {0b100110, 0b100101, 0b001111, 0b011001, 0b110011, 0b110011};

namespace {

constexpr int kCells = 8; // six and the border

constexpr float kFar = std::numeric_limits<float>::max();

struct TriangleList {
  std::vector<glm::dvec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  glm::vec3 unit_normal(std::size_t t) const {
    const glm::dvec3 a = vertices[triangles[t][0]];
    return glm::vec3(glm::normalize(glm::cross(vertices[triangles[t][1]] - a, vertices[triangles[t][2]] - a)));
  }
};

constexpr int kMostFaces = 64; // of transparent objects on one straight way; more let nothing through

/// Its reflectance says all.
bool is_plain(const ObjectMaterial& m) {
  return !m.is_glossy() && m.emission == Rgb(0.0f) && !m.normal_texture && !m.occlusion_texture;
}

glm::vec3 facing(const glm::vec3& normal, const glm::vec3& direction) {
  return glm::dot(normal, direction) > 0.0f ? -normal : normal;
}

} // namespace

MarkerBoard MarkerBoard::printed(const MarkerConfig& marker) {
  MarkerBoard board;
  board.world_from_board = marker.world_from_board;
  board.marker_size_m = marker.size_m;
  board.margin_m = 0.25 * marker.size_m;
  board.white_reflectance = static_cast<float>(marker.white_reflectance);
  return board;
}

std::array<glm::dvec3, 4> MarkerBoard::corners() const {
  const double h = half_side_m();
  const auto world = [this](double x, double y) { return glm::dvec3(world_from_board * glm::dvec4(x, y, 0.0, 1.0)); };
  return {world(-h, -h), world(h, -h), world(h, h), world(-h, h)};
}

Rgb MarkerBoard::reflectance(const glm::dvec3& world_point) const {
  const glm::dvec3 d = world_point - glm::dvec3(world_from_board[3]);
  const double x = glm::dot(d, glm::dvec3(world_from_board[0])), y = glm::dot(d, glm::dvec3(world_from_board[1]));
  const int column = static_cast<int>(std::floor((x / marker_size_m + 0.5) * kCells));
  const int row = static_cast<int>(std::floor((0.5 - y / marker_size_m) * kCells));
  if (column < 0 || row < 0 || column >= kCells || row >= kCells)
    return Rgb(white_reflectance);
  const bool inside = column > 0 && row > 0 && column < kCells - 1 && row < kCells - 1;
  const bool white = inside && ((kMarker23[static_cast<std::size_t>(row - 1)] >> (kCells - 2 - column)) & 1) != 0;
  return Rgb(white ? white_reflectance : black_reflectance);
}

Result<TraceScene> TraceScene::make(const Room& room, const std::vector<Aperture>& apertures, const SkyLight& sky,
                                    const ObjectMesh* object, const glm::dmat4& world_from_object,
                                    const std::optional<MarkerBoard>& board) {
  if (object && object->triangles.empty())
    return Error{ErrorCode::geometry_invalid, "the object has no triangle", "object", ""};
  TriangleList list;
  std::vector<RoomSurface> room_surface;
  list.vertices = room.vertices;
  for (const RoomTriangle& t : room.triangles) {
    if (room.is_window(t))
      continue;
    list.triangles.push_back(t.vertex);
    room_surface.push_back({list.unit_normal(list.triangles.size() - 1), room.material(t).reflectance, false});
  }
  if (board) {
    const auto first = static_cast<std::uint32_t>(list.vertices.size());
    for (const glm::dvec3& corner : board->corners())
      list.vertices.push_back(corner);
    for (const std::array<std::uint32_t, 3> t : {std::array<std::uint32_t, 3>{0, 1, 2}, {0, 2, 3}}) {
      list.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      room_surface.push_back({list.unit_normal(list.triangles.size() - 1), Rgb(0.0f), true});
    }
  }
  // Both ray scenes get all vertices, so that they share one origin and one set of rounded coordinates.
  const auto first_object_vertex = static_cast<std::uint32_t>(list.vertices.size());
  if (object)
    for (const glm::vec3& p : object->positions)
      list.vertices.emplace_back(world_from_object * glm::dvec4(glm::dvec3(p), 1.0));

  auto rays = RayScene::build(list.vertices, list.triangles);
  if (!rays)
    return rays.error();
  TraceScene scene(apertures, rays->origin(), sky);
  scene.room_ = *std::move(rays);
  scene.room_surface_ = std::move(room_surface);
  scene.board_ = board;
  if (object)
    if (const auto placed = scene.place_object(*object, world_from_object, list.vertices, first_object_vertex); !placed)
      return placed.error();
  return scene;
}

Result<TraceScene> TraceScene::of_room(const Room& room, const SkyLight& sky, const ObjectMesh* object,
                                       const glm::dmat4& world_from_object, const std::optional<MarkerBoard>& board,
                                       std::vector<std::string>* notes) {
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const auto apertures = find_apertures(room, *rays);
  if (!apertures)
    return apertures.error();
  if (notes)
    *notes = apertures->report.notes;
  return make(room, apertures->list, sky, object, world_from_object, board);
}

Result<void> TraceScene::place_object(const ObjectMesh& object, const glm::dmat4& world_from_object,
                                      const std::vector<glm::dvec3>& vertices, std::uint32_t first_vertex) {
  TriangleList list{vertices, {}};
  for (const auto& t : object.triangles)
    list.triangles.push_back({first_vertex + t[0], first_vertex + t[1], first_vertex + t[2]});
  auto rays = RayScene::build(list.vertices, list.triangles);
  if (!rays)
    return rays.error();
  object_ = *std::move(rays);
  mesh_ = std::make_shared<const ObjectMesh>(object);
  const glm::dmat3 normal_matrix = glm::transpose(glm::inverse(glm::dmat3(world_from_object)));
  world_from_mesh_ = glm::mat3(world_from_object);
  normal_matrix_ = glm::mat3(normal_matrix);
  has_textures_ = !object.textures.empty() || !object.colours.empty();
  for (const glm::vec3& n : object.normals)
    object_normal_.push_back(glm::vec3(glm::normalize(normal_matrix * glm::dvec3(n))));
  Bounds box;
  for (std::size_t t = 0; t < list.triangles.size(); ++t) {
    const ObjectMaterial* material = object.material_or_null(t);
    object_surface_.push_back(
        {list.unit_normal(t), !material || is_plain(*material), material && material->is_transparent()});
    has_transparent_ |= object_surface_.back().transparent;
    for (const std::uint32_t v : list.triangles[t])
      box.include(list.vertices[v]);
  }
  const glm::vec3 margin(4.0f * surface_offset());
  object_min_ = to_local(box.min) - margin;
  object_max_ = to_local(box.max) + margin;
  return {};
}

Result<void> TraceScene::declare_glossy(const Room& room, const std::map<std::string, double>& glossy) {
  const auto declared = declared_gloss(room, glossy);
  if (!declared)
    return declared.error();
  std::size_t surface = 0;
  for (std::size_t t = 0; t < room.triangles.size(); ++t)
    if (!room.is_window(room.triangles[t]))
      room_surface_[surface++].mirrored = (*declared)[t];
  return {};
}

bool TraceScene::may_hit_object(const glm::vec3& origin, const glm::vec3& direction, float distance) const {
  float enter = 0.0f, leave = distance;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(direction[k]) < 1e-12f) {
      if (origin[k] < object_min_[k] || origin[k] > object_max_[k])
        return false;
      continue;
    }
    const float inverse = 1.0f / direction[k];
    const float a = (object_min_[k] - origin[k]) * inverse, b = (object_max_[k] - origin[k]) * inverse;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

/// How far an object may be to come before the room, seen from a point `ahead` of where the ray meets the room from:
/// that far from there lies the plane of the room's face, and an offset behind it counts as on it.
float TraceScene::room_limit(const RayHit& hit, const glm::vec3& ahead, const glm::vec3& direction) const {
  constexpr float kGrazing = 0.01f;
  if (!has_transparent_)
    return hit.distance;
  const glm::vec3 normal = facing(room_surface_[hit.triangle].normal, direction);
  const float along = std::max(-glm::dot(direction, normal), kGrazing);
  return std::max(hit.distance + (glm::dot(ahead, normal) + surface_offset()) / along, 0.0f);
}

std::optional<SurfacePoint> TraceScene::closest(const glm::vec3& origin, const glm::vec3& direction, bool with_object,
                                                bool& touched) const {
  return closest(origin, origin, direction, with_object, touched);
}

std::optional<SurfacePoint> TraceScene::closest(const glm::vec3& room_origin, const glm::vec3& origin,
                                                const glm::vec3& direction, bool with_object, bool& touched) const {
  RayHit hit;
  const bool hit_room = room_.closest(room_origin, direction, 0.0f, kFar, hit);
  const float limit = hit_room ? room_limit(hit, origin - room_origin, direction) : kFar;
  if (with_object && object_ && may_hit_object(origin, direction, limit)) {
    RayHit object_hit;
    if (object_->closest(origin, direction, 0.0f, limit, object_hit)) {
      touched = true;
      return object_point(origin, direction, object_hit);
    }
  }
  if (!hit_room)
    return std::nullopt;
  return room_point(room_origin, direction, hit);
}

bool TraceScene::occluded(const glm::vec3& origin, const glm::vec3& direction, float distance, bool with_object,
                          bool& touched) const {
  if (room_.occluded(origin, direction, 0.0f, distance))
    return true;
  if (!with_object || !object_ || !may_hit_object(origin, direction, distance) ||
      !object_->occluded(origin, direction, 0.0f, distance))
    return false;
  touched = true;
  return true;
}

/// What a face of the object lets through straight: transmission, colour and 1 - F, as seen from outside on both sides
/// (a pane bends light back), and exp(-a d) of what lies inside, from `from` on.
Rgb TraceScene::straight(const RayHit& hit, const glm::vec3& direction, float from) const {
  const ObjectSurface& s = object_surface_[hit.triangle];
  if (!s.transparent)
    return Rgb(0.0f);
  const SurfaceMaterial m = surface_look(*mesh_, hit.triangle, hit.u, hit.v, 0.0f).material;
  const float cosine = glm::dot(s.normal, direction);
  const Rgb face =
      (1.0f - m.metallic) * m.transmission * (1.0f - fresnel_dielectric(std::abs(cosine), m.ior)) * m.base_colour;
  return cosine > 0.0f && !m.thin ? face * glm::exp(-m.absorption_per_m * (hit.distance - from)) : face;
}

/// Follows a ray through transparent faces of the object; true where one stops it.
bool TraceScene::stopped(const glm::vec3& origin, const glm::vec3& direction, float distance, Rgb& through,
                         RayHit& hit) const {
  float from = 0.0f, near = 0.0f;
  for (int face = 0; face < kMostFaces; ++face) {
    if (!object_->closest(origin, direction, near, distance, hit))
      return false;
    const Rgb left = straight(hit, direction, from);
    if (left == Rgb(0.0f))
      return true;
    through *= left;
    from = hit.distance;
    near = hit.distance * (1.0f + 0x1p-20f) + surface_offset();
  }
  return true;
}

std::optional<SurfacePoint> TraceScene::closest_opaque(const glm::vec3& origin, const glm::vec3& direction,
                                                       bool with_object, bool& touched, Rgb& through) const {
  if (!has_transparent_ || !with_object)
    return closest(origin, direction, with_object, touched);
  RayHit hit, object_hit;
  const bool hit_room = room_.closest(origin, direction, 0.0f, kFar, hit);
  const float limit = hit_room ? hit.distance : kFar;
  if (may_hit_object(origin, direction, limit)) {
    const Rgb before = through;
    const bool stop = stopped(origin, direction, limit, through, object_hit);
    touched |= stop || through != before;
    if (stop)
      return object_point(origin, direction, object_hit);
  }
  return hit_room ? std::optional(room_point(origin, direction, hit)) : std::nullopt;
}

Rgb TraceScene::transmittance(const glm::vec3& origin, const glm::vec3& direction, float distance, bool with_object,
                              bool& touched) const {
  if (!has_transparent_ || !with_object)
    return Rgb(occluded(origin, direction, distance, with_object, touched) ? 0.0f : 1.0f);
  Rgb through(1.0f);
  RayHit hit;
  if (room_.occluded(origin, direction, 0.0f, distance))
    return Rgb(0.0f);
  if (!may_hit_object(origin, direction, distance))
    return through;
  const bool stop = stopped(origin, direction, distance, through, hit);
  touched |= stop || through != Rgb(1.0f);
  return stop ? Rgb(0.0f) : through;
}

SurfaceLook TraceScene::room_look(const SurfacePoint& point) const {
  const RoomSurface& s = room_surface_[point.triangle];
  SurfaceMaterial material;
  material.base_colour = point.reflectance;
  material.alpha_u = material.alpha_v = kLeastAlpha;
  material.ior = ior_of(s.mirrored);
  return {material, s.normal, around_axis(s.normal)};
}

SurfaceLook TraceScene::look(const SurfacePoint& point) const {
  if (!point.on_object)
    return room_look(point);
  SurfaceLook look = surface_look(*mesh_, point.triangle, point.u, point.v, 0.0f);
  look.normal = glm::normalize(normal_matrix_ * look.normal);
  if (glm::dot(look.normal, object_surface_[point.triangle].normal) < 0.0f)
    look.normal = -look.normal;
  const glm::vec3 t = world_from_mesh_ * look.tangent;
  look.tangent = glm::normalize(t - glm::dot(t, look.normal) * look.normal);
  return look;
}

SurfacePoint TraceScene::room_point(const glm::vec3& origin, const glm::vec3& direction, const RayHit& hit) const {
  const RoomSurface& s = room_surface_[hit.triangle];
  SurfacePoint point;
  point.position = origin + hit.distance * direction;
  point.geometric_normal = point.normal = facing(s.normal, direction);
  point.reflectance = s.is_board ? board_->reflectance(origin_ + glm::dvec3(point.position)) : s.reflectance;
  point.distance = hit.distance;
  point.plain = s.mirrored == 0.0f;
  point.outside = glm::dot(s.normal, direction) < 0.0f;
  point.triangle = hit.triangle;
  return point;
}

SurfacePoint TraceScene::object_point(const glm::vec3& origin, const glm::vec3& direction, const RayHit& hit) const {
  const ObjectSurface& s = object_surface_[hit.triangle];
  const auto& t = mesh_->triangles[hit.triangle];
  const float w = 1.0f - hit.u - hit.v;
  SurfacePoint point;
  point.position = origin + hit.distance * direction;
  point.geometric_normal = facing(s.normal, direction);
  const glm::vec3 smooth = w * object_normal_[t[0]] + hit.u * object_normal_[t[1]] + hit.v * object_normal_[t[2]];
  const float length = glm::length(smooth);
  point.normal = length > 1e-6f ? smooth / length : point.geometric_normal;
  if (glm::dot(point.normal, point.geometric_normal) < 0.0f)
    point.normal = -point.normal;
  point.distance = hit.distance;
  point.on_object = true;
  point.plain = s.plain;
  point.outside = glm::dot(s.normal, direction) < 0.0f;
  point.triangle = hit.triangle;
  point.u = hit.u;
  point.v = hit.v;
  if (s.plain) {
    const std::vector<Rgb>& reflectance = mesh_->reflectance;
    point.reflectance = has_textures_ ? base_colour(*mesh_, hit.triangle, hit.u, hit.v, 0.0f)
                                      : w * reflectance[t[0]] + hit.u * reflectance[t[1]] + hit.v * reflectance[t[2]];
  }
  return point;
}

} // namespace daylit
