#include "runtime/gl/scene_buffers.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include "runtime/indirect/room_planes.h"

namespace daylit {

namespace {

constexpr std::size_t kMostTriangles = (1u << 24) - 1; // numbers that a float holds exactly

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& v) {
  return std::as_bytes(std::span<const T>(v));
}

} // namespace

Result<RoomBuffers> RoomBuffers::make(const Gl& gl, const Room& room, std::span<const Aperture> apertures,
                                      const glm::dvec3& origin) {
  RoomBuffers b;
  const RoomPlanes room_planes(room);
  for (std::uint32_t i = 0; i < room.triangles.size(); ++i) {
    const RoomTriangle& t = room.triangles[i];
    const glm::dvec3 n = area_normal(room, t);
    if (room.is_window(t) || !(glm::length(n) > 0.0))
      continue;
    const glm::dvec3 unit = glm::normalize(n);
    for (int k = 0; k < 3; ++k)
      b.corners_.emplace_back(room.corner(t, k) - origin);
    b.plane_of_.emplace_back(glm::vec3(unit), static_cast<float>(-glm::dot(unit, room.corner(t, 0) - origin)));
    b.plane_number_.push_back(static_cast<int>(room_planes.facing_of(i, glm::dvec3(0.0)) / 2 + 1));
    b.source_.push_back(i);
  }
  if (b.source_.size() > kMostTriangles)
    return Error{ErrorCode::limit_exceeded, std::to_string(b.source_.size()) + " triangles are too many to draw",
                 "room", "at most " + std::to_string(kMostTriangles) + ": simplify the room"};
  for (const std::uint32_t i : occluding_triangles(room, apertures)) {
    const auto first = static_cast<std::uint32_t>(b.occluder_corners_.size());
    for (int k = 0; k < 3; ++k)
      b.occluder_corners_.emplace_back(room.corner(room.triangles[i], k) - origin);
    b.occluder_triangles_.push_back({first, first + 1, first + 2});
  }
  b.vertices_ = make_buffer(gl, bytes_of(b.corners_), GL_STATIC_DRAW);
  b.occluder_vertices_ = make_buffer(gl, bytes_of(b.occluder_corners_), GL_STATIC_DRAW);
  b.array_ = make_vertex_array(gl, {{b.vertices_.name(), {3}}}, 0);
  b.occluder_array_ = make_vertex_array(gl, {{b.occluder_vertices_.name(), {3}}}, 0);
  return b;
}

std::vector<std::array<std::uint32_t, 3>> RoomBuffers::that_may_hide(std::span<const glm::vec3> points,
                                                                     const glm::vec3& eye, float tolerance) const {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 0; i < plane_of_.size(); ++i) {
    const glm::vec3 n(plane_of_[i]);
    const float side = glm::dot(n, eye) + plane_of_[i].w < 0.0f ? -1.0f : 1.0f;
    if (std::any_of(points.begin(), points.end(),
                    [&](const glm::vec3& p) { return side * (glm::dot(n, p) + plane_of_[i].w) < -tolerance; }))
      triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return triangles;
}

void RoomBuffers::draw(const Gl& gl) const {
  gl->BindVertexArray(array_.name());
  gl->DrawArrays(GL_TRIANGLES, 0, 3 * count());
}

ShadowCaster RoomBuffers::occluder(const BoundingSphere& sphere, double half_depth) {
  around_sphere_ = occluder_corners_;
  for (glm::vec3& p : around_sphere_)
    p -= glm::vec3(sphere.centre);
  return {occluder_array_.name(),
          3 * occluders(),
          false,
          {around_sphere_, occluder_triangles_, static_cast<float>(sphere.radius), static_cast<float>(half_depth), 0}};
}

Result<void> ObjectBuffers::set(const Gl& gl, const ObjectSurface& objects, const glm::dvec3& origin) {
  if (objects.triangles.size() > kMostTriangles)
    return Error{ErrorCode::limit_exceeded,
                 std::to_string(objects.triangles.size()) + " triangles are too many to draw", "objects",
                 "at most " + std::to_string(kMostTriangles) + ": simplify the mesh"};
  const BoundingSphere world = objects.bounds();
  sphere_ = {world.centre - origin, std::max(world.radius, 1e-6)};
  triangles_ = objects.triangles;
  positions_.clear();
  std::vector<glm::vec3> vertices; // position, normal, reflectance
  vertices.reserve(3 * objects.positions.size());
  for (std::size_t i = 0; i < objects.positions.size(); ++i) {
    positions_.emplace_back(objects.positions[i] - world.centre);
    vertices.emplace_back(objects.positions[i] - origin);
    vertices.push_back(objects.normals[i]);
    vertices.push_back(objects.reflectance[i]);
  }
  vertices_ = make_buffer(gl, bytes_of(vertices));
  indices_ = make_buffer(gl, bytes_of(triangles_));
  const std::vector<VertexLight> dark(positions_.size());
  light_ = make_buffer(gl, bytes_of(dark));
  array_ = make_vertex_array(gl, {{vertices_.name(), {3, 3, 3}}}, indices_.name());
  struct List {
    GlTexture* texture;
    const GlBuffer* buffer;
    GLenum format;
    std::size_t texels;
  };
  for (const List& list : {List{&triangle_list_, &indices_, GL_RGB32UI, triangles_.size()},
                           {&vertex_list_, &vertices_, GL_RGB32F, vertices.size()},
                           {&light_list_, &light_, GL_RGB32F, 4 * dark.size()}}) {
    auto made = make_buffer_texture(gl, *list.buffer, list.format, list.texels, "the objects");
    if (!made)
      return made.error();
    *list.texture = std::move(*made);
  }
  return check_gl(*gl, "uploading objects");
}

Result<void> ObjectBuffers::set_light(const Gl& gl, std::span<const VertexLight> light) {
  if (light.size() != positions_.size())
    return Error{ErrorCode::value_invalid,
                 "light for " + std::to_string(light.size()) + " vertices, the objects have " +
                     std::to_string(positions_.size()),
                 "renderer", "set the objects first"};
  refill_buffer(gl, light_, std::as_bytes(light));
  return check_gl(*gl, "uploading vertex light");
}

void ObjectBuffers::draw(const Gl& gl) const {
  gl->BindVertexArray(array_.name());
  gl->DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * triangles_.size()), GL_UNSIGNED_INT, nullptr);
}

void ObjectBuffers::bind(const Gl& gl) const {
  gl->BindTextureUnit(4, triangle_list_.name());
  gl->BindTextureUnit(5, vertex_list_.name());
}

ShadowCaster ObjectBuffers::caster() const {
  const float radius = static_cast<float>(sphere_.radius);
  return {array_.name(), static_cast<int>(3 * triangles_.size()), true, {positions_, triangles_, radius, radius, 0}};
}

} // namespace daylit
