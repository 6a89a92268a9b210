#include "runtime/trace/packet_scene.h"

#include <bit>
#include <cstring>

#include <embree3/rtcore.h>

#include "runtime/shading/lane_kernels.h"

namespace daylit {

struct PacketScene::Handle {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
  float* vertices = nullptr;
  std::size_t vertex_count = 0;
  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (geometry)
      rtcReleaseGeometry(geometry);
    if (scene)
      rtcReleaseScene(scene);
    if (device)
      rtcReleaseDevice(device);
  }

  void write(std::span<const glm::vec3> from) { std::memcpy(vertices, from.data(), from.size_bytes()); }
  Result<void> commit() {
    rtcCommitGeometry(geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE)
      return Error{ErrorCode::device, "the ray tracing library could not build its hierarchy", "embree", ""};
    return {};
  }
};

namespace {

/// 0xFFFFFFFF where the lane is asked for.
struct alignas(64) ValidLanes {
  int valid[kLanes];
  explicit ValidLanes(LaneMask lanes) {
    for (int k = 0; k < kLanes; ++k)
      valid[k] = -static_cast<int>(lanes >> k & 1u);
  }
};

/// Without vectors of sixteen, Embree 3.13 looks at the mask no more and traces every lane that is not empty.
void fill(RTCRay16& to, LaneMask lanes, const RayPacket16& from, const Similarity& to_given) {
  const glm::mat3& axes = to_given.axes;
  lanes::transform(axes, to_given.origin, {from.org_x, from.org_y, from.org_z}, to.org_x, to.org_y, to.org_z);
  lanes::transform(axes, glm::vec3(0.0f), {from.dir_x, from.dir_y, from.dir_z}, to.dir_x, to.dir_y, to.dir_z);
  static_assert(sizeof(from.tnear) == sizeof(to.tnear));
  std::memcpy(to.tnear, from.tnear, sizeof(to.tnear));
  std::memcpy(to.tfar, from.tfar, sizeof(to.tfar));
  for (int k = 0; k < kLanes; ++k)
    if (!(lanes >> k & 1u))
      to.tnear[k] = 0.0f, to.tfar[k] = -1.0f;
  std::memset(to.time, 0, sizeof(to.time));
  std::memset(to.mask, 0xFF, sizeof(to.mask));
  std::memset(to.id, 0, sizeof(to.id));
  std::memset(to.flags, 0, sizeof(to.flags));
}

constexpr int kFewLanes = 4; // a packet costs more than these one by one

LaneMask occluded_one_by_one(RTCScene scene, LaneMask lanes, const RTCRay16& rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  LaneMask blocked = 0;
  for (std::uint32_t left = lanes; left; left &= left - 1) {
    const int k = std::countr_zero(left);
    RTCRay r{rays.org_x[k],
             rays.org_y[k],
             rays.org_z[k],
             rays.tnear[k],
             rays.dir_x[k],
             rays.dir_y[k],
             rays.dir_z[k],
             0.0f,
             rays.tfar[k],
             0xFFFFFFFFu,
             0,
             0};
    rtcOccluded1(scene, &context, &r);
    blocked |= static_cast<std::uint32_t>(r.tfar < 0.0f) << k;
  }
  return blocked;
}

RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

struct VisitContext {
  RTCIntersectContext context; // first: Embree hands it back
  HitVisitor* visitor = nullptr;
};

/// Tells of the hit and has the ray go on.
void tell_and_go_on(const RTCFilterFunctionNArguments* of) {
  HitVisitor& visitor = *reinterpret_cast<VisitContext*>(of->context)->visitor;
  for (unsigned i = 0; i < of->N; ++i)
    if (of->valid[i]) {
      visitor.meet(static_cast<int>(RTCRayN_id(of->ray, of->N, i)), RTCHitN_primID(of->hit, of->N, i),
                   RTCRayN_tfar(of->ray, of->N, i), RTCHitN_u(of->hit, of->N, i), RTCHitN_v(of->hit, of->N, i));
      of->valid[i] = 0;
    }
}

} // namespace

Result<PacketScene> PacketScene::build(std::span<const glm::vec3> vertices,
                                       std::span<const std::array<std::uint32_t, 3>> triangles, Edges edges,
                                       Hits hits) {
  PacketScene result;
  result.handle_ = std::make_shared<Handle>();
  Handle& h = *result.handle_;
  h.device = rtcNewDevice(nullptr);
  if (!h.device)
    return Error{ErrorCode::device, "the ray tracing library did not start", "embree", ""};
  h.scene = rtcNewScene(h.device);
  const RTCSceneFlags robust = edges == Edges::watertight ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE;
  const RTCSceneFlags all = hits == Hits::all_too ? RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION : RTC_SCENE_FLAG_NONE;
  rtcSetSceneFlags(h.scene, static_cast<RTCSceneFlags>(robust | all | RTC_SCENE_FLAG_DYNAMIC));
  result.empty_ = triangles.empty();
  if (result.empty_) {
    rtcCommitScene(h.scene);
    return result;
  }
  h.geometry = rtcNewGeometry(h.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(h.geometry, RTC_BUILD_QUALITY_REFIT);
  h.vertices = static_cast<float*>(rtcSetNewGeometryBuffer(h.geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                           3 * sizeof(float), vertices.size()));
  void* indices = rtcSetNewGeometryBuffer(h.geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), triangles.size());
  if (!h.vertices || !indices)
    return Error{ErrorCode::limit_exceeded, "not enough memory for the ray scene", "embree", ""};
  h.vertex_count = vertices.size();
  h.write(vertices);
  std::memcpy(indices, triangles.data(), triangles.size_bytes());
  rtcAttachGeometryByID(h.scene, h.geometry, 0);
  if (const auto r = h.commit(); !r)
    return r.error();
  return result;
}

Result<void> PacketScene::move(std::span<const glm::vec3> vertices) {
  Handle& h = *handle_;
  if (vertices.size() != h.vertex_count)
    return Error{ErrorCode::value_invalid, "the mesh changed its number of vertices", "ray scene", "build a new one"};
  if (empty_)
    return {};
  to_given_ = {};
  h.write(vertices);
  rtcUpdateGeometryBuffer(h.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  return h.commit();
}

LaneMask PacketScene::occluded(LaneMask lanes, const RayPacket16& rays) const {
  if (empty_ || lanes == 0)
    return 0;
  alignas(64) RTCRay16 r;
  fill(r, lanes, rays, to_given_);
  if (std::popcount(lanes) <= kFewLanes)
    return occluded_one_by_one(handle_->scene, lanes, r);
  const ValidLanes mask(lanes);
  RTCIntersectContext context = coherent_context();
  rtcOccluded16(mask.valid, handle_->scene, &context, &r);
  LaneMask blocked = 0;
  for (int k = 0; k < kLanes; ++k)
    blocked |= static_cast<std::uint32_t>(r.tfar[k] < 0.0f) << k;
  return blocked & lanes;
}

void PacketScene::all(LaneMask lanes, const RayPacket16& rays, HitVisitor& visitor) const {
  if (empty_ || lanes == 0)
    return;
  alignas(64) RTCRay16 r;
  fill(r, lanes, rays, to_given_);
  for (unsigned k = 0; k < kLanes; ++k)
    r.id[k] = k;
  const ValidLanes mask(lanes);
  VisitContext context{coherent_context(), &visitor};
  context.context.filter = tell_and_go_on;
  rtcOccluded16(mask.valid, handle_->scene, &context.context, &r);
}

void PacketScene::closest(LaneMask lanes, const RayPacket16& rays, RayHits16& hits) const {
  for (std::uint32_t& t : hits.triangle)
    t = kNoTriangle;
  if (empty_ || lanes == 0)
    return;
  const ValidLanes mask(lanes);
  alignas(64) RTCRayHit16 r;
  fill(r.ray, lanes, rays, to_given_);
  std::memset(r.hit.geomID, 0xFF, sizeof(r.hit.geomID));
  std::memset(r.hit.instID, 0xFF, sizeof(r.hit.instID));
  RTCIntersectContext context = coherent_context();
  rtcIntersect16(mask.valid, handle_->scene, &context, &r);
  for (int k = 0; k < kLanes; ++k)
    if ((lanes >> k & 1u) && r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID) {
      hits.triangle[k] = r.hit.primID[k];
      hits.distance[k] = r.ray.tfar[k];
      hits.u[k] = r.hit.u[k];
      hits.v[k] = r.hit.v[k];
    }
}

} // namespace daylit
