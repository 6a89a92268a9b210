#include "runtime/trace/traced_renderer.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/object/bounds.h"
#include "runtime/shading/sampling_grid.h"
#include "runtime/trace/block_shader.h"
#include "runtime/trace/ray_visibility.h"
#include "runtime/trace/rigid_motion.h"
#include "runtime/trace/visible_surfaces.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

/// Keeps its memory from frame to frame.
class PictureShader {
public:
  /// Fills the frame; returns how many shadow rays it took.
  std::uint64_t shade(const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame);

private:
  PixelBox affected_box(const TracedScene& scene, const VisibleSurfaces& view);
  void expect_blocks(const VisibleSurfaces& view, RenderedFrame& frame) const;
  SampledPicture sampled_picture(const TracedScene& scene, const VisibleSurfaces& view, const PixelBox& box);

  std::vector<std::uint8_t> receives_; ///< per block of the picture: some light may lose its way to it
  std::vector<glm::ivec2> outline_;    ///< of the objects, pixels
  SamplingGrid grid_;
};

/// Marks the blocks that a light could reach only through the objects' sphere; the box holds them and the objects.
PixelBox PictureShader::affected_box(const TracedScene& scene, const VisibleSurfaces& view) {
  const ShadowCasters casters = scene.casters();
  const int columns = view.block_columns(), rows = view.block_rows();
  receives_.assign(static_cast<std::size_t>(columns) * rows, 0);
  std::vector<PixelBox> row_box(static_cast<std::size_t>(rows));
  parallel_for(tbb::blocked_range<int>(0, rows, 8), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      for (int column = 0; column < columns; ++column) {
        const BlockBound& b = view.block(column, row);
        if (b.radius < 0.0f || (!may_be_shadowed(scene.sky.cone, casters, b.centre, b.radius) &&
                                !may_be_shadowed(scene.sun.cone, casters, b.centre, b.radius)))
          continue;
        receives_[static_cast<std::size_t>(row) * columns + column] = 1;
        row_box[row].include(
            {column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide});
      }
  });
  PixelBox box = view.object_box();
  for (const PixelBox& r : row_box)
    box.include(r);
  return box.clipped(view.width_px(), view.height_px());
}

/// What the grid is laid over.
SampledPicture PictureShader::sampled_picture(const TracedScene& scene, const VisibleSurfaces& view,
                                              const PixelBox& box) {
  outline_.clear();
  for (std::size_t k = 0; k < view.edge_pixels(); ++k)
    outline_.push_back(view.edge_pixel(k));
  const ShadowCasters casters = scene.casters();
  SampledPicture picture;
  picture.columns = view.block_columns();
  picture.rows = view.block_rows();
  picture.box = box;
  picture.radius = casters.radius;
  picture.radius_px = view.radius_px(casters.centre, casters.radius);
  picture.sky_lights = scene.sky.size();
  picture.sun_lights = scene.sun.size();
  picture.light_spacing = scene.sky.spacing;
  picture.low = casters.low;
  picture.high = casters.high;
  picture.outline = outline_;
  return picture;
}

/// Those that receive, and those of the objects.
void PictureShader::expect_blocks(const VisibleSurfaces& view, RenderedFrame& frame) const {
  const PixelBox objects = view.object_box();
  for (int row = 0; row < view.block_rows(); ++row) {
    std::size_t blocks = 0;
    for (int column = 0; column < view.block_columns(); ++column) {
      const PixelBox pixels{column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide};
      blocks +=
          receives_[static_cast<std::size_t>(row) * view.block_columns() + column] || !pixels.common(objects).empty();
    }
    frame.expect(row, blocks);
  }
}

std::uint64_t PictureShader::shade(const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame) {
  frame.start(view.width_px(), view.height_px(), affected_box(scene, view));
  expect_blocks(view, frame);
  if (frame.box.empty())
    return 0;
  const RayVisibility visibility(scene, view, receives_);
  std::atomic<std::uint64_t> rays{0};
  if (scene.settings.use_grid)
    rays += grid_.evaluate(visibility, sampled_picture(scene, view, frame.box));
  const int first = frame.box.y0 / kBlockSide, last = (frame.box.y1 + kBlockSide - 1) / kBlockSide;
  parallel_for(tbb::blocked_range<int>(first, last), [&](const tbb::blocked_range<int>& range) {
    BlockShader shader(grid_, visibility, receives_, scene, view, frame);
    for (int row = range.begin(); row != range.end(); ++row) {
      for (int column = frame.box.x0 / kBlockSide; column * kBlockSide < frame.box.x1; ++column)
        shader.shade(column, row);
      shader.finish_row();
    }
    rays += shader.rays();
  });
  grid_ = {}; // as large as a third of the picture's values: not kept beside them
  return rays;
}

/// Mean over the lights of the angle to the nearest other, radians.
float light_spacing(std::span<const DirectionalLight> lights) {
  double sum = 0.0;
  for (const DirectionalLight& a : lights) {
    double nearest2 = 4.0;
    for (const DirectionalLight& b : lights)
      if (&a != &b)
        nearest2 = std::min(nearest2, glm::dot(a.direction - b.direction, a.direction - b.direction));
    sum += std::sqrt(nearest2);
  }
  return lights.size() < 2 ? 0.0f : static_cast<float>(sum / static_cast<double>(lights.size()));
}

// Parts of an object further apart in depth than this fraction of its radius are shaded separately where they meet.
constexpr float kApart = 0.04f;

} // namespace

struct TracedRenderer::State {
  TracedScene scene;
  std::vector<glm::vec3> hull; ///< points around the objects
  RigidMotion motion;          ///< of the objects since their hierarchy was built or refitted
  PacketScene room;
  RoomMesh mesh; ///< what `room` was built from, openings too
  std::vector<Aperture> apertures;
  std::size_t occluder_count = 0;
  PinholeCamera camera;
  VisibleSurfaces view;
  PictureShader shader;
  bool has_camera = false, room_is_traced = false, objects_are_traced = false;
  std::uint64_t shadow_rays = 0;

  void find_surfaces();
  Result<void> build_objects(const ObjectSurface& objects);
  Result<void> move_objects(const ObjectSurface& objects);
};

void TracedRenderer::State::find_surfaces() {
  if (!room_is_traced)
    view.trace_room({room, mesh});
  if (!objects_are_traced)
    view.trace_objects(scene.objects, {scene.triangles, scene.normals}, {room, mesh},
                       scene.triangles.empty() ? PixelBox{} : projected_box(camera, scene.origin, hull),
                       kApart * static_cast<float>(scene.sphere.radius));
  room_is_traced = objects_are_traced = true;
}

/// A ray that slips between facets is one light of many at a point; a pixel that misses becomes an outline, which is
/// looked at eight times.
Result<void> TracedRenderer::State::build_objects(const ObjectSurface& objects) {
  auto built = PacketScene::build(scene.positions, scene.triangles, PacketScene::Edges::quick);
  if (!built)
    return built.error();
  scene.objects = std::move(*built);
  scene.opaque.reset();
  scene.glass.reset();
  if (objects.glass.empty())
    return {};
  auto glass = GlassFaces::build(objects, scene.positions);
  if (!glass)
    return glass.error();
  scene.glass = std::move(*glass);
  const std::vector<std::uint8_t> is_glass = GlassFaces::mark(objects);
  std::vector<std::array<std::uint32_t, 3>> opaque;
  for (std::size_t t = 0; t < is_glass.size(); ++t)
    if (!is_glass[t])
      opaque.push_back(scene.triangles[t]);
  auto without = PacketScene::build(scene.positions, opaque, PacketScene::Edges::quick);
  if (!without)
    return without.error();
  scene.opaque = std::move(*without);
  return {};
}

Result<void> TracedRenderer::State::move_objects(const ObjectSurface& objects) {
  const bool rigid = motion.set(scene.positions);
  if (!rigid)
    motion = RigidMotion(scene.positions);
  for (PacketScene* rays : {&scene.objects, scene.opaque ? &*scene.opaque : nullptr}) {
    if (!rays)
      continue;
    if (rigid)
      rays->set_transform(motion.to_first());
    else if (const auto moved = rays->move(scene.positions); !moved)
      return moved;
  }
  const Similarity to_first = rigid ? motion.to_first() : Similarity{};
  return scene.glass ? scene.glass->move(objects, scene.positions, rigid ? &to_first : nullptr) : Result<void>{};
}

Result<TracedRenderer> TracedRenderer::make(const Room& room, std::span<const Aperture> apertures,
                                            const TraceSettings& settings) {
  auto state = std::make_unique<State>();
  TracedScene& scene = state->scene;
  scene.settings = settings;
  scene.origin = room.bounds().empty() ? glm::dvec3(0.0) : room.bounds().centre();
  state->apertures.assign(apertures.begin(), apertures.end());
  state->mesh = room_mesh(room, scene.origin, reflecting_triangles(room));
  const RoomMesh& whole = state->mesh;
  const std::vector<std::uint32_t> occluding = occluding_triangles(room, apertures);
  const RoomMesh occluders = room_mesh(room, scene.origin, occluding);
  state->occluder_count = occluding.size();
  scene.room_shadow_bounds = ShadowBounds(occluders.vertices, occluders.triangles);
  scene.room_triangle = whole.source;
  for (const std::uint32_t i : whole.source) {
    const glm::dvec3 n = area_normal(room, room.triangles[i]);
    scene.room_normals.emplace_back(glm::length(n) > 0.0 ? glm::normalize(n) : glm::dvec3(0.0, 0.0, 1.0));
  }
  state->mesh.normals = scene.room_normals;
  add_openings(state->mesh, apertures, scene.origin);
  for (auto [target, mesh] : {std::pair{&state->room, &whole}, std::pair{&scene.occluders, &occluders}}) {
    auto built = PacketScene::build(mesh->vertices, mesh->triangles);
    if (!built)
      return built.error();
    *target = std::move(*built);
  }
  return TracedRenderer(std::move(state));
}

TracedRenderer::TracedRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
TracedRenderer::TracedRenderer(TracedRenderer&&) noexcept = default;
TracedRenderer& TracedRenderer::operator=(TracedRenderer&&) noexcept = default;
TracedRenderer::~TracedRenderer() = default;

Result<void> TracedRenderer::set_camera(const PinholeCamera& camera) {
  State& s = *state_;
  if (s.has_camera && same_view(camera, s.camera))
    return {};
  s.camera = camera;
  s.view.set_camera(camera, s.scene.origin);
  s.has_camera = true;
  s.room_is_traced = s.objects_are_traced = false;
  return {};
}

Result<void> TracedRenderer::set_objects(const ObjectSurface& objects) {
  State& s = *state_;
  TracedScene& scene = s.scene;
  const bool same_glass = scene.glass ? scene.glass->is_of(objects.glass) : objects.glass.empty();
  const bool same_mesh =
      same_glass && objects.triangles == scene.triangles && scene.positions.size() == objects.positions.size();
  scene.positions.clear();
  for (const glm::dvec3& p : objects.positions)
    scene.positions.emplace_back(p - scene.origin);
  s.hull = points_around(scene.positions);
  constexpr float kMargin_m = 1e-4f; // of the rays' single precision
  scene.low = scene.high = scene.positions.empty() ? glm::vec3(0.0f) : scene.positions[0];
  for (const glm::vec3& p : scene.positions) {
    scene.low = glm::min(scene.low, p - kMargin_m);
    scene.high = glm::max(scene.high, p + kMargin_m);
  }
  scene.normals = objects.normals;
  scene.reflectance = objects.drawn_reflectance;
  scene.sphere = objects.bounds();
  scene.light.assign(objects.positions.size(), {});
  s.objects_are_traced = false;
  if (same_mesh && !scene.triangles.empty())
    return s.move_objects(objects);
  scene.triangles = objects.triangles;
  s.motion = RigidMotion(scene.positions);
  return s.build_objects(objects);
}

Result<void> TracedRenderer::set_lights(const LightSet& lights) {
  State& s = *state_;
  TracedScene& scene = s.scene;
  for (auto [group, list] : {std::pair{&scene.sky, &lights.sky}, {&scene.sun, &lights.sun}}) {
    group->portal = PortalLights(*list, s.apertures, scene.origin);
    group->cone = bounding_cone(*list);
  }
  scene.sky.spacing = light_spacing(lights.sky);
  scene.sun_normal_irradiance = Rgb(0.0f);
  for (const DirectionalLight& l : lights.sun)
    scene.sun_normal_irradiance += l.irradiance;
  return {};
}

Result<std::vector<std::uint32_t>> TracedRenderer::vertices_in_view() {
  State& s = *state_;
  if (!s.has_camera)
    return Error{ErrorCode::value_invalid, "no camera is set", "renderer", "call set_camera first"};
  s.find_surfaces();
  std::vector<std::uint8_t> used(s.scene.positions.size(), 0);
  const auto mark = [&](const ObjectHit& hit) {
    if (hit.samples == 0 || s.scene.is_black(hit.triangle))
      return;
    const auto weight = s.scene.light_weights(hit.triangle, hit.u, hit.v, hit.depth, s.view.pixel_pitch());
    for (std::size_t k = 0; k < 3; ++k)
      if (weight[k] != 0.0f)
        std::atomic_ref(used[s.scene.triangles[hit.triangle][k]]).store(1, std::memory_order_relaxed);
  };
  const PixelBox& box = s.view.object_box();
  parallel_for(tbb::blocked_range<int>(box.y0, box.y1, 16), [&](const tbb::blocked_range<int>& rows) {
    for (int y = rows.begin(); y != rows.end(); ++y)
      for (int x = box.x0; x < box.x1; ++x)
        if (s.view.is_edge(x, y))
          for (const ObjectHit& hit : s.view.edge_hits(x, y))
            mark(hit);
        else
          mark(s.view.object(x, y));
  });
  std::vector<std::uint32_t> vertices;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v])
      vertices.push_back(static_cast<std::uint32_t>(v));
  return vertices;
}

Result<void> TracedRenderer::set_vertex_light(std::span<const std::uint32_t> vertices,
                                              std::span<const VertexLight> light) {
  TracedScene& scene = state_->scene;
  if (const auto fits = check_vertex_light(vertices, light.size(), scene.light.size()); !fits)
    return fits;
  for (std::size_t k = 0; k < vertices.size(); ++k)
    scene.light[vertices[k]] = light[k];
  return {};
}

Result<void> TracedRenderer::draw(RenderedFrame& frame) {
  State& s = *state_;
  if (!s.has_camera)
    return Error{ErrorCode::value_invalid, "no camera is set", "renderer", "call set_camera first"};
  s.find_surfaces();
  const ShadowCasters casters = s.scene.casters();
  for (TracedLights* group : {&s.scene.sky, &s.scene.sun}) { // rays start a little outside the surface
    group->find_room_shadows(s.scene.room_shadow_bounds, casters.centre, 1.01f * casters.radius);
  }
  s.shadow_rays = s.shader.shade(s.scene, s.view, frame);
  return {};
}

std::size_t TracedRenderer::room_parts(int x, int y, std::span<RoomSurfacePart, kMostRoomParts> parts) const {
  const std::span<const RoomPart> seen = state_->view.room_parts(x, y);
  for (std::size_t k = 0; k < seen.size(); ++k)
    parts[k] = {{state_->scene.room_triangle[seen[k].triangle], state_->scene.origin + glm::dvec3(seen[k].position)},
                seen[k].fraction};
  return seen.size();
}

bool TracedRenderer::room_point(int x, int y, RoomSurface& point) const {
  const State& s = *state_;
  const RoomHit hit = s.view.room(x, y);
  point.triangle = hit.triangle == kNoTriangle ? kUnknownTriangle : s.scene.room_triangle[hit.triangle];
  point.position = s.scene.origin + glm::dvec3(s.view.eye() + hit.depth * s.view.direction(static_cast<float>(x),
                                                                                           static_cast<float>(y)));
  return true;
}

std::uint64_t TracedRenderer::shadow_rays() const { return state_->shadow_rays; }
std::size_t TracedRenderer::room_occluders() const { return state_->occluder_count; }
std::string TracedRenderer::description() const { return "rays on the processor (Embree)"; }

} // namespace daylit
