#include "runtime/trace/block_shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "runtime/trace/object_point.h"

namespace daylit {

namespace {

static_assert(kBlockSide == RenderedFrame::kBlock);

constexpr float kLeastWeight = 0.2f; // of the four corners together
constexpr float kSteepShare = 0.35f; // corners that differ by more do not speak for what is between: contact shadows

/// Part of a whole, 1 where there is no whole.
float share_of(float part, float whole) { return whole > 0.0f ? part / whole : 1.0f; }

} // namespace

/// Bilinear between the corners of the pixel's block that lie on its piece of surface.
BlockShader::SkyShare BlockShader::interpolate(Layer layer, int x, int y, const glm::vec3& position,
                                               const glm::vec3& normal) const {
  SkyShare share;
  if (grid_.empty())
    return share;
  const int columns = view_.block_columns(), column = x / kBlockSide, row = y / kBlockSide;
  const float s = static_cast<float>(x % kBlockSide) / kBlockSide, t = static_cast<float>(y % kBlockSide) / kBlockSide;
  const float weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  Rgb before(0.0f), after(0.0f);
  float sum = 0.0f, least = 1.0f, most = 0.0f;
  bool by_another_part = false; // here surfaces may touch
  for (int k = 0; k < 4; ++k) {
    const int u = column + (k & 1), v = row + (k >> 1);
    if (u >= columns || v >= view_.block_rows())
      continue;
    const GridPoint& g = grid_.at(layer, u, v);
    if (!speaks_for(g, layer, position, normal, casters_.radius)) {
      by_another_part = by_another_part || g.exists;
      continue;
    }
    if (weight[k] <= 0.0f)
      continue;
    before += weight[k] * g.before;
    after += weight[k] * g.after;
    sum += weight[k];
    least = std::min(least, g.after.g);
    most = std::max(most, g.after.g);
  }
  // The room beside an object: what its hidden corners would say is the shadow where both touch.
  share.between = sum > 0.999f;
  // So does a part of an object beside another.
  const float wanted = layer == Layer::room || by_another_part ? 0.999f : kLeastWeight;
  if (sum < wanted || most - least > kSteepShare)
    return share;
  const float whole = 1.0f / sum;
  return {whole * before, whole * after, true, share.between};
}

/// Light of the vertices at a point between them.
BlockShader::ObjectLight BlockShader::light_at(const ObjectHit& hit, bool back) const {
  ObjectLight light;
  const auto& t = scene_.triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  for (int k = 0; k < 3; ++k) {
    const VertexLight& v = scene_.light[t[k]];
    light.reflectance += b[k] * scene_.reflectance[t[k]];
    light.indirect += b[k] * (back ? v.indirect_back : v.indirect_front);
    light.open_sky += b[k] * (back ? v.open_sky_back : v.open_sky_front);
  }
  return light;
}

void BlockShader::show(const ObjectLight& light, const Rgb& direct, std::size_t pixel, float coverage) {
  const Rgb radiance = light.indirect + light.reflectance * std::numbers::inv_pi_v<float> * direct;
  frame_.object[pixel] += glm::vec4(coverage * radiance, coverage);
}

void BlockShader::add_object(const ObjectHit& hit, int x, int y) {
  const ObjectPoint point = object_point(scene_, view_.eye(), hit);
  const SkyShare sky = interpolate(Layer::object, x, y, point.position, point.normal);
  const ObjectLight light = light_at(hit, point.back);
  const float coverage = static_cast<float>(hit.samples) / kCoverageSamples;
  if (sky.known && scene_.sun.lights.size() == 0) // nothing is left to ask
    return show(light, light.open_sky * sky.after, frame_.index(x, y), coverage);
  Lanes& l = sky.known ? objects_ : outlines_;
  const int i = l.count++;
  l.points.set(i, point.position, point.normal);
  l.starts.set(i, ray_start(scene_, hit, point), point.normal);
  l.sky[i] = sky;
  if (!sky.known) {
    l.unknown |= 1u << i;
    hint(l, Layer::object, x, y, point.position, point.normal);
    if (!point.back)
      scene_.tell_own_visibility(hit.triangle, i, l.hints);
  }
  l.pixel[i] = frame_.index(x, y);
  l.coverage[i] = coverage;
  l.light[i] = light;
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
  const SkyShare sky = interpolate(Layer::room, x, y, position, n);
  if (sky.known && sky.before == sky.after && scene_.sun.lights.size() == 0)
    return; // nothing is lost here
  Lanes& l = room_;
  const int i = l.count++;
  l.points.set(i, position, n);
  l.sky[i] = sky;
  if (!sky.known) {
    l.unknown |= 1u << i;
    if (sky.between)
      hint(l, Layer::room, x, y, position, n);
  }
  l.pixel[i] = frame_.index(x, y);
  l.triangle[i] = scene_.room_triangle[hit.triangle];
  l.coverage[i] = coverage;
}

/// Asks the traced grid points around for the newest lane. Where they lie about the normal does not matter here, only
/// what stands before them.
void BlockShader::hint(Lanes& l, Layer layer, int x, int y, const glm::vec3& position, const glm::vec3& normal) {
  if (grid_.empty())
    return;
  neighbours_.clear();
  const int columns = view_.block_columns(), column = x / kBlockSide, row = y / kBlockSide;
  for (int v = std::max(row - 1, 0); v <= std::min(row + 2, view_.block_rows() - 1); ++v)
    for (int u = std::max(column - 1, 0); u <= std::min(column + 2, columns - 1); ++u) {
      const GridPoint& g = grid_.at(layer, u, v);
      if (g.traced && stands_by(g, layer, position, normal, casters_.radius))
        neighbours_.push_back(grid_.sky_words(layer, u, v));
    }
  l.hints.set(l.count - 1, neighbours_);
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
  find_blocked_lights(lights, casters_, l.points, starts, tnear, !on_object, {}, l.hints.verdicts(), sky_blocked_,
                      rays_);
  l.hints.reset(lights.size());
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
    find_blocked_lights(sun, casters_, l.points, l.starts, 0.0f, false, corners, {}, sun_blocked_, rays_);
    sum_lights(sun, sun_blocked_, casters_, l.points, l.starts, 0.0f, RoomShadow::on_objects, corners, sums, rays_);
  }
  for (int i = 0; i < l.count; ++i) {
    Rgb direct = l.light[i].open_sky * l.sky[i].after;
    for (int c = 0; c < 3; ++c)
      direct[c] += sums.past_both[c][i];
    show(l.light[i], direct, l.pixel[i], l.coverage[i]);
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
    find_blocked_lights(sun, casters_, p, p, kOwnSurface_m, true, corners, {}, sun_blocked_, rays_);
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
bool BlockShader::find_sun_corners(int column, int row, Layer layer) {
  if (scene_.sun.lights.size() == 0 || grid_.empty() || column + 1 >= grid_.columns() || row + 1 >= grid_.rows())
    return false;
  const GridPoint& first = grid_.at(layer, column, row);
  for (int k = 0; k < 4; ++k) {
    const int u = column + k % 2, v = row + k / 2;
    const GridPoint& g = grid_.at(layer, u, v);
    if (!g.receives || !speaks_for(g, layer, first.position, first.normal, casters_.radius))
      return false;
    sun_corners_[k] = grid_.sun_bits(layer, u, v);
  }
  return true;
}

std::array<const GridPoint*, 4> BlockShader::plain_corners(int column, int row) const {
  if (grid_.empty() || scene_.sun.lights.size() > 0 || !view_.is_plain(column, row) || column + 1 >= grid_.columns() ||
      row + 1 >= grid_.rows())
    return {};
  std::array<const GridPoint*, 4> corners{};
  float least = 1.0f, most = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const GridPoint& g = grid_.at(Layer::room, column + k % 2, row + k / 2);
    if (!g.exists)
      return {};
    corners[static_cast<std::size_t>(k)] = &g;
    least = std::min(least, g.after.g);
    most = std::max(most, g.after.g);
  }
  return most - least > kSteepShare ? std::array<const GridPoint*, 4>{} : corners;
}

/// The same as asking interpolate() for each pixel.
void BlockShader::shade_plain(const std::array<const GridPoint*, 4>& corners, const PixelBox& pixels) {
  constexpr float kStep = 1.0f / kBlockSide;
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    const float t = kStep * static_cast<float>(y % kBlockSide);
    const Rgb left = (1 - t) * corners[0]->before + t * corners[2]->before,
              right = (1 - t) * corners[1]->before + t * corners[3]->before,
              left_after = (1 - t) * corners[0]->after + t * corners[2]->after,
              right_after = (1 - t) * corners[1]->after + t * corners[3]->after;
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      const float s = kStep * static_cast<float>(x % kBlockSide);
      const Rgb before = (1 - s) * left + s * right, after = (1 - s) * left_after + s * right_after;
      const RoomHit& hit = view_.room(x, y);
      const std::size_t i = frame_.index(x, y);
      frame_.object[i] = glm::vec4(0.0f);
      frame_.lost_sky[i] = glm::vec4(before - after, 1.0f);
      frame_.room[i] = glm::vec4((before.r + before.g + before.b) / 3.0f, 0.0f, 0.0f, 0.0f);
      frame_.surface[i] = {scene_.room_triangle[hit.triangle],
                           view_.eye() + hit.depth * view_.direction(static_cast<float>(x), static_cast<float>(y))};
    }
  }
}

/// The pixels of a block show nothing yet.
void BlockShader::start_block(const PixelBox& pixels) {
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    const std::size_t first = frame_.index(pixels.x0, y);
    for (auto* pass : {&frame_.object, &frame_.lost_sky, &frame_.room})
      std::fill_n(&(*pass)[first], pixels.width(), glm::vec4(0.0f));
    std::fill_n(&frame_.surface[first], pixels.width(), RoomSurface{});
  }
}

void BlockShader::shade(int column, int row) {
  const bool receives = receives_[static_cast<std::size_t>(row) * view_.block_columns() + column] != 0;
  const PixelBox pixels =
      frame_.box.common({column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide});
  bool has_edge = false, has_object = false;
  const PixelBox objects = pixels.common(view_.object_box());
  for (int y = objects.y0; y < objects.y1; ++y)
    for (int x = objects.x0; x < objects.x1; ++x) {
      has_edge = has_edge || view_.is_edge(x, y);
      has_object = has_object || view_.object(x, y).samples > 0;
    }
  if (!has_object && !receives)
    return;
  const auto plain = has_object || has_edge ? std::array<const GridPoint*, 4>{} : plain_corners(column, row);
  if (plain[0] && std::all_of(plain.begin(), plain.end(), [](const GridPoint* g) { return g->before == g->after; }))
    return;
  frame_.shows[frame_.block_index(pixels.x0, pixels.y0)] = 1;
  if (plain[0])
    return shade_plain(plain, pixels);
  start_block(pixels);
  const Layer layer = has_object ? Layer::object : Layer::room;
  sun_corner_count_ = !has_edge && find_sun_corners(column, row, layer) ? 4 : 0;
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x) {
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
