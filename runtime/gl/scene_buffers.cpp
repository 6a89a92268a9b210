#include "runtime/gl/scene_buffers.h"

#include <algorithm>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr std::size_t kMostTriangles = (1u << 24) - 1; // ids that a float holds exactly

// Bindings of the shaders' lists.
constexpr GLuint kLights = 0, kPortals = 1, kPlanes = 2, kRoomPlanes = 3, kObjectTriangles = 4, kObjectVertices = 5,
                 kObjectLight = 6;

template <class Range>
std::span<const std::byte> bytes_of(const Range& values) {
  return std::as_bytes(std::span(values));
}

Error too_many_triangles(std::size_t count, const char* of) {
  return {ErrorCode::limit_exceeded, std::to_string(count) + " triangles are too many to draw", of,
          "at most " + std::to_string(kMostTriangles) + ": simplify the mesh"};
}

void bind_list(const Gl& gl, GLuint binding, const GlBuffer& buffer) {
  gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer.name());
}

} // namespace

Result<ShadowMaps> ShadowMaps::make(const Gl& gl, int texels) {
  ShadowMaps maps;
  maps.gl_ = gl;
  maps.texels_ = texels;
  maps.framebuffer_ = make_framebuffer(gl);
  gl->NamedFramebufferDrawBuffer(maps.framebuffer_.name(), GL_NONE);
  gl->NamedFramebufferReadBuffer(maps.framebuffer_.name(), GL_NONE);
  if (const auto allocated = maps.allocate(1); !allocated)
    return allocated.error();
  return maps;
}

Result<void> ShadowMaps::allocate(int layers) {
  texture_ = make_texture(gl_, GL_TEXTURE_2D_ARRAY);
  // A quantum is small beside a texel, by which receivers are lifted.
  gl_->TextureStorage3D(texture_.name(), 1, GL_DEPTH_COMPONENT16, texels_, texels_, layers);
  const std::pair<GLenum, GLenum> parameters[] = {{GL_TEXTURE_MIN_FILTER, GL_LINEAR},
                                                  {GL_TEXTURE_MAG_FILTER, GL_LINEAR},
                                                  {GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE},
                                                  {GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE},
                                                  {GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE},
                                                  {GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL}};
  for (const auto& [name, value] : parameters)
    gl_->TextureParameteri(texture_.name(), name, static_cast<GLint>(value));
  layers_ = layers;
  gl_->NamedFramebufferTextureLayer(framebuffer_.name(), GL_DEPTH_ATTACHMENT, texture_.name(), 0, 0);
  return check_framebuffer(gl_, framebuffer_, "shadow maps");
}

Result<void> ShadowMaps::draw(const GlProgram& program, const ShadowCaster& caster, std::span<const PortalLight> lights,
                              float half_depth) {
  if (static_cast<int>(lights.size()) > layers_)
    if (const auto allocated = allocate(static_cast<int>(lights.size())); !allocated)
      return allocated;
  const GLint toward = gl_->GetUniformLocation(program.name(), "toward_light");
  gl_->ProgramUniform1f(program.name(), gl_->GetUniformLocation(program.name(), "half_depth"), half_depth);
  gl_->BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_->Viewport(0, 0, texels_, texels_);
  gl_->UseProgram(program.name());
  gl_->BindVertexArray(caster.vertex_array);
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_LESS);
  gl_->DepthMask(GL_TRUE);
  constexpr float kFarthest = 1.0f;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    gl_->NamedFramebufferTextureLayer(framebuffer_.name(), GL_DEPTH_ATTACHMENT, texture_.name(), 0,
                                      static_cast<GLint>(k));
    gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &kFarthest);
    gl_->ProgramUniform3fv(program.name(), toward, 1, &lights[k].direction.x);
    if (caster.indexed)
      gl_->DrawElements(GL_TRIANGLES, caster.vertices, GL_UNSIGNED_INT, nullptr);
    else if (caster.vertices > 0)
      gl_->DrawArrays(GL_TRIANGLES, 0, caster.vertices);
  }
  return check_gl(*gl_, "shadow maps");
}

Result<RoomBuffers> RoomBuffers::make(const Gl& gl, const Room& room, std::span<const Aperture> apertures,
                                      const glm::dvec3& origin) {
  RoomBuffers b;
  std::vector<glm::vec3> corners, occluder_corners;
  for (std::uint32_t i = 0; i < room.triangles.size(); ++i) {
    const RoomTriangle& t = room.triangles[i];
    const glm::dvec3 n = area_normal(room, t);
    if (room.is_window(t) || !(glm::length(n) > 0.0))
      continue;
    const glm::dvec3 unit = glm::normalize(n);
    for (int k = 0; k < 3; ++k)
      corners.emplace_back(room.corner(t, k) - origin);
    b.planes_.emplace_back(glm::vec3(unit), static_cast<float>(-glm::dot(unit, room.corner(t, 0) - origin)));
    b.source_.push_back(i);
  }
  if (b.source_.size() > kMostTriangles)
    return too_many_triangles(b.source_.size(), "room");
  for (const Aperture& a : apertures) {
    const auto w = static_cast<float>(-glm::dot(a.inward, a.corners[0] - origin));
    b.openings_.push_back({glm::vec4(glm::vec3(a.inward), w), static_cast<int>(corners.size()),
                           static_cast<int>(3 * (a.corners.size() - 2))});
    for (std::size_t k = 2; k < a.corners.size(); ++k) // convex: a fan
      for (const std::size_t c : {std::size_t{0}, k - 1, k})
        corners.emplace_back(a.corners[c] - origin);
  }
  for (const std::uint32_t i : occluding_triangles(room, apertures))
    for (int k = 0; k < 3; ++k)
      occluder_corners.emplace_back(room.corner(room.triangles[i], k) - origin);
  b.occluder_vertex_count_ = static_cast<int>(occluder_corners.size());
  b.vertices_ = make_buffer(gl, bytes_of(corners));
  b.occluder_vertices_ = make_buffer(gl, bytes_of(occluder_corners));
  b.plane_list_ = make_buffer(gl, bytes_of(b.planes_));
  b.array_ = make_vertex_array(gl, b.vertices_, {3});
  b.occluder_array_ = make_vertex_array(gl, b.occluder_vertices_, {3});
  return b;
}

void RoomBuffers::draw(const Gl& gl) const {
  gl->BindVertexArray(array_.name());
  gl->DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(3 * source_.size()));
}

void RoomBuffers::draw_openings(const Gl& gl, const glm::vec3& eye) const {
  gl->BindVertexArray(array_.name());
  for (const Opening& o : openings_)
    if (glm::dot(glm::vec3(o.plane), eye) + o.plane.w > 0.0f)
      gl->DrawArrays(GL_TRIANGLES, o.first, o.vertices);
}

void RoomBuffers::bind(const Gl& gl) const { bind_list(gl, kRoomPlanes, plane_list_); }

std::uint32_t RoomBuffers::triangle(std::uint32_t id) const {
  return id == 0 || id > source_.size() ? kUnknownTriangle : source_[id - 1];
}

/// x = eye - (n.eye + w) / (n.ray) ray on the plane n.x + w = 0.
glm::vec3 RoomBuffers::position(std::uint32_t id, const glm::vec3& eye, const glm::vec3& ray) const {
  const glm::vec3 n(planes_[id - 1]);
  return eye - (glm::dot(n, eye) + planes_[id - 1].w) / glm::dot(n, ray) * ray;
}

Result<void> ObjectBuffers::set(const Gl& gl, const ObjectSurface& objects, const glm::dvec3& origin) {
  if (objects.triangles.size() > kMostTriangles)
    return too_many_triangles(objects.triangles.size(), "objects");
  const BoundingSphere world = objects.bounds();
  sphere_ = {world.centre - origin, std::max(world.radius, 1e-6)};
  vertex_count_ = objects.positions.size();
  index_count_ = static_cast<int>(3 * objects.triangles.size());
  std::vector<glm::vec3> vertices; // position, normal, reflectance
  vertices.reserve(3 * vertex_count_);
  for (std::size_t i = 0; i < vertex_count_; ++i) {
    vertices.emplace_back(objects.positions[i] - origin);
    vertices.push_back(objects.normals[i]);
    vertices.push_back(objects.drawn_reflectance[i]);
  }
  vertices_ = make_buffer(gl, bytes_of(vertices));
  indices_ = make_buffer(gl, bytes_of(objects.triangles));
  light_ = make_buffer(gl, bytes_of(std::vector<VertexLight>(vertex_count_)));
  array_ = make_vertex_array(gl, vertices_, {3, 3, 3}, indices_.name());
  return check_gl(*gl, "uploading objects");
}

Result<void> ObjectBuffers::set_light(const Gl& gl, std::span<const VertexLight> light) {
  static_assert(sizeof(VertexLight) == 12 * sizeof(float), "layout of shaders/object_surface.glsl");
  refill_buffer(gl, light_, bytes_of(light));
  return check_gl(*gl, "uploading vertex light");
}

void ObjectBuffers::draw(const Gl& gl) const {
  gl->BindVertexArray(array_.name());
  gl->DrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
}

void ObjectBuffers::bind(const Gl& gl) const {
  bind_list(gl, kObjectTriangles, indices_);
  bind_list(gl, kObjectVertices, vertices_);
  bind_list(gl, kObjectLight, light_);
}

Result<void> LightBuffers::set(const Gl& gl, const PortalLights& lights) {
  lights_ = make_buffer(gl, bytes_of(lights.lights()));
  portals_ = make_buffer(gl, bytes_of(lights.portals()));
  planes_ = make_buffer(gl, bytes_of(lights.planes()));
  return check_gl(*gl, "uploading lights");
}

void LightBuffers::bind(const Gl& gl) const {
  bind_list(gl, kLights, lights_);
  bind_list(gl, kPortals, portals_);
  bind_list(gl, kPlanes, planes_);
}

} // namespace daylit
