#include "runtime/composite/change_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/common.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

/// How far a pixel lies from the first of its block towards the next block.
float block_fraction(int pixel) {
  return static_cast<float>(pixel % ChangePicture::kBlock) / static_cast<float>(ChangePicture::kBlock);
}

constexpr float kLeastWeight = 0.2f; // of the corners on a pixel's plane
constexpr float kSameSun = 0.01f;    // of what arrives: corners under the same sun

bool same_sun(const Rgb& a, const Rgb& b) {
  for (int c = 0; c < 3; ++c)
    if (std::fabs(a[c] - b[c]) > kSameSun * std::max(a[c], b[c]))
      return false;
  return true;
}

/// Largest of the channels.
float relative(const Rgb& change, const Rgb& before) {
  float largest = 0.0f;
  for (int c = 0; c < 3; ++c)
    if (change[c] != 0.0f)
      largest = std::max(largest, before[c] > 0.0f ? std::fabs(change[c]) / before[c] : 1.0f);
  return largest;
}

Rgb ratio(const Rgb& change, const Rgb& before) {
  Rgb ratio(1.0f);
  for (int c = 0; c < 3; ++c)
    if (before[c] > 0.0f)
      ratio[c] = std::max(1.0f + change[c] / before[c], 0.0f);
  return ratio;
}

} // namespace

float ChangePicture::drawn_fraction(const Rgb& change, const Rgb& before) {
  for (int c = 0; c < 3; ++c)
    if (std::fabs(change[c]) > 1.5f * kThreshold * before[c] && before[c] > 0.0f)
      return 1.0f; // the same as below, without dividing
  const float t = std::clamp(relative(change, before) / kThreshold - 0.5f, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

void ChangePicture::set_view(const RenderCamera& camera, const RayScene& room_rays, const PictureRenderer* renderer,
                             const glm::dvec3& origin) {
  camera_ = &camera;
  rays_ = &room_rays;
  renderer_ = renderer;
  origin_ = origin;
  columns_ = (camera.photo_width_px + kBlock - 1) / kBlock;
  rows_ = (camera.photo_height_px + kBlock - 1) / kBlock;
  corners_.assign(static_cast<std::size_t>(columns_ + 1) * (rows_ + 1), {});
  kinds_.assign(static_cast<std::size_t>(columns_) * rows_, Kind::nothing);
  parallel_for(0, rows_ + 1, [&](int row) {
    for (int column = 0; column <= columns_; ++column)
      corners_[static_cast<std::size_t>(row) * (columns_ + 1) + column] = look(
          std::min(column * kBlock, camera.photo_width_px - 1), std::min(row * kBlock, camera.photo_height_px - 1));
  });
}

/// The room through a pixel of the photograph.
ChangePicture::Corner ChangePicture::look(int x, int y) const {
  Corner corner;
  glm::dvec2 drawn(x, y);
  if (!camera_->drawn_position.empty()) {
    drawn = glm::dvec2(
        camera_->drawn_position[static_cast<std::size_t>(y) * camera_->photo_width_px + static_cast<std::size_t>(x)]);
    if (drawn.x < -1e8)
      return corner;
  }
  corner.direction = camera_->direction(drawn);
  if (RoomSurface point; camera_->drawn_position.empty() && renderer_ && renderer_->room_point(x, y, point)) {
    corner.seen = point.triangle != RoomSurface{}.triangle;
    corner.triangle = point.triangle;
    corner.position = origin_ + glm::dvec3(point.position);
    return corner;
  }
  RayHit hit;
  corner.seen = rays_->closest(rays_->to_local(camera_->eye()), glm::vec3(corner.direction), 0.0f,
                               std::numeric_limits<float>::infinity(), hit);
  corner.triangle = hit.triangle;
  corner.position = camera_->eye() + static_cast<double>(hit.distance) * corner.direction;
  return corner;
}

void ChangePicture::light(Corner& corner) const {
  corner.visible = corner.affected = false;
  if (!corner.seen)
    return;
  corner.facing = field_->facing_of(corner.triangle, corner.direction);
  corner.affected = field_->affects(corner.position);
  if (!corner.affected)
    return;
  corner.change = field_->at(corner.triangle, corner.position, corner.direction);
  corner.sun = field_->sun_irradiance(corner.triangle, corner.position, corner.direction);
  corner.visible = drawn_fraction(corner.change.irradiance, corner.change.before + corner.sun) > 0.0f;
}

ChangePicture::Kind ChangePicture::kind_of(int column, int row) const {
  const std::array<const Corner*, 4> four = corners_around(column, row);
  bool any = false, same = true;
  for (const Corner* c : four) {
    any = any || c->visible || (c->affected && field_->near(c->position));
    same = same && c->affected && c->facing == four[0]->facing && same_sun(c->sun, four[0]->sun);
  }
  return !any ? Kind::nothing : same ? Kind::interpolate : Kind::single;
}

namespace {

bool covers(const RenderedFrame& drawn, const PixelBox& pixels) {
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x)
      if (!drawn.shown(x, y) || drawn.object[drawn.index(x, y)].w < 1.0f)
        return false;
  return true;
}

} // namespace

/// Blocks that show nothing of the room.
void ChangePicture::find_covered(const RenderedFrame* drawn) {
  covered_.clear();
  if (!drawn || !camera_->drawn_position.empty())
    return;
  covered_.resize(kinds_.size());
  const PixelBox& box = drawn->box;
  parallel_for(box.y0 / kBlock, (box.y1 + kBlock - 1) / kBlock, [&](int row) {
    for (int column = box.x0 / kBlock; column * kBlock < box.x1; ++column) {
      const PixelBox block{column * kBlock, row * kBlock, (column + 1) * kBlock, (row + 1) * kBlock};
      covered_[static_cast<std::size_t>(row) * columns_ + column] =
          covers(*drawn, block.clipped(drawn->width_px, drawn->height_px));
    }
  });
}

/// All blocks around it are.
bool ChangePicture::is_covered(std::size_t corner) const {
  if (covered_.empty())
    return false;
  const int column = static_cast<int>(corner) % (columns_ + 1), row = static_cast<int>(corner) / (columns_ + 1);
  for (int v = std::max(row - 1, 0); v <= std::min(row, rows_ - 1); ++v)
    for (int u = std::max(column - 1, 0); u <= std::min(column, columns_ - 1); ++u)
      if (!covered_[static_cast<std::size_t>(v) * columns_ + u])
        return false;
  return true;
}

void ChangePicture::update(const IndirectShadow& field, const RenderedFrame* drawn) {
  field_ = &field;
  find_covered(drawn);
  ratios_.resize(corners_.size());
  changes_.resize(corners_.size());
  parallel_for(tbb::blocked_range<std::size_t>(0, corners_.size(), 32), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      if (is_covered(i))
        corners_[i].visible = corners_[i].affected = false;
      else
        light(corners_[i]);
      weigh(i);
    }
  });
  left_out_ = 0.0f;
  for (const Corner& c : corners_)
    left_out_ = std::max(left_out_, c.left_out);
  parallel_for(tbb::blocked_range<int>(0, rows_, 16), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = 0; column < columns_; ++column)
        kinds_[static_cast<std::size_t>(row) * columns_ + column] = kind_of(column, row);
  });
}

/// How much of the change at a corner is drawn.
void ChangePicture::weigh(std::size_t i) {
  Corner& c = corners_[i];
  c.left_out = 0.0f;
  ratios_[i] = Rgb(1.0f);
  changes_[i] = {};
  if (!c.affected)
    return;
  const Rgb before = c.change.before + c.sun;
  const float fraction = drawn_fraction(c.change.irradiance, before);
  c.left_out = (1.0f - fraction) * relative(c.change.irradiance, before);
  ratios_[i] = ratio(fraction * c.change.irradiance, before);
  changes_[i] = {c.change.irradiance, before};
}

std::optional<PixelChange> ChangePicture::at(int x, int y) const {
  auto change = whole_at(x, y);
  if (!change)
    return change;
  const float fraction = drawn_fraction(change->irradiance, change->before);
  if (fraction == 0.0f)
    return std::nullopt;
  change->irradiance *= fraction;
  return change;
}

std::optional<Rgb> ChangePicture::ratio_at(int x, int y) const {
  const Kind kind = kind_at(x, y);
  if (kind == Kind::interpolate) {
    Rgb ratio;
    interpolate_row(x, y, 1, &ratio);
    return ratio;
  }
  const auto change = at(x, y);
  return change ? std::optional(ratio(change->irradiance, change->before)) : std::nullopt;
}

void ChangePicture::interpolate_row(int x, int y, int count, Rgb* ratios) const {
  const Rgb* upper = &ratios_[static_cast<std::size_t>(y / kBlock) * (columns_ + 1) + x / kBlock];
  const Rgb* lower = upper + columns_ + 1;
  const float t = block_fraction(y);
  const Rgb left = upper[0] + t * (lower[0] - upper[0]), step = upper[1] + t * (lower[1] - upper[1]) - left;
  for (int k = 0; k < count; ++k)
    ratios[k] = left + block_fraction(x + k) * step;
}

void ChangePicture::interpolate_row(int x, int y, int count, PixelChange* changes) const {
  const PixelChange* upper = &changes_[static_cast<std::size_t>(y / kBlock) * (columns_ + 1) + x / kBlock];
  const PixelChange* lower = upper + columns_ + 1;
  const float t = block_fraction(y);
  const auto mix = [](const PixelChange& a, const PixelChange& b, float fraction) {
    return PixelChange{a.irradiance + fraction * (b.irradiance - a.irradiance),
                       a.before + fraction * (b.before - a.before)};
  };
  const PixelChange left = mix(upper[0], lower[0], t), right = mix(upper[1], lower[1], t);
  for (int k = 0; k < count; ++k) {
    changes[k] = mix(left, right, block_fraction(x + k));
    changes[k].irradiance *= drawn_fraction(changes[k].irradiance, changes[k].before);
  }
}

std::optional<std::array<std::uint32_t, 4>> ChangePicture::plane_of_block(int x, int y) const {
  const std::array<const Corner*, 4> four = corners_around(x / kBlock, y / kBlock);
  std::array<std::uint32_t, 4> triangles{};
  for (std::size_t k = 0; k < 4; ++k) {
    if (!four[k]->seen || four[k]->facing != four[0]->facing)
      return std::nullopt;
    triangles[k] = four[k]->triangle;
  }
  return triangles;
}

std::array<float, 4> ChangePicture::corner_weights(int x, int y) {
  const float s = static_cast<float>(x % kBlock) / kBlock, t = static_cast<float>(y % kBlock) / kBlock;
  return {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
}

/// In a block that shows several planes, or the edge of a sun patch.
std::optional<PixelChange> ChangePicture::between_planes(int x, int y) const {
  Corner pixel = look(x, y);
  if (!pixel.seen || !field_->affects(pixel.position))
    return std::nullopt;
  pixel.facing = field_->facing_of(pixel.triangle, pixel.direction);
  const int column = x / kBlock, row = y / kBlock;
  const std::array<float, 4> weight = corner_weights(x, y);
  const Corner* first = nullptr;
  PixelChange sum;
  float whole = 0.0f;
  bool one_sun = true;
  for (int k = 0; k < 4; ++k) {
    const Corner& c = corner(column + (k & 1), row + (k >> 1));
    if (!c.affected || c.facing != pixel.facing)
      continue;
    first = first ? first : &c;
    one_sun = one_sun && same_sun(c.sun, first->sun);
    sum.irradiance += weight[k] * c.change.irradiance;
    sum.before += weight[k] * c.change.before;
    whole += weight[k];
  }
  if (whole < kLeastWeight) {
    light(pixel);
    return PixelChange{pixel.change.irradiance, pixel.change.before + pixel.sun};
  }
  const Rgb sun = one_sun ? first->sun : field_->sun_irradiance(pixel.triangle, pixel.position, pixel.direction);
  return PixelChange{sum.irradiance / whole, sum.before / whole + sun};
}

std::optional<PixelChange> ChangePicture::whole_at(int x, int y) const {
  const int column = x / kBlock, row = y / kBlock;
  const Kind kind = kind_at(x, y);
  if (kind == Kind::nothing)
    return std::nullopt;
  if (kind == Kind::single)
    return between_planes(x, y);
  const std::array<float, 4> weight = corner_weights(x, y);
  PixelChange sum;
  for (int k = 0; k < 4; ++k) {
    const PixelChange& c = changes_[static_cast<std::size_t>(row + (k >> 1)) * (columns_ + 1) + column + (k & 1)];
    sum.irradiance += weight[k] * c.irradiance;
    sum.before += weight[k] * c.before;
  }
  return sum;
}

} // namespace daylit
