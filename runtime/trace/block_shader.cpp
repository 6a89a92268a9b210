#include "runtime/trace/block_shader.h"

#include <algorithm>
#include <array>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "runtime/trace/surface_points.h"

namespace daylit {

static_assert(kBlockSide == SamplingGrid::kBlockSide);

BlockShader::BlockShader(const SamplingGrid& grid, const RayVisibility& visibility,
                         std::span<const std::uint8_t> receives, const TracedScene& scene, const VisibleSurfaces& view,
                         RenderedFrame& frame)
    : grid_(grid), visibility_(visibility), receives_(receives), scene_(scene), view_(view), frame_(frame),
      casters_(scene.casters()) {
  for (Batch* batch : {&objects_, &outlines_, &room_})
    batch->set.hints.reset(scene.sky.size());
}

/// Light of the vertices at a point between them.
BlockShader::ObjectLight BlockShader::light_at(const ObjectHit& hit, bool back) const {
  ObjectLight light;
  const auto& t = scene_.triangles[hit.triangle];
  const std::array<float, 3> b = scene_.light_weights(hit.triangle, hit.u, hit.v, hit.depth, view_.pixel_pitch());
  for (std::size_t k = 0; k < 3; ++k) {
    if (b[k] == 0.0f)
      continue;
    const VertexLight& v = scene_.light[t[k]];
    light.reflectance += b[k] * scene_.reflectance[t[k]];
    light.indirect += b[k] * (back ? v.indirect_back : v.indirect_front);
    light.open_sky += b[k] * (back ? v.open_sky_back : v.open_sky_front);
  }
  return light;
}

/// Radiance of a diffuse surface: indirect + reflectance / pi x irradiance.
void BlockShader::show(const ObjectLight& light, const Rgb& direct, const glm::ivec2& pixel, float coverage) {
  const Rgb radiance = light.indirect + light.reflectance * std::numbers::inv_pi_v<float> * direct;
  frame_.at(pixel.x, pixel.y).object += glm::vec4(coverage * radiance, coverage);
}

/// Returns the point's lane. What is not known of the sky will be looked for.
int BlockShader::add_point(Batch& batch, const PixelSurface& at, const SamplingGrid::Interpolated& sky, int x, int y,
                           float coverage) {
  const int lane = batch.set.add(at);
  batch.set.sky[lane] = sky.sky;
  batch.unknown |= sky.is_known ? 0u : 1u << lane;
  batch.pixel[lane] = {x, y};
  batch.coverage[lane] = coverage;
  batch.places[lane] = 0;
  return lane;
}

void BlockShader::add_object(const ObjectHit& hit, int x, int y) {
  const float coverage = static_cast<float>(hit.samples) / kCoverageSamples;
  if (scene_.is_black(hit.triangle))
    return show({}, Rgb(0.0f), {x, y}, coverage);
  const PixelSurface at = object_surface(scene_, view_.eye(), hit);
  const auto sky = grid_.interpolate(Layer::object, x, y, at.position, at.normal);
  const ObjectLight light = light_at(hit, at.back);
  if (sky.is_known && scene_.sun.size() == 0) // nothing is left to look for
    return show(light, light.open_sky * sky.sky.past_both, {x, y}, coverage);
  Batch& b = sky.is_known ? objects_ : outlines_;
  const int lane = add_point(b, at, sky, x, y, coverage);
  b.light[lane] = light;
  b.places[lane] = hit.places;
  b.below[lane] = glm::dot(at.sharp_facet, scene_.sun.cone.axis) < 0.0f;
  if (!sky.is_known)
    grid_.add_hints(Layer::object, x, y, at.position, at.normal, lane, b.set.hints);
  if (b.set.count == kLanes)
    shade_objects(b, sky.is_known ? sun_corners_ : SamplingGrid::SunCorners{});
}

/// Returns the point's lane. What is not known of the sky will be looked for.
int BlockShader::add_room_point(const PixelSurface& at, const SamplingGrid::Interpolated& sky, std::uint32_t triangle,
                                int x, int y, float coverage) {
  if (room_.set.count == kLanes)
    shade_room();
  const int lane = add_point(room_, at, sky, x, y, coverage);
  room_.triangle[lane] = scene_.room_triangle[triangle];
  room_.part[lane] = kWhole;
  if (!sky.is_known && sky.is_between)
    grid_.add_hints(Layer::room, x, y, at.position, at.normal, lane, room_.set.hints);
  return lane;
}

/// One point for each surface. What objects cover of them is known in eighths of the pixel, so that what is shown is
/// brought to `coverage`, the part of the pixel that shows the room.
void BlockShader::add_room_parts(int x, int y, std::span<const RoomPart> parts, float coverage) {
  std::array<PixelSurface, kMostRoomParts> at;
  std::array<SamplingGrid::Interpolated, kMostRoomParts> sky;
  bool any = scene_.sun.size() > 0;
  float uncovered = 0.0f;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    at[k] = room_surface(scene_, view_.eye(), parts[k].triangle, parts[k].position, true);
    sky[k] = grid_.interpolate(Layer::room, x, y, at[k].position, at[k].normal);
    any = any || !sky[k].is_known || sky[k].sky.past_room != sky[k].sky.past_both;
    uncovered += parts[k].fraction * parts[k].uncovered;
  }
  if (!any)
    return; // nothing is lost here
  const std::uint32_t first = frame_.part_count(y);
  const std::span<DrawnPart> drawn = frame_.add_parts(x, y, parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    drawn[k].position = scene_.origin + glm::dvec3(parts[k].position);
    drawn[k].shown = coverage * parts[k].fraction * (uncovered > 0.0f ? parts[k].uncovered / uncovered : 1.0f);
    const int lane = add_room_point(at[k], sky[k], parts[k].triangle, x, y, parts[k].fraction);
    room_.part[lane] = first + static_cast<std::uint32_t>(k);
  }
}

void BlockShader::add_room(int x, int y, float coverage) {
  if (const auto parts = view_.room_parts(x, y); !parts.empty())
    return add_room_parts(x, y, parts, coverage);
  glm::vec3 position;
  const RoomHit hit = view_.uncovered_room(x, y, position);
  if (hit.triangle == kNoTriangle)
    return;
  const PixelSurface at = room_surface(scene_, view_.eye(), hit.triangle, position, true);
  const auto sky = grid_.interpolate(Layer::room, x, y, at.position, at.normal);
  if (sky.is_known && sky.sky.past_room == sky.sky.past_both && scene_.sun.size() == 0)
    return; // nothing is lost here
  const int lane = add_room_point(at, sky, hit.triangle, x, y, coverage);
  room_.places[lane] = view_.is_edge(x, y) ? view_.uncovered_places(x, y) : 0;
}

void BlockShader::see_sky(Batch& b, Layer layer) {
  if (b.unknown == 0)
    return;
  SkyFractions known[kLanes];
  std::copy_n(b.set.sky, kLanes, known);
  const LaneMask all = std::exchange(b.set.points.lanes, b.unknown);
  rays_ += visibility_.see_sky(layer, b.set);
  b.set.points.lanes = all;
  b.set.hints.reset(scene_.sky.size());
  for (int k = 0; k < b.set.count; ++k)
    if (!(b.unknown >> k & 1u))
      b.set.sky[k] = known[k];
  b.unknown = 0;
}

/// Where shadow rays start from the surface that sample `place` of an edge pixel shows: of the room, on the plane
/// through x, t = n.(x - eye) / n.w along the sample's ray w.
glm::vec3 BlockShader::start_of_sample(Layer layer, const glm::ivec2& pixel, std::size_t place, const glm::vec3& x,
                                       const glm::vec3& n) const {
  if (layer == Layer::object)
    return object_surface(scene_, view_.eye(), view_.edge_samples(pixel.x, pixel.y)[place]).start;
  const glm::vec3 w = view_.sample_direction(pixel.x, pixel.y, place);
  const float height = glm::dot(n, x - view_.eye()), along = glm::dot(n, w);
  return along * height > 0.0f ? view_.eye() + w * (height / along) : x;
}

/// In an edge pixel the lights of the sun start at the samples for which the point stands, one after another: in folds
/// narrower than a pixel some are lit.
bool BlockShader::spread_over_samples(const Batch& b, Layer layer, int lane) {
  if (b.places[lane] == 0)
    return false;
  const PointBlock& p = b.set.points;
  const glm::vec3 x(p.x[lane], p.y[lane], p.z[lane]), n(p.nx[lane], p.ny[lane], p.nz[lane]);
  std::array<glm::vec3, kCoverageSamples> start;
  std::size_t count = 0;
  for (std::size_t s = 0; s < start.size(); ++s)
    if (b.places[lane] >> s & 1u)
      start[count++] = start_of_sample(layer, b.pixel[lane], s, x, n);
  for (std::size_t j = 0; j < sun_starts_.size(); ++j) {
    const glm::vec3& from = start[j % count];
    PointBlock& block = sun_starts_[j];
    block.x[lane] = from.x;
    block.y[lane] = from.y;
    block.z[lane] = from.z;
    block.radius = std::max(block.radius, p.radius + glm::distance(from, x));
  }
  return true;
}

/// Each light of the sun starts elsewhere in the pixel (R2 sequence, Roberts 2018): the edge of a shadow is smoothed
/// over the pixel, as a camera does; in an edge pixel over what the point stands for.
RayStarts BlockShader::spread_over_pixels(const Batch& b, Layer layer, const PointBlock& starts) {
  sun_starts_.assign(scene_.sun.size(), starts);
  for (int k = 0; k < b.set.count; ++k) {
    if (spread_over_samples(b, layer, k))
      continue;
    const PointBlock& p = b.set.points;
    const glm::vec3 x(p.x[k], p.y[k], p.z[k]), n(p.nx[k], p.ny[k], p.nz[k]);
    const PixelFootprint footprint = layer == Layer::room ? room_footprint(view_, x, n, b.pixel[k])
                                                          : object_footprint(scene_, view_, x, n, b.pixel[k]);
    const float reach = glm::length(footprint.right) + glm::length(footprint.down);
    for (std::size_t j = 0; j < sun_starts_.size(); ++j) {
      const glm::vec3 step =
          footprint.step(glm::fract(0.5f + static_cast<float>(j) * glm::vec2(0.754877666f, 0.569840291f)) - 0.5f);
      PointBlock& block = sun_starts_[j];
      block.x[k] += step.x;
      block.y[k] += step.y;
      block.z[k] += step.z;
      block.radius = std::max(block.radius, starts.radius + reach);
    }
  }
  return RayStarts(std::span<const PointBlock>(sun_starts_));
}

/// Irradiance from the sun; zero without one.
lanes::LightSums BlockShader::sum_sun(const Batch& b, Layer layer, const SamplingGrid::SunCorners& corners) {
  lanes::LightSums sums;
  if (scene_.sun.size() == 0)
    return sums;
  for (auto [hints, known] : {std::pair{&sun_hints_, &corners.objects}, {&sun_room_hints_, &corners.room}}) {
    hints->reset(scene_.sun.size());
    hints->believe_corners({known->data(), corners.count});
  }
  const PointBlock &points = b.set.points, &middle = layer == Layer::object ? b.set.starts : points;
  const bool known = sun_hints_.know_all(points.lanes);
  const RayStarts starts = known ? RayStarts(middle) : spread_over_pixels(b, layer, middle);
  rays_ += find_blocked_lights(scene_.sun, casters_, layer, points, starts, sun_hints_.verdicts(), sun_blocked_);
  const auto room_hints = layer == Layer::object ? sun_room_hints_.verdicts() : std::span<const LaneVerdict>{};
  rays_ += sum_lights(scene_.sun, sun_blocked_, casters_, layer, points, starts, room_hints, sums);
  return sums;
}

void BlockShader::shade_objects(Batch& b, const SamplingGrid::SunCorners& corners) {
  b.set.points.close(b.set.count);
  b.set.starts.close(b.set.count);
  see_sky(b, Layer::object);
  const lanes::LightSums sun = sum_sun(b, Layer::object, corners);
  for (int i = 0; i < b.set.count; ++i) {
    Rgb direct = b.light[i].open_sky * b.set.sky[i].past_both;
    for (int c = 0; c < 3 && !b.below[i]; ++c)
      direct[c] += sun.past_both.channel[c][i];
    show(b.light[i], direct, b.pixel[i], b.coverage[i]);
  }
  b.set.count = 0;
}

void BlockShader::shade_room() {
  Batch& b = room_;
  b.set.points.close(b.set.count);
  see_sky(b, Layer::room);
  const lanes::LightSums sun = sum_sun(b, Layer::room, sun_corners_);
  const Rgb& whole = scene_.sun_normal_irradiance;
  const float per_sun = whole.r + whole.g + whole.b > 0.0f ? 1.0f / (whole.r + whole.g + whole.b) : 0.0f;
  for (int i = 0; i < b.set.count; ++i) {
    const float w = b.coverage[i];
    const SkyFractions& sky = b.set.sky[i];
    DrawnPixel pixel;
    for (int c = 0; c < 3; ++c) {
      pixel.received.x += w * sky.past_room[c] / 3.0f;
      pixel.received.y += w * per_sun * sun.past_room.channel[c][i];
    }
    pixel.lost_sky = glm::vec4(w * (sky.past_room - sky.past_both), w);
    for (int c = 0; c < 3; ++c)
      if (const float past_room = sun.past_room.channel[c][i]; past_room > 0.0f)
        pixel.lost_sun[c] = pixel.received.y * (1.0f - sun.past_both.channel[c][i] / past_room);
    pixel.triangle = b.triangle[i];
    show_room(pixel, b.pixel[i], b.part[i]);
  }
  b.set.count = 0;
}

/// A pixel's fractions are the sums of those of its surfaces, each with its part that shows.
void BlockShader::show_room(const DrawnPixel& light, const glm::ivec2& pixel, std::uint32_t part) {
  DrawnPixel& sum = frame_.at(pixel.x, pixel.y);
  float shown = 1.0f;
  if (part != kWhole) {
    DrawnPart& drawn = frame_.part(pixel.y, part);
    drawn.light = light;
    shown = drawn.shown / light.lost_sky.w;
  }
  sum.lost_sky += shown * light.lost_sky;
  sum.received += shown * light.received;
  sum.lost_sun += shown * light.lost_sun;
  sum.triangle = light.triangle;
}

/// The same as SamplingGrid::interpolate() for each pixel.
void BlockShader::shade_plain(const SamplingGrid::Corners& corners, const PixelBox& pixels) {
  constexpr float kStep = 1.0f / kBlockSide;
  const auto mix = [](const SkyFractions& a, const SkyFractions& b, float t) {
    return SkyFractions{(1 - t) * a.past_room + t * b.past_room, (1 - t) * a.past_both + t * b.past_both};
  };
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    const float t = kStep * static_cast<float>(y % kBlockSide);
    const SkyFractions left = mix(corners[0]->sky, corners[2]->sky, t),
                       right = mix(corners[1]->sky, corners[3]->sky, t);
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      const SkyFractions sky = mix(left, right, kStep * static_cast<float>(x % kBlockSide));
      frame_.at(x, y) = {glm::vec4(0.0f), glm::vec4(sky.past_room - sky.past_both, 1.0f),
                         glm::vec2((sky.past_room.r + sky.past_room.g + sky.past_room.b) / 3.0f, 0.0f), Rgb(0.0f),
                         scene_.room_triangle[view_.room(x, y).triangle]};
    }
  }
}

bool BlockShader::shows_room_edge(const PixelBox& pixels) const {
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x)
      if (!view_.room_parts(x, y).empty())
        return true;
  return false;
}

/// Some pixel of the room loses light.
bool BlockShader::shows_shadow(const PixelBox& pixels) const {
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x)
      if (const DrawnPixel& p = frame_.at(x, y); p.lost_sun != Rgb(0.0f) || Rgb(p.lost_sky) != Rgb(0.0f))
        return true;
  return false;
}

void BlockShader::shade_pixels(const PixelBox& pixels, bool receives) {
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
  if (objects_.set.count > 0)
    shade_objects(objects_, sun_corners_);
  if (room_.set.count > 0)
    shade_room();
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
  SamplingGrid::Corners plain{};
  if (!has_object && !has_edge && scene_.sun.size() == 0 && view_.is_plain(column, row))
    plain = grid_.plain_corners(column, row);
  if (plain[0]) {
    if (std::ranges::all_of(plain, [](const GridPoint* g) { return g->sky.past_room == g->sky.past_both; }))
      return;
    frame_.show(column, row);
    return shade_plain(plain, pixels);
  }
  frame_.show(column, row);
  sun_corners_ = {};
  if (!has_edge && (view_.is_plain(column, row) || !shows_room_edge(pixels)))
    sun_corners_ = grid_.sun_corners(has_object ? Layer::object : Layer::room, column, row);
  shade_pixels(pixels, receives);
  if (!has_object && !has_edge && !shows_shadow(pixels))
    frame_.take_back(column, row);
}

void BlockShader::finish_row() {
  if (outlines_.set.count > 0)
    shade_objects(outlines_, {});
}

} // namespace daylit
