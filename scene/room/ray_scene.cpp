#include "scene/room/ray_scene.h"

#include <algorithm>
#include <cstring>

#include <embree3/rtcore.h>
#include <glm/geometric.hpp>

#include "scene/room/polygon.h"

namespace daylit {

namespace {
// A float coordinate of a re-centred scene of half extent h is off by up to h * 2^-24, a hit point by a few of these.
constexpr float kOffsetUlps = 32.0f / 16777216.0f;

/// Without vectors of sixteen, Embree 3.13 looks at `valid` no more and traces every lane that is not empty.
void load(const RayPacket16& from, int count, RTCRay16& to, int* valid) {
  std::memcpy(to.org_x, from.org_x, sizeof(from.org_x));
  std::memcpy(to.org_y, from.org_y, sizeof(from.org_y));
  std::memcpy(to.org_z, from.org_z, sizeof(from.org_z));
  std::memcpy(to.tnear, from.tnear, sizeof(from.tnear));
  std::memcpy(to.dir_x, from.dir_x, sizeof(from.dir_x));
  std::memcpy(to.dir_y, from.dir_y, sizeof(from.dir_y));
  std::memcpy(to.dir_z, from.dir_z, sizeof(from.dir_z));
  std::memcpy(to.tfar, from.tfar, sizeof(from.tfar));
  std::memset(to.time, 0, sizeof(to.time));
  for (int k = 0; k < 16; ++k) {
    valid[k] = k < count ? -1 : 0;
    if (k >= count)
      to.tnear[k] = 0.0f, to.tfar[k] = -1.0f;
    to.mask[k] = 0xFFFFFFFFu;
    to.id[k] = 0;
    to.flags[k] = 0;
  }
}
} // namespace

struct RayScene::Handle {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const float* vertices = nullptr; ///< of the scene's one geometry
  const std::uint32_t* triangles = nullptr;
  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (scene)
      rtcReleaseScene(scene);
    if (device)
      rtcReleaseDevice(device);
  }
};

/// Vertices are stored relative to the centre of their bounds, in float: rounding is 2^-24 of the half extent.
Result<RayScene> RayScene::build(std::span<const glm::dvec3> vertices,
                                 std::span<const std::array<std::uint32_t, 3>> triangles) {
  RayScene result;
  Bounds bounds;
  for (const glm::dvec3& v : vertices)
    bounds.include(v);
  if (!bounds.empty())
    result.origin_ = bounds.centre();
  const glm::dvec3 half = bounds.empty() ? glm::dvec3(1.0) : 0.5 * bounds.size();
  result.surface_offset_ = kOffsetUlps * static_cast<float>(std::max({half.x, half.y, half.z}));

  auto handle = std::make_shared<Handle>();
  handle->device = rtcNewDevice(nullptr);
  if (!handle->device)
    return Error{ErrorCode::device, "the ray tracing library did not start", "embree", ""};
  handle->scene = rtcNewScene(handle->device);
  rtcSetSceneFlags(handle->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(handle->scene, RTC_BUILD_QUALITY_HIGH);
  if (!triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(handle->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                          3 * sizeof(float), vertices.size()));
    auto* t = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                  3 * sizeof(std::uint32_t), triangles.size()));
    if (!v || !t)
      return Error{ErrorCode::limit_exceeded, "not enough memory for the ray scene", "embree", ""};
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const glm::vec3 p = result.to_local(vertices[i]);
      std::memcpy(v + 3 * i, &p.x, sizeof(p));
    }
    std::memcpy(t, triangles.data(), triangles.size_bytes());
    handle->vertices = v;
    handle->triangles = t;
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(handle->scene, geometry, 0);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(handle->scene);
  if (rtcGetDeviceError(handle->device) != RTC_ERROR_NONE)
    return Error{ErrorCode::device, "the ray tracing library could not build its hierarchy", "embree", ""};
  result.handle_ = std::move(handle);
  return result;
}

Result<RayScene> RayScene::build(const Room& room) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> source;
  for (std::size_t i = 0; i < room.triangles.size(); ++i) {
    if (room.is_window(room.triangles[i]))
      continue;
    triangles.push_back(room.triangles[i].vertex);
    source.push_back(static_cast<std::uint32_t>(i));
  }
  Result<RayScene> scene = build(room.vertices, triangles);
  if (scene)
    scene->source_triangle_ = std::move(source);
  return scene;
}

/// First hit at tnear <= t <= tfar; barycentric u, v as embree gives them.
bool RayScene::closest(const glm::vec3& org, const glm::vec3& dir, float tnear, float tfar, RayHit& hit) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit r{};
  r.ray = {org.x, org.y, org.z, tnear, dir.x, dir.y, dir.z, 0.0f, tfar, 0xFFFFFFFFu, 0, 0};
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(handle_->scene, &context, &r);
  if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID)
    return false;
  hit = {source_triangle_.empty() ? r.hit.primID : source_triangle_[r.hit.primID], r.ray.tfar, r.hit.u, r.hit.v};
  return true;
}

bool RayScene::occluded(const glm::vec3& org, const glm::vec3& dir, float tnear, float tfar) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay r = {org.x, org.y, org.z, tnear, dir.x, dir.y, dir.z, 0.0f, tfar, 0xFFFFFFFFu, 0, 0};
  rtcOccluded1(handle_->scene, &context, &r);
  return r.tfar < 0.0f;
}

/// Bit k: ray k meets a triangle. Embree marks such a ray with tfar = -infinity.
std::uint32_t RayScene::occluded16(const RayPacket16& rays, int count) const {
  alignas(64) int valid[16];
  alignas(64) RTCRay16 r;
  load(rays, count, r, valid);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, handle_->scene, &context, &r);
  std::uint32_t blocked = 0;
  for (int k = 0; k < count; ++k)
    blocked |= static_cast<std::uint32_t>(r.tfar[k] < 0.0f) << k;
  return blocked;
}

namespace {
void intersect(RTCScene scene, const RayPacket16& rays, int count, RTCIntersectContextFlags flags, RTCRayHit16& r) {
  alignas(64) int valid[16];
  load(rays, count, r.ray, valid);
  for (unsigned& id : r.hit.geomID)
    id = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  rtcIntersect16(valid, scene, &context, &r);
}
} // namespace

std::uint32_t RayScene::closest16(const RayPacket16& rays, int count, std::array<std::uint32_t, 16>& triangle) const {
  alignas(64) RTCRayHit16 r;
  intersect(handle_->scene, rays, count, RTC_INTERSECT_CONTEXT_FLAG_COHERENT, r);
  std::uint32_t met = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
    if (r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID) {
      triangle[k] = source_triangle_.empty() ? r.hit.primID[k] : source_triangle_[r.hit.primID[k]];
      met |= 1u << k;
    }
  return met;
}

std::uint32_t RayScene::closest16(const RayPacket16& rays, int count, RayHits16& hits) const {
  alignas(64) RTCRayHit16 r;
  intersect(handle_->scene, rays, count, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT, r);
  std::uint32_t met = 0;
  for (int k = 0; k < count; ++k)
    if (r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID) {
      hits.triangle[k] = source_triangle_.empty() ? r.hit.primID[k] : source_triangle_[r.hit.primID[k]];
      hits.distance[k] = r.ray.tfar[k];
      hits.u[k] = r.hit.u[k];
      hits.v[k] = r.hit.v[k];
      met |= 1u << k;
    }
  return met;
}

namespace {

struct NearestSearch {
  const float* vertices;
  const std::uint32_t* triangles;
  glm::vec3 corner(unsigned triangle, int k) const {
    const float* v = vertices + 3 * static_cast<std::size_t>(triangles[3 * static_cast<std::size_t>(triangle) + k]);
    return {v[0], v[1], v[2]};
  }
};

/// Narrows the query to what a triangle leaves of it.
bool narrow(RTCPointQueryFunctionArguments* args) {
  const auto& mesh = *static_cast<const NearestSearch*>(args->userPtr);
  const glm::vec3 p(args->query->x, args->query->y, args->query->z);
  const glm::vec3 nearest = detail::nearest_on_triangle(p, mesh.corner(args->primID, 0), mesh.corner(args->primID, 1),
                                                        mesh.corner(args->primID, 2));
  const float distance = glm::length(nearest - p);
  if (distance >= args->query->radius)
    return false;
  args->query->radius = distance;
  return true;
}

} // namespace

std::vector<std::uint32_t> RayScene::triangles_within(const glm::vec3& local, float distance) const {
  struct Found {
    NearestSearch mesh;
    std::vector<std::uint32_t> triangles;
  } found{{handle_->vertices, handle_->triangles}, {}};
  RTCPointQuery query{local.x, local.y, local.z, 0.0f, distance};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  const auto collect = [](RTCPointQueryFunctionArguments* args) {
    auto& all = *static_cast<Found*>(args->userPtr);
    const glm::vec3 p(args->query->x, args->query->y, args->query->z);
    const glm::vec3 nearest = detail::nearest_on_triangle(
        p, all.mesh.corner(args->primID, 0), all.mesh.corner(args->primID, 1), all.mesh.corner(args->primID, 2));
    if (glm::length(nearest - p) <= args->query->radius)
      all.triangles.push_back(args->primID);
    return false;
  };
  rtcPointQuery(handle_->scene, &query, &context, collect, &found);
  std::sort(found.triangles.begin(), found.triangles.end());
  if (!source_triangle_.empty())
    for (std::uint32_t& t : found.triangles)
      t = source_triangle_[t];
  return std::move(found.triangles);
}

float RayScene::distance(const glm::vec3& local, float within) const {
  NearestSearch search{handle_->vertices, handle_->triangles};
  RTCPointQuery query{local.x, local.y, local.z, 0.0f, within};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(handle_->scene, &query, &context, narrow, &search);
  return query.radius;
}

} // namespace daylit
