#include "runtime/trace/traced_renderer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/render/bounds.h"
#include "runtime/trace/light_gates.h"
#include "runtime/trace/shadow_sums.h"
#include "runtime/trace/visible_surfaces.h"

namespace daylit {

namespace {

using Triangle = std::array<std::uint32_t, 3>;

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// The reflecting triangles of a room, relative to an origin.
struct RoomMesh {
  std::vector<glm::vec3> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> source; ///< in the room
};

RoomMesh room_mesh(const Room& room, const glm::dvec3& origin, std::span<const std::uint32_t> triangles) {
  RoomMesh mesh;
  for (const glm::dvec3& v : room.vertices)
    mesh.vertices.emplace_back(v - origin);
  for (const std::uint32_t i : triangles) {
    mesh.triangles.push_back(room.triangles[i].vertex);
    mesh.source.push_back(i);
  }
  return mesh;
}

std::vector<std::uint32_t> reflecting_triangles(const Room& room) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t i = 0; i < room.triangles.size(); ++i)
    if (!room.is_window(room.triangles[i]))
      list.push_back(i);
  return list;
}

LightCone light_cone(const std::vector<DirectionalLight>& lights) {
  const glm::vec4 cone = bounding_cone(lights);
  return {glm::vec3(cone), cone.w};
}

/// Part of a whole, 1 where there is no whole.
float share(float part, float whole) { return whole > 0.0f ? part / whole : 1.0f; }

/// Objects' pixels of one block: what is known of each lane besides its point.
struct ObjectLanes {
  PointBlock points, origins;
  int pixel[kLanes] = {};
  float coverage[kLanes] = {};
  Rgb reflectance[kLanes] = {}, indirect[kLanes] = {}, open_sky[kLanes] = {};
  int count = 0;
};

struct RoomLanes {
  PointBlock points;
  int pixel[kLanes] = {};
  float share[kLanes] = {}; ///< of the pixel
  std::uint32_t triangle[kLanes] = {};
  int count = 0;
};

/// The lanes beyond `count` repeat the first point, so that bounds and vector code need no masks.
void close_block(PointBlock& p, int count) {
  for (int k = count; k < kLanes; ++k) {
    p.x[k] = p.x[0];
    p.y[k] = p.y[0];
    p.z[k] = p.z[0];
    p.nx[k] = p.ny[k] = p.nz[k] = 0.0f;
  }
  p.lanes = (1u << count) - 1u;
  p.bound();
}

void set_point(PointBlock& block, int k, const glm::vec3& p, const glm::vec3& n) {
  block.x[k] = p.x;
  block.y[k] = p.y;
  block.z[k] = p.z;
  block.nx[k] = n.x;
  block.ny[k] = n.y;
  block.nz[k] = n.z;
}

} // namespace

struct TracedRenderer::State {
  glm::dvec3 origin{0.0};
  PacketScene room, occluders, objects;
  RoomMesh room_mesh;
  std::vector<glm::vec3> room_normals;
  std::vector<Aperture> apertures;
  std::size_t occluder_count = 0;

  std::vector<glm::vec3> positions, normals;
  std::vector<Rgb> reflectance;
  std::vector<Triangle> triangles;
  std::vector<VertexLight> light;
  BoundingSphere sphere;

  LightGates sky, sun;
  LightCone sky_cone, sun_cone;
  Rgb sun_normal_irradiance{0.0f};

  RenderCamera camera;
  VisibleSurfaces view;
  bool has_camera = false, room_is_traced = false, objects_are_traced = false;
  RenderTimes times;
  std::atomic<std::uint64_t> rays{0};

  ShadowCasters casters() const {
    return {&objects, &occluders, glm::vec3(sphere.centre - origin), static_cast<float>(sphere.radius)};
  }
  PixelBox object_box() const;
  void find_surfaces();
  PixelBox affected_box(const ShadowCasters& casters) const;
  void gather(int column, int row, ObjectLanes& on_objects, RoomLanes& on_room, bool receives) const;
  void add_object_point(const ObjectHit& hit, ObjectLanes& lanes) const;
  void shade_objects(const ObjectLanes& lanes, const ShadowCasters& casters, RenderedFrame& frame);
  void shade_room(const RoomLanes& lanes, const ShadowCasters& casters, RenderedFrame& frame);
  void shade_block(int column, int row, const ShadowCasters& casters, RenderedFrame& frame);
};

/// Pixels that the objects' vertices project to; everything when one lies before the near plane.
PixelBox TracedRenderer::State::object_box() const {
  const PixelBox whole{0, 0, camera.width_px, camera.height_px};
  if (triangles.empty())
    return {};
  const glm::dmat3 axes(camera.world_from_camera);
  const glm::dvec3 eye = camera.eye() - origin;
  glm::dvec2 lo(std::numeric_limits<double>::infinity()), hi = -lo;
  for (const glm::vec3& p : positions) {
    const glm::dvec3 c = (glm::dvec3(p) - eye) * axes; // transpose of a rotation
    if (c.z < kNearPlane_m)
      return whole;
    const glm::dvec2 pixel(camera.fx * c.x / c.z + camera.cx, camera.fy * c.y / c.z + camera.cy);
    lo = glm::min(lo, pixel);
    hi = glm::max(hi, pixel);
  }
  lo = glm::clamp(lo, -2.0, 1e6);
  hi = glm::clamp(hi, -2.0, 1e6);
  return PixelBox{static_cast<int>(std::floor(lo.x)), static_cast<int>(std::floor(lo.y)),
                  static_cast<int>(std::ceil(hi.x)) + 1, static_cast<int>(std::ceil(hi.y)) + 1}
      .clipped(camera.width_px, camera.height_px);
}

void TracedRenderer::State::find_surfaces() {
  if (!room_is_traced)
    view.trace_room(room);
  if (!objects_are_traced)
    view.trace_objects(objects, room, object_box());
  room_is_traced = objects_are_traced = true;
}

/// Blocks that a light could reach only through the objects' sphere, and those that show objects.
PixelBox TracedRenderer::State::affected_box(const ShadowCasters& c) const {
  PixelBox box = view.object_box();
  for (int row = 0; row < view.block_rows(); ++row)
    for (int column = 0; column < view.block_columns(); ++column) {
      const BlockBound& b = view.block(column, row);
      if (b.radius >= 0.0f &&
          (may_be_shadowed(sky_cone, c, b.centre, b.radius) || may_be_shadowed(sun_cone, c, b.centre, b.radius)))
        box.include({column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide});
    }
  return box.clipped(camera.width_px, camera.height_px);
}

void TracedRenderer::State::add_object_point(const ObjectHit& hit, ObjectLanes& lanes) const {
  const Triangle& t = triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  glm::vec3 x(0.0f), n(0.0f);
  for (int k = 0; k < 3; ++k) {
    x += b[k] * positions[t[k]];
    n += b[k] * normals[t[k]];
  }
  const glm::vec3 facet = glm::cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]);
  const float facet_length = glm::length(facet), n_length = glm::length(n);
  n = n_length > 0.0f ? n / n_length : facet / std::max(facet_length, 1e-30f);
  // The inside of a thin shell. The winding decides, not the normal: interpolated normals turn away at silhouettes.
  const bool back = glm::dot(facet, view.eye() - x) < 0.0f && glm::dot(n, view.eye() - x) < 0.0f;
  const float side = back ? -1.0f : 1.0f;
  // A facet of a smooth surface shadows its own neighbours near the terminator. Rays start on the surface that the
  // normals describe: the mean of the point's projections onto the vertices' tangent planes, where these lie outside
  // (Hanika 2021, "Hacking the Shadow Terminator").
  glm::vec3 start = x;
  for (int k = 0; k < 3; ++k)
    start -= b[k] * std::min(0.0f, side * glm::dot(x - positions[t[k]], normals[t[k]])) * side * normals[t[k]];
  const float lift = std::max(2e-5f, 3e-4f * static_cast<float>(sphere.radius));
  start += lift * side * n;
  const int i = lanes.count++;
  set_point(lanes.points, i, x, side * n);
  set_point(lanes.origins, i, start, side * n);
  lanes.coverage[i] = static_cast<float>(hit.coverage) / kCoverageSamples;
  for (int k = 0; k < 3; ++k) {
    const VertexLight& l = light[t[k]];
    lanes.reflectance[i] += b[k] * reflectance[t[k]];
    lanes.indirect[i] += b[k] * (back ? l.indirect_back : l.indirect_front);
    lanes.open_sky[i] += b[k] * (back ? l.open_sky_back : l.open_sky_front);
  }
}

void TracedRenderer::State::gather(int column, int row, ObjectLanes& on_objects, RoomLanes& on_room,
                                   bool receives) const {
  for (int k = 0; k < kLanes; ++k) {
    const int x = column * kBlockSide + k % kBlockSide, y = row * kBlockSide + k / kBlockSide;
    if (x >= view.width_px() || y >= view.height_px())
      continue;
    const ObjectHit& object = view.object(x, y);
    if (object.coverage > 0) {
      on_objects.pixel[on_objects.count] = k;
      add_object_point(object, on_objects);
    }
    if (!receives || object.coverage == kCoverageSamples)
      continue;
    glm::vec3 position;
    const RoomHit room_hit = view.uncovered_room(x, y, position);
    if (room_hit.triangle == kNoTriangle)
      continue;
    const glm::vec3 n = room_normals[room_hit.triangle];
    const int i = on_room.count++;
    set_point(on_room.points, i, position, glm::dot(n, view.eye() - position) < 0.0f ? -n : n);
    on_room.pixel[i] = k;
    on_room.triangle[i] = room_mesh.source[room_hit.triangle];
    on_room.share[i] = 1.0f - static_cast<float>(object.coverage) / kCoverageSamples;
  }
}

void TracedRenderer::State::shade_objects(const ObjectLanes& lanes, const ShadowCasters& c, RenderedFrame& frame) {
  LaneSums sky_sums, sun_sums;
  std::uint64_t traced = 0;
  sum_on_objects(sky, c, lanes.points, lanes.origins, sky_sums, traced);
  sum_on_objects(sun, c, lanes.points, lanes.origins, sun_sums, traced);
  rays += traced;
  for (int i = 0; i < lanes.count; ++i) {
    Rgb radiance = lanes.indirect[i];
    for (int ch = 0; ch < 3; ++ch) {
      const float direct = lanes.open_sky[i][ch] * share(sky_sums.past_both[ch][i], sky_sums.unblocked[ch][i]) +
                           sun_sums.past_both[ch][i];
      radiance[ch] += lanes.reflectance[i][ch] * std::numbers::inv_pi_v<float> * direct;
    }
    frame.object[static_cast<std::size_t>(lanes.pixel[i])] = glm::vec4(lanes.coverage[i] * radiance, lanes.coverage[i]);
  }
}

void TracedRenderer::State::shade_room(const RoomLanes& lanes, const ShadowCasters& c, RenderedFrame& frame) {
  LaneSums sky_sums, sun_sums;
  std::uint64_t traced = 0;
  thread_local LostLights lost_sky, lost_sun; // keep their memory
  find_lost_lights(sky, c, lanes.points, lost_sky, traced);
  find_lost_lights(sun, c, lanes.points, lost_sun, traced);
  const std::uint32_t losing = lost_sky.lanes | lost_sun.lanes;
  if (losing != 0) {
    sum_on_room(sky, lost_sky, c, lanes.points, RoomShadow::where_lost, sky_sums, traced);
    sum_on_room(sun, lost_sun, c, lanes.points, RoomShadow::everywhere, sun_sums, traced);
  }
  rays += traced;
  const float whole_sun = sun_normal_irradiance.r + sun_normal_irradiance.g + sun_normal_irradiance.b;
  for (int i = 0; i < lanes.count; ++i) {
    if (!(losing >> i & 1u))
      continue;
    const std::size_t at = static_cast<std::size_t>(lanes.pixel[i]);
    glm::vec4 lost(0.0f, 0.0f, 0.0f, lanes.share[i]), shares(0.0f);
    float sun_before = 0.0f, sun_lost = 0.0f;
    for (int ch = 0; ch < 3; ++ch) {
      const float before = share(sky_sums.past_room[ch][i], sky_sums.unblocked[ch][i]);
      lost[ch] = lanes.share[i] * (before - share(sky_sums.past_both[ch][i], sky_sums.unblocked[ch][i]));
      shares.x += lanes.share[i] * before / 3.0f;
      sun_before += sun_sums.past_room[ch][i];
      sun_lost += sun_sums.past_room[ch][i] - sun_sums.past_both[ch][i];
    }
    if (whole_sun > 0.0f) {
      shares.y = lanes.share[i] * sun_before / whole_sun;
      shares.z = lanes.share[i] * sun_lost / whole_sun;
    }
    frame.lost_sky[at] = lost;
    frame.room[at] = shares;
    frame.surface[at] = {lanes.triangle[i], glm::vec3(lanes.points.x[i], lanes.points.y[i], lanes.points.z[i])};
  }
}

void TracedRenderer::State::shade_block(int column, int row, const ShadowCasters& c, RenderedFrame& frame) {
  const BlockBound& b = view.block(column, row);
  const bool receives = b.radius >= 0.0f && (may_be_shadowed(sky_cone, c, b.centre, b.radius) ||
                                             may_be_shadowed(sun_cone, c, b.centre, b.radius));
  ObjectLanes on_objects;
  RoomLanes on_room;
  gather(column, row, on_objects, on_room, receives);
  const auto place = [&](int& k) {
    k = static_cast<int>(frame.index(column * kBlockSide + k % kBlockSide, row * kBlockSide + k / kBlockSide));
  };
  if (on_objects.count > 0) {
    std::for_each(on_objects.pixel, on_objects.pixel + on_objects.count, place);
    close_block(on_objects.points, on_objects.count);
    close_block(on_objects.origins, on_objects.count);
    shade_objects(on_objects, c, frame);
  }
  if (on_room.count > 0) {
    std::for_each(on_room.pixel, on_room.pixel + on_room.count, place);
    close_block(on_room.points, on_room.count);
    shade_room(on_room, c, frame);
  }
}

Result<TracedRenderer> TracedRenderer::make(const Room& room, std::span<const Aperture> apertures) {
  auto state = std::make_unique<State>();
  State& s = *state;
  s.origin = room.bounds().empty() ? glm::dvec3(0.0) : room.bounds().centre();
  s.apertures.assign(apertures.begin(), apertures.end());
  s.room_mesh = room_mesh(room, s.origin, reflecting_triangles(room));
  for (const std::uint32_t i : s.room_mesh.source) {
    const glm::dvec3 n = area_normal(room, room.triangles[i]);
    s.room_normals.emplace_back(glm::length(n) > 0.0 ? glm::normalize(n) : glm::dvec3(0.0, 0.0, 1.0));
  }
  const std::vector<std::uint32_t> occluding = occluding_triangles(room, apertures);
  s.occluder_count = occluding.size();
  const RoomMesh occluder_mesh = room_mesh(room, s.origin, occluding);
  for (auto [scene, mesh] : {std::pair{&s.room, &std::as_const(s.room_mesh)}, {&s.occluders, &occluder_mesh}}) {
    auto built = PacketScene::build(mesh->vertices, mesh->triangles);
    if (!built)
      return built.error();
    *scene = std::move(*built);
  }
  return TracedRenderer(std::move(state));
}

TracedRenderer::TracedRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
TracedRenderer::TracedRenderer(TracedRenderer&&) noexcept = default;
TracedRenderer& TracedRenderer::operator=(TracedRenderer&&) noexcept = default;
TracedRenderer::~TracedRenderer() = default;

Result<void> TracedRenderer::set_camera(const RenderCamera& camera) {
  State& s = *state_;
  if (s.has_camera && same_view(camera, s.camera))
    return {};
  s.camera = camera;
  s.view.set_camera(camera, s.origin);
  s.has_camera = true;
  s.room_is_traced = s.objects_are_traced = false;
  return {};
}

Result<void> TracedRenderer::set_objects(const ObjectSurface& objects) {
  State& s = *state_;
  s.positions.clear();
  for (const glm::dvec3& p : objects.positions)
    s.positions.emplace_back(p - s.origin);
  const bool same_mesh = objects.triangles == s.triangles && s.normals.size() == objects.normals.size();
  s.normals = objects.normals;
  s.reflectance = objects.reflectance;
  s.sphere = objects.bounds();
  s.light.assign(objects.positions.size(), {});
  s.objects_are_traced = false;
  if (same_mesh && !s.triangles.empty())
    return s.objects.move(s.positions);
  s.triangles = objects.triangles;
  auto built = PacketScene::build(s.positions, s.triangles);
  if (!built)
    return built.error();
  s.objects = std::move(*built);
  return {};
}

Result<void> TracedRenderer::set_lights(const LightSet& lights) {
  State& s = *state_;
  s.sky = LightGates(lights.sky, s.apertures, s.origin);
  s.sun = LightGates(lights.sun, s.apertures, s.origin);
  s.sky_cone = light_cone(lights.sky);
  s.sun_cone = light_cone(lights.sun);
  s.sun_normal_irradiance = Rgb(0.0f);
  for (const DirectionalLight& l : lights.sun)
    s.sun_normal_irradiance += l.irradiance;
  return {};
}

Result<std::vector<std::uint8_t>> TracedRenderer::vertices_in_view() {
  State& s = *state_;
  if (!s.has_camera)
    return Error{ErrorCode::value_invalid, "no camera is set", "renderer", "call set_camera first"};
  s.find_surfaces();
  std::vector<std::uint8_t> used(s.positions.size(), 0);
  const PixelBox& box = s.view.object_box();
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x)
      if (const ObjectHit& hit = s.view.object(x, y); hit.coverage > 0)
        for (const std::uint32_t v : s.triangles[hit.triangle])
          used[v] = 1;
  return used;
}

Result<void> TracedRenderer::set_vertex_light(std::span<const VertexLight> light) {
  State& s = *state_;
  if (light.size() != s.positions.size())
    return Error{ErrorCode::value_invalid,
                 "light for " + std::to_string(light.size()) + " vertices, the objects have " +
                     std::to_string(s.positions.size()),
                 "renderer", "set the objects first"};
  s.light.assign(light.begin(), light.end());
  return {};
}

Result<void> TracedRenderer::draw(RenderedFrame& frame) {
  State& s = *state_;
  if (!s.has_camera)
    return Error{ErrorCode::value_invalid, "no camera is set", "renderer", "call set_camera first"};
  const auto start = std::chrono::steady_clock::now();
  s.find_surfaces();
  const ShadowCasters casters = s.casters();
  s.rays = 0;
  frame.width_px = s.camera.width_px;
  frame.height_px = s.camera.height_px;
  frame.box = s.affected_box(casters);
  frame.origin = s.origin;
  const std::size_t pixels = static_cast<std::size_t>(frame.box.width()) * frame.box.height();
  for (auto* pass : {&frame.object, &frame.lost_sky, &frame.room})
    pass->assign(pixels, glm::vec4(0.0f));
  frame.surface.assign(pixels, {});
  const int first = frame.box.y0 / kBlockSide, last = (frame.box.y1 + kBlockSide - 1) / kBlockSide;
  tbb::parallel_for(tbb::blocked_range<int>(first, std::max(first, last)), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = frame.box.x0 / kBlockSide; column * kBlockSide < frame.box.x1; ++column)
        s.shade_block(column, row, casters, frame);
  });
  s.times = {0.0, milliseconds_since(start), 0.0, s.rays};
  return {};
}

const RenderTimes& TracedRenderer::times() const { return state_->times; }
std::size_t TracedRenderer::room_occluders() const { return state_->occluder_count; }
std::string TracedRenderer::description() const { return "rays on the processor (Embree)"; }

} // namespace daylit
