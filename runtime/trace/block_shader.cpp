#include "runtime/trace/block_shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "runtime/light/orthonormal.h"

namespace daylit {

namespace {

// Corners of a block of object pixels that turn away from each other by more than this do not speak for it.
constexpr float kSameSideCosine = 0.8f;
constexpr float kSamePlane_m = 1e-3f;
// A block of points wider than this share of the objects' radius lies on several pieces of them.
constexpr float kSamePieceShare = 0.25f, kSamePieceCosine = 0.6f;
constexpr int kFewestShared = 5; // points: fewer are traced sooner than asked for

/// Part of a whole, 1 where there is no whole.
float share_of(float part, float whole) { return whole > 0.0f ? part / whole : 1.0f; }

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

ObjectPoint object_point(const TracedScene& scene, const glm::vec3& eye, const ObjectHit& hit) {
  const auto& t = scene.triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  const glm::vec3 p[3] = {scene.positions[t[0]], scene.positions[t[1]], scene.positions[t[2]]};
  ObjectPoint point;
  for (int k = 0; k < 3; ++k) {
    point.position += b[k] * p[k];
    point.normal += b[k] * scene.normals[t[k]];
  }
  const glm::vec3 facet = glm::cross(p[1] - p[0], p[2] - p[0]), to_eye = eye - point.position;
  const float length = glm::length(point.normal);
  point.normal = length > 0.0f ? point.normal / length : facet / std::max(glm::length(facet), 1e-30f);
  // The winding decides what is a back, not the normal: interpolated normals turn away at silhouettes.
  point.back = glm::dot(facet, to_eye) < 0.0f && glm::dot(point.normal, to_eye) < 0.0f;
  const float side = point.back ? -1.0f : 1.0f;
  point.normal *= side;
  // A facet of a smooth surface shadows its own neighbours near the terminator. Rays start on the surface that the
  // normals describe: the mean of the point's projections onto the vertices' tangent planes, where these lie outside
  // (Hanika 2021, "Hacking the Shadow Terminator").
  point.start = point.position;
  for (int k = 0; k < 3; ++k) {
    const glm::vec3 n = side * scene.normals[t[k]];
    point.start -= b[k] * std::min(0.0f, glm::dot(point.position - p[k], n)) * n;
  }
  point.start += std::max(2e-5f, 3e-4f * static_cast<float>(scene.sphere.radius)) * point.normal;
  return point;
}

void BlockShader::add_object(const ObjectHit& hit, std::size_t pixel) {
  const ObjectPoint point = object_point(scene_, view_.eye(), hit);
  const int i = objects_.count++;
  set_point(objects_.points, i, point.position, point.normal);
  set_point(objects_.starts, i, point.start, point.normal);
  objects_.pixel[i] = pixel;
  objects_.share[i] = static_cast<float>(hit.samples) / kCoverageSamples;
  objects_.reflectance[i] = objects_.indirect[i] = objects_.open_sky[i] = Rgb(0.0f);
  const auto& t = scene_.triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  for (int k = 0; k < 3; ++k) {
    const VertexLight& l = scene_.light[t[k]];
    objects_.reflectance[i] += b[k] * scene_.reflectance[t[k]];
    objects_.indirect[i] += b[k] * (point.back ? l.indirect_back : l.indirect_front);
    objects_.open_sky[i] += b[k] * (point.back ? l.open_sky_back : l.open_sky_front);
  }
  if (objects_.count == kLanes)
    shade_objects();
}

void BlockShader::add_room(int x, int y, float share, std::size_t pixel) {
  glm::vec3 position;
  const RoomHit hit = view_.uncovered_room(x, y, position);
  if (hit.triangle == kNoTriangle)
    return;
  const glm::vec3 n = scene_.room_normals[hit.triangle];
  const int i = room_.count++;
  set_point(room_.points, i, position, glm::dot(n, view_.eye() - position) < 0.0f ? -n : n);
  room_.pixel[i] = pixel;
  room_.triangle[i] = scene_.room_triangle[hit.triangle];
  room_.share[i] = share;
}

/// Where a block has no corners of its own (outlines), four of its points that lie far apart take their place, when
/// every other point lies on the same smooth piece of surface as they do.
void BlockShader::trace_representatives(const Lanes& l, PointOf point_of) {
  if (!scene_.settings.share_visibility || l.count < kFewestShared)
    return;
  const PointBlock& p = l.points;
  const auto normal = [&](int k) { return glm::vec3(p.nx[k], p.ny[k], p.nz[k]); };
  glm::vec3 mean(0.0f);
  for (int k = 0; k < l.count; ++k)
    mean += normal(k);
  for (int k = 0; k < l.count; ++k)
    if (glm::dot(mean, normal(k)) < kSamePieceCosine * glm::length(mean))
      return;
  if (p.radius > (point_of == PointOf::object ? kSamePieceShare : 1.0f) * casters_.radius)
    return;
  // Extremes along two directions across the block.
  int chosen[4] = {0, 0, 0, 0};
  const OrthonormalBasis basis(glm::dvec3(glm::normalize(mean)));
  const auto along = [&](int k, const glm::dvec3& axis) { return glm::dot(glm::dvec3(p.x[k], p.y[k], p.z[k]), axis); };
  for (int k = 1; k < l.count; ++k) {
    chosen[0] = along(k, basis.u) < along(chosen[0], basis.u) ? k : chosen[0];
    chosen[1] = along(k, basis.u) > along(chosen[1], basis.u) ? k : chosen[1];
    chosen[2] = along(k, basis.v) < along(chosen[2], basis.v) ? k : chosen[2];
    chosen[3] = along(k, basis.v) > along(chosen[3], basis.v) ? k : chosen[3];
  }
  const std::size_t sky = shared_.sky_groups_, groups = sky + shared_.sun_groups_;
  own_bits_.resize(4 * groups);
  for (int c = 0; c < 4; ++c) {
    const int k = chosen[c];
    const PointBlock& from = point_of == PointOf::object ? l.starts : l.points;
    const glm::vec3 start(from.x[k], from.y[k], from.z[k]);
    const std::span<LightBits> bits(own_bits_.data() + static_cast<std::size_t>(c) * groups, groups);
    trace_point(scene_.sky.lights, casters_, start, normal(k), point_of, bits.first(sky), rays_);
    trace_point(scene_.sun.lights, casters_, start, normal(k), point_of, bits.subspan(sky), rays_);
    sky_corners_[c] = bits.first(sky);
    sun_corners_[c] = bits.subspan(sky);
  }
  shared_by_corners_ = true;
}

void BlockShader::shade_objects() {
  const Lanes& l = objects_;
  close_block(objects_.points, l.count);
  close_block(objects_.starts, l.count);
  const bool by_block_corners = shared_by_corners_;
  if (!by_block_corners)
    trace_representatives(l, PointOf::object);
  const LightGates &sky = scene_.sky.lights, &sun = scene_.sun.lights;
  find_blocked_lights(sky, casters_, l.points, l.starts, 0.0f, false, corners(false), sky_blocked_, rays_);
  LaneSums sky_sums, sun_sums; // no light blocked: nothing is lost of the open sky, its sums stay zero
  if (sky_blocked_.lanes != 0 || !casters_.occluders->empty())
    sum_lights(sky, sky_blocked_, casters_, l.points, l.starts, 0.0f, RoomShadow::everywhere, corners(false), sky_sums,
               rays_);
  find_blocked_lights(sun, casters_, l.points, l.starts, 0.0f, false, corners(true), sun_blocked_, rays_);
  sum_lights(sun, sun_blocked_, casters_, l.points, l.starts, 0.0f, RoomShadow::everywhere, corners(true), sun_sums,
             rays_);
  for (int i = 0; i < l.count; ++i) {
    Rgb radiance = l.indirect[i];
    for (int c = 0; c < 3; ++c) {
      const float direct =
          l.open_sky[i][c] * share_of(sky_sums.past_both[c][i], sky_sums.unblocked[c][i]) + sun_sums.past_both[c][i];
      radiance[c] += l.reflectance[i][c] * std::numbers::inv_pi_v<float> * direct;
    }
    frame_.object[l.pixel[i]] += glm::vec4(l.share[i] * radiance, l.share[i]);
  }
  objects_.count = 0;
  shared_by_corners_ = by_block_corners;
}

void BlockShader::shade_room() {
  const Lanes& l = room_;
  close_block(room_.points, l.count);
  const bool by_block_corners = shared_by_corners_;
  if (!by_block_corners)
    trace_representatives(l, PointOf::room);
  const LightGates &sky = scene_.sky.lights, &sun = scene_.sun.lights;
  const PointBlock& p = l.points;
  find_blocked_lights(sky, casters_, p, p, kOwnSurface_m, true, corners(false), sky_blocked_, rays_);
  find_blocked_lights(sun, casters_, p, p, kOwnSurface_m, true, corners(true), sun_blocked_, rays_);
  const std::uint32_t losing = sky_blocked_.lanes | sun_blocked_.lanes;
  if (losing != 0) {
    LaneSums sky_sums, sun_sums;
    sum_lights(sky, sky_blocked_, casters_, p, p, kOwnSurface_m, RoomShadow::where_blocked, {}, sky_sums, rays_);
    sum_lights(sun, sun_blocked_, casters_, p, p, kOwnSurface_m, RoomShadow::everywhere, {}, sun_sums, rays_);
    const Rgb& whole = scene_.sun_normal_irradiance;
    const float per_sun = whole.r + whole.g + whole.b > 0.0f ? 1.0f / (whole.r + whole.g + whole.b) : 0.0f;
    for (int i = 0; i < l.count; ++i) {
      if (!(losing >> i & 1u))
        continue;
      glm::vec4 lost(0.0f, 0.0f, 0.0f, l.share[i]), shares(0.0f);
      for (int c = 0; c < 3; ++c) {
        const float before = share_of(sky_sums.past_room[c][i], sky_sums.unblocked[c][i]);
        lost[c] = l.share[i] * (before - share_of(sky_sums.past_both[c][i], sky_sums.unblocked[c][i]));
        shares.x += l.share[i] * before / 3.0f;
        shares.y += l.share[i] * per_sun * sun_sums.past_room[c][i];
        shares.z += l.share[i] * per_sun * (sun_sums.past_room[c][i] - sun_sums.past_both[c][i]);
      }
      frame_.lost_sky[l.pixel[i]] = lost;
      frame_.room[l.pixel[i]] = shares;
      frame_.surface[l.pixel[i]] = {l.triangle[i], glm::vec3(p.x[i], p.y[i], p.z[i])};
    }
  }
  room_.count = 0;
  shared_by_corners_ = by_block_corners;
}

/// The four corners of a block when all are of a kind and lie on one smooth piece of surface.
bool BlockShader::find_corners(int column, int row, PictureShader::GridPoint::Kind kind) {
  const int columns = view_.block_columns();
  if (!scene_.settings.share_visibility || column + 1 >= columns || row + 1 >= view_.block_rows())
    return false;
  const std::size_t groups = shared_.sky_groups_ + shared_.sun_groups_;
  const PictureShader::GridPoint* first = nullptr;
  for (int k = 0; k < 4; ++k) {
    const std::size_t i = static_cast<std::size_t>(row + k / 2) * columns + (column + k % 2);
    const PictureShader::GridPoint& g = shared_.grid_[i];
    first = k == 0 ? &g : first;
    if (g.kind != kind || glm::dot(g.normal, first->normal) < kSameSideCosine)
      return false;
    if (kind == PictureShader::GridPoint::Kind::room &&
        std::fabs(glm::dot(g.position - first->position, first->normal)) > kSamePlane_m)
      return false;
    const std::span<const LightBits> bits(&shared_.bits_[i * groups], groups);
    sky_corners_[k] = bits.first(shared_.sky_groups_);
    sun_corners_[k] = bits.last(shared_.sun_groups_);
  }
  return true;
}

void BlockShader::shade(int column, int row) {
  const bool receives = shared_.receives_[static_cast<std::size_t>(row) * view_.block_columns() + column] != 0;
  bool has_edge = false, has_object = false;
  shared_by_corners_ = false;
  for (int pass = 0; pass < 2; ++pass) { // what the block shows decides how its points are shaded
    for (int k = 0; k < kLanes; ++k) {
      const int x = column * kBlockSide + k % kBlockSide, y = row * kBlockSide + k / kBlockSide;
      if (!frame_.box.contains(x, y))
        continue;
      const bool edge = view_.is_edge(x, y);
      const ObjectHit& hit = view_.object(x, y);
      if (pass == 0) {
        has_edge = has_edge || edge;
        has_object = has_object || hit.samples > 0;
        continue;
      }
      int covered = edge ? 0 : hit.samples;
      const std::size_t pixel = frame_.index(x, y);
      if (edge)
        for (const ObjectHit& part : view_.edge_hits(x, y)) {
          covered += part.samples;
          add_object(part, pixel);
        }
      else if (hit.samples > 0)
        add_object(hit, pixel);
      if (receives && covered < kCoverageSamples)
        add_room(x, y, 1.0f - static_cast<float>(covered) / kCoverageSamples, pixel);
    }
    if (pass == 0 && !has_object && !receives)
      return;
    if (pass == 0 && !has_edge)
      shared_by_corners_ = find_corners(
          column, row, has_object ? PictureShader::GridPoint::Kind::object : PictureShader::GridPoint::Kind::room);
  }
  if (objects_.count > 0)
    shade_objects();
  if (room_.count > 0)
    shade_room();
}

} // namespace daylit
