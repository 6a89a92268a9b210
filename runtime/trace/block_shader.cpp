#include "runtime/trace/block_shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

// A grid point speaks for points nearby on the same smooth piece of surface.
constexpr float kSameSideCosine = 0.8f;
constexpr float kSamePieceShare = 0.2f; // of the objects' radius, metres apart
constexpr float kSamePlane_m = 1e-3f;
constexpr float kLeastWeight = 0.2f; // of the four corners together
constexpr float kSteepShare = 0.35f; // corners that differ by more do not speak for what is between: contact shadows

/// Part of a whole, 1 where there is no whole.
float share_of(float part, float whole) { return whole > 0.0f ? part / whole : 1.0f; }

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

bool BlockShader::speaks_for(const GridPoint& g, GridPoint::Kind kind, const glm::vec3& position,
                             const glm::vec3& normal) const {
  if (g.kind != kind || glm::dot(g.normal, normal) < kSameSideCosine)
    return false;
  const glm::vec3 d = position - g.position;
  return kind == GridPoint::Kind::room ? std::fabs(glm::dot(d, normal)) < kSamePlane_m
                                       : glm::dot(d, d) < std::pow(kSamePieceShare * casters_.radius, 2.0f);
}

/// Bilinear between the corners of the pixel's block that lie on its piece of surface.
BlockShader::SkyShare BlockShader::interpolate(GridPoint::Kind kind, int x, int y, const glm::vec3& position,
                                               const glm::vec3& normal) const {
  SkyShare share;
  if (!scene_.settings.share_visibility)
    return share;
  const int columns = view_.block_columns(), column = x / kBlockSide, row = y / kBlockSide;
  const float s = static_cast<float>(x % kBlockSide) / kBlockSide, t = static_cast<float>(y % kBlockSide) / kBlockSide;
  const float weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  Rgb before(0.0f), after(0.0f);
  float sum = 0.0f, least = 1.0f, most = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const int u = column + (k & 1), v = row + (k >> 1);
    if (weight[k] <= 0.0f || u >= columns || v >= view_.block_rows())
      continue;
    const GridPoint& g = shared_.grid_[static_cast<std::size_t>(v) * columns + u];
    if (!speaks_for(g, kind, position, normal))
      continue;
    before += weight[k] * g.before;
    after += weight[k] * g.after;
    sum += weight[k];
    least = std::min(least, g.after.g);
    most = std::max(most, g.after.g);
  }
  if (sum < kLeastWeight || most - least > kSteepShare)
    return share;
  return {before / sum, after / sum, true};
}

void BlockShader::add_object(const ObjectHit& hit, int x, int y) {
  const ObjectPoint point = object_point(scene_, view_.eye(), hit);
  const SkyShare sky = interpolate(GridPoint::Kind::object, x, y, point.position, point.normal);
  Lanes& l = sky.known ? objects_ : outlines_;
  const int i = l.count++;
  l.points.set(i, point.position, point.normal);
  l.starts.set(i, point.start, point.normal);
  l.sky[i] = sky;
  l.unknown |= l.sky[i].known ? 0u : 1u << i;
  l.pixel[i] = frame_.index(x, y);
  l.coverage[i] = static_cast<float>(hit.samples) / kCoverageSamples;
  l.reflectance[i] = l.indirect[i] = l.open_sky[i] = Rgb(0.0f);
  const auto& t = scene_.triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  for (int k = 0; k < 3; ++k) {
    const VertexLight& v = scene_.light[t[k]];
    l.reflectance[i] += b[k] * scene_.reflectance[t[k]];
    l.indirect[i] += b[k] * (point.back ? v.indirect_back : v.indirect_front);
    l.open_sky[i] += b[k] * (point.back ? v.open_sky_back : v.open_sky_front);
  }
  if (l.count == kLanes)
    shade_objects(l, sky.known ? sun_corner_count_ : 0);
}

void BlockShader::add_room(int x, int y, float coverage) {
  glm::vec3 position;
  const RoomHit hit = view_.uncovered_room(x, y, position);
  if (hit.triangle == kNoTriangle)
    return;
  glm::vec3 n = scene_.room_normals[hit.triangle];
  n = glm::dot(n, view_.eye() - position) < 0.0f ? -n : n;
  const SkyShare sky = interpolate(GridPoint::Kind::room, x, y, position, n);
  if (sky.known && sky.before == sky.after && scene_.sun.lights.size() == 0)
    return; // nothing is lost here
  Lanes& l = room_;
  const int i = l.count++;
  l.points.set(i, position, n);
  l.sky[i] = sky;
  l.unknown |= sky.known ? 0u : 1u << i;
  l.pixel[i] = frame_.index(x, y);
  l.triangle[i] = scene_.room_triangle[hit.triangle];
  l.coverage[i] = coverage;
}

/// Shares of the lanes that no grid point speaks for.
void BlockShader::trace_unknown(Lanes& l, bool on_object) {
  if (l.unknown == 0)
    return;
  const std::uint32_t all = l.points.lanes;
  const PointBlock& starts = on_object ? l.starts : l.points;
  const float tnear = on_object ? 0.0f : kOwnSurface_m;
  const LightGates& lights = scene_.sky.lights;
  l.points.lanes = l.unknown;
  find_blocked_lights(lights, casters_, l.points, starts, tnear, !on_object, {}, sky_blocked_, rays_);
  LaneSums sums; // no light blocked: nothing is lost of the open sky, its sums stay zero
  if (sky_blocked_.lanes != 0 || (on_object && lights.room_may_block_any()))
    sum_lights(lights, sky_blocked_, casters_, l.points, starts, tnear,
               on_object ? RoomShadow::on_objects : RoomShadow::where_blocked, {}, sums, rays_);
  l.points.lanes = all;
  for (int i = 0; i < l.count; ++i)
    for (int c = 0; c < 3 && (l.unknown >> i & 1u); ++c) {
      l.sky[i].before[c] = share_of(sums.past_room[c][i], sums.unblocked[c][i]);
      l.sky[i].after[c] = share_of(sums.past_both[c][i], sums.unblocked[c][i]);
    }
  l.unknown = 0;
}

void BlockShader::shade_objects(Lanes& l, std::size_t sun_corner_count) {
  l.points.close(l.count);
  l.starts.close(l.count);
  trace_unknown(l, true);
  const LightGates& sun = scene_.sun.lights;
  const std::span<const std::span<const LightBits>> corners(sun_corners_.data(), sun_corner_count);
  LaneSums sums;
  if (sun.size() > 0) {
    find_blocked_lights(sun, casters_, l.points, l.starts, 0.0f, false, corners, sun_blocked_, rays_);
    sum_lights(sun, sun_blocked_, casters_, l.points, l.starts, 0.0f, RoomShadow::on_objects, corners, sums, rays_);
  }
  for (int i = 0; i < l.count; ++i) {
    Rgb direct = l.open_sky[i] * l.sky[i].after;
    for (int c = 0; c < 3; ++c)
      direct[c] += sums.past_both[c][i];
    const Rgb radiance = l.indirect[i] + l.reflectance[i] * std::numbers::inv_pi_v<float> * direct;
    frame_.object[l.pixel[i]] += glm::vec4(l.coverage[i] * radiance, l.coverage[i]);
  }
  l.count = 0;
}

void BlockShader::shade_room() {
  Lanes& l = room_;
  l.points.close(l.count);
  trace_unknown(l, false);
  const LightGates& sun = scene_.sun.lights;
  const PointBlock& p = l.points;
  const std::span<const std::span<const LightBits>> corners(sun_corners_.data(), sun_corner_count_);
  LaneSums sums;
  if (sun.size() > 0) {
    find_blocked_lights(sun, casters_, p, p, kOwnSurface_m, true, corners, sun_blocked_, rays_);
    sum_lights(sun, sun_blocked_, casters_, p, p, kOwnSurface_m, RoomShadow::everywhere, {}, sums, rays_);
  }
  const Rgb& whole = scene_.sun_normal_irradiance;
  const float per_sun = whole.r + whole.g + whole.b > 0.0f ? 1.0f / (whole.r + whole.g + whole.b) : 0.0f;
  for (int i = 0; i < l.count; ++i) {
    const float w = l.coverage[i];
    glm::vec4 lost(w * (l.sky[i].before - l.sky[i].after), w), shares(0.0f);
    for (int c = 0; c < 3; ++c) {
      shares.x += w * l.sky[i].before[c] / 3.0f;
      shares.y += w * per_sun * sums.past_room[c][i];
      shares.z += w * per_sun * (sums.past_room[c][i] - sums.past_both[c][i]);
    }
    frame_.lost_sky[l.pixel[i]] = lost;
    frame_.room[l.pixel[i]] = shares;
    frame_.surface[l.pixel[i]] = {l.triangle[i], glm::vec3(p.x[i], p.y[i], p.z[i])};
  }
  l.count = 0;
}

/// The four corners of a block when all are of a kind and on one piece of surface: what they agree on of the sun, whose
/// shadows are too sharp for interpolation, holds between them.
bool BlockShader::find_sun_corners(int column, int row, GridPoint::Kind kind) {
  const int columns = view_.block_columns();
  if (shared_.sun_groups_ == 0 || !scene_.settings.share_visibility || column + 1 >= columns ||
      row + 1 >= view_.block_rows())
    return false;
  const GridPoint& first = shared_.grid_[static_cast<std::size_t>(row) * columns + column];
  for (int k = 0; k < 4; ++k) {
    const std::size_t i = static_cast<std::size_t>(row + k / 2) * columns + (column + k % 2);
    if (!shared_.grid_[i].receives || !speaks_for(shared_.grid_[i], kind, first.position, first.normal))
      return false;
    sun_corners_[k] = {&shared_.sun_bits_[i * shared_.sun_groups_], shared_.sun_groups_};
  }
  return true;
}

void BlockShader::shade(int column, int row) {
  const bool receives = shared_.receives_[static_cast<std::size_t>(row) * view_.block_columns() + column] != 0;
  const PixelBox pixels{column * kBlockSide, row * kBlockSide, std::min((column + 1) * kBlockSide, frame_.box.x1),
                        std::min((row + 1) * kBlockSide, frame_.box.y1)};
  bool has_edge = false, has_object = false;
  for (int y = std::max(pixels.y0, frame_.box.y0); y < pixels.y1; ++y)
    for (int x = std::max(pixels.x0, frame_.box.x0); x < pixels.x1; ++x) {
      has_edge = has_edge || view_.is_edge(x, y);
      has_object = has_object || view_.object(x, y).samples > 0;
    }
  if (!has_object && !receives)
    return;
  const GridPoint::Kind kind = has_object ? GridPoint::Kind::object : GridPoint::Kind::room;
  sun_corner_count_ = !has_edge && find_sun_corners(column, row, kind) ? 4 : 0;
  for (int y = std::max(pixels.y0, frame_.box.y0); y < pixels.y1; ++y)
    for (int x = std::max(pixels.x0, frame_.box.x0); x < pixels.x1; ++x) {
      int covered = 0;
      if (view_.is_edge(x, y)) {
        for (const ObjectHit& part : view_.edge_hits(x, y)) {
          covered += part.samples;
          add_object(part, x, y);
        }
      } else if (const ObjectHit& hit = view_.object(x, y); hit.samples > 0) {
        covered = hit.samples;
        add_object(hit, x, y);
      }
      if (receives && covered < kCoverageSamples)
        add_room(x, y, 1.0f - static_cast<float>(covered) / kCoverageSamples);
    }
  if (objects_.count > 0)
    shade_objects(objects_, sun_corner_count_);
  if (room_.count > 0)
    shade_room();
}

void BlockShader::finish_row() {
  if (outlines_.count > 0)
    shade_objects(outlines_, 0);
}

} // namespace daylit
