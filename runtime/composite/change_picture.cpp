#include "runtime/composite/change_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kBlock = ChangePicture::kBlock;
constexpr float kLeastWeight = 0.2f; // of the corners on a pixel's plane
constexpr float kSameSun = 0.01f;    // of what arrives: corners under the same sun

/// How far a pixel lies from the first of its block towards the next block, 0..1.
float along_block(int pixel) { return static_cast<float>(pixel % kBlock) / static_cast<float>(kBlock); }

/// Bilinear weights of the corners of the pixel's block, upper ones first.
std::array<float, 4> corner_weights(int x, int y) {
  const float s = along_block(x), t = along_block(y);
  return {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
}

bool same_sun(const Rgb& a, const Rgb& b) {
  for (int c = 0; c < 3; ++c)
    if (std::fabs(a[c] - b[c]) > kSameSun * std::max(a[c], b[c]))
      return false;
  return true;
}

/// Largest |change| / before of the channels; 1 where there was no light.
float relative(const Rgb& change, const Rgb& before) {
  float largest = 0.0f;
  for (int c = 0; c < 3; ++c)
    if (change[c] != 0.0f)
      largest = std::max(largest, before[c] > 0.0f ? std::fabs(change[c]) / before[c] : 1.0f);
  return largest;
}

bool covers(const RenderedFrame& drawn, const PixelBox& pixels) {
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x)
      if (!drawn.shown(x, y) || drawn.at(x, y).object.w < 1.0f)
        return false;
  return true;
}

} // namespace

ViewCorners::ViewCorners(const RenderCamera& camera, const RayScene& room_rays, const PictureRenderer* renderer)
    : camera_(&camera), rays_(&room_rays), renderer_(renderer), columns_((camera.photo_width_px + kBlock - 1) / kBlock),
      rows_((camera.photo_height_px + kBlock - 1) / kBlock),
      corners_(static_cast<std::size_t>(columns_ + 1) * (rows_ + 1)) {
  parallel_for(0, rows_ + 1, [&](int row) {
    for (int column = 0; column <= columns_; ++column)
      corners_[index(column, row)] = look(std::min(column * kBlock, camera.photo_width_px - 1),
                                          std::min(row * kBlock, camera.photo_height_px - 1));
  });
}

ViewPoint ViewCorners::look(int x, int y) const {
  ViewPoint point;
  glm::dvec2 drawn(x, y);
  if (distorted()) {
    drawn = glm::dvec2(
        camera_->drawn_position[static_cast<std::size_t>(y) * camera_->photo_width_px + static_cast<std::size_t>(x)]);
    if (drawn.x < -1e8)
      return point;
  }
  point.direction = camera_->direction(drawn);
  if (RoomSurface known; !distorted() && renderer_ && renderer_->room_point(x, y, known)) {
    point.seen = known.triangle != kUnknownTriangle;
    point.triangle = known.triangle;
    point.position = known.position;
    return point;
  }
  RayHit hit;
  point.seen = rays_->closest(rays_->to_local(camera_->eye()), glm::vec3(point.direction), 0.0f,
                              std::numeric_limits<float>::infinity(), hit);
  point.triangle = hit.triangle;
  point.position = camera_->eye() + static_cast<double>(hit.distance) * point.direction;
  return point;
}

std::vector<ViewCorners::Part> ViewCorners::parts(int x, int y) const {
  const glm::ivec2 p =
      distorted()
          ? glm::ivec2(glm::round(camera_->drawn_position[static_cast<std::size_t>(y) * camera_->photo_width_px +
                                                          static_cast<std::size_t>(x)]))
          : glm::ivec2(x, y);
  std::array<RoomSurfacePart, kMostRoomParts> surfaces;
  const bool is_drawn = p.x >= 0 && p.y >= 0 && p.x < camera_->width_px && p.y < camera_->height_px;
  const std::size_t count = renderer_ && is_drawn ? renderer_->room_parts(p.x, p.y, surfaces) : 0;
  std::vector<Part> parts;
  for (const RoomSurfacePart& part : std::span(surfaces).first(count))
    parts.push_back(
        {{true, part.surface.triangle, part.surface.position, glm::normalize(part.surface.position - camera_->eye())},
         part.fraction});
  return parts;
}

/// 3 t^2 - 2 t^3 of t = relative change / kThreshold - 1/2.
float ChangePicture::drawn_fraction(const Rgb& change, const Rgb& before) {
  for (int c = 0; c < 3; ++c)
    if (std::fabs(change[c]) > 1.5f * kThreshold * before[c] && before[c] > 0.0f)
      return 1.0f; // the same as below, without dividing
  const float t = std::clamp(relative(change, before) / kThreshold - 0.5f, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

ChangePicture::Light ChangePicture::light_at(const ViewPoint& point) const {
  Light light;
  if (!point.seen)
    return light;
  light.facing = field_->facing_of(point.triangle, point.direction);
  light.affected = field_->affects(point.position);
  if (!light.affected)
    return light;
  light.change = field_->at(point.triangle, point.position, point.direction);
  light.sun = field_->sun_irradiance(point.triangle, point.position, point.direction);
  light.surface_distance_m = field_->near(point.position)
                                 ? field_->surface_distance(point.triangle, point.position, point.direction)
                                 : std::numeric_limits<double>::infinity();
  light.visible = drawn_fraction(light.change.irradiance, light.change.before + light.sun) > 0.0f;
  return light;
}

ChangePicture::Kind ChangePicture::kind_of(int column, int row) const {
  const std::array<std::size_t, 4> four = corners_of(column, row);
  const Light& first = lights_[four[0]];
  bool any = false, same = true;
  for (const std::size_t i : four) {
    const Light& c = lights_[i];
    any = any || c.visible || (c.affected && field_->near(view_->corners()[i].position));
    same = same && c.affected && c.facing == first.facing && same_sun(c.sun, first.sun);
  }
  if (any && touches_object(four))
    return Kind::contact;
  return !any ? Kind::nothing : same ? Kind::interpolate : Kind::single;
}

/// A pixel of the block may lie as near to an object as the change is narrow: around the corner nearest to it.
bool ChangePicture::touches_object(const std::array<std::size_t, 4>& four) const {
  const std::vector<ViewPoint>& points = view_->corners();
  const auto half_way = [&](std::size_t a, std::size_t b) {
    return lights_[four[a]].affected && lights_[four[b]].affected
               ? 0.5 * glm::length(points[four[a]].position - points[four[b]].position)
               : 0.0;
  };
  const double reach = field_->contact_distance() + std::max(half_way(0, 3), half_way(1, 2)); // along the diagonals
  return std::ranges::any_of(
      four, [&](std::size_t i) { return lights_[i].affected && lights_[i].surface_distance_m < reach; });
}

/// Blocks that show nothing of the room; empty: not known.
std::vector<std::uint8_t> ChangePicture::hidden_blocks(const RenderedFrame* drawn) const {
  if (!drawn || view_->distorted())
    return {};
  std::vector<std::uint8_t> hidden(kinds_.size());
  const PixelBox& box = drawn->box;
  parallel_for(box.y0 / kBlock, (box.y1 + kBlock - 1) / kBlock, [&](int row) {
    for (int column = box.x0 / kBlock; column * kBlock < box.x1; ++column) {
      const PixelBox block{column * kBlock, row * kBlock, (column + 1) * kBlock, (row + 1) * kBlock};
      hidden[static_cast<std::size_t>(row) * view_->columns() + column] =
          covers(*drawn, block.clipped(drawn->width_px, drawn->height_px));
    }
  });
  return hidden;
}

/// All blocks around the corner are.
bool ChangePicture::is_hidden(int column, int row, const std::vector<std::uint8_t>& blocks) const {
  if (blocks.empty())
    return false;
  for (int v = std::max(row - 1, 0); v <= std::min(row, view_->rows() - 1); ++v)
    for (int u = std::max(column - 1, 0); u <= std::min(column, view_->columns() - 1); ++u)
      if (!blocks[static_cast<std::size_t>(v) * view_->columns() + u])
        return false;
  return true;
}

void ChangePicture::set_corner(std::size_t i, const Light& light) {
  lights_[i] = light;
  if (!light.affected) {
    ratios_[i] = Rgb(1.0f);
    changes_[i] = {};
    return;
  }
  const Rgb before = light.change.before + light.sun;
  const float fraction = drawn_fraction(light.change.irradiance, before);
  lights_[i].left_out = (1.0f - fraction) * relative(light.change.irradiance, before);
  ratios_[i] = light_ratio(fraction * light.change.irradiance, before);
  changes_[i] = {light.change.irradiance, before};
}

void ChangePicture::update(const ViewCorners& view, const IndirectShadow& field, const RenderedFrame* drawn) {
  view_ = &view;
  field_ = &field;
  const std::vector<ViewPoint>& corners = view.corners();
  lights_.resize(corners.size());
  ratios_.resize(corners.size());
  changes_.resize(corners.size());
  kinds_.resize(static_cast<std::size_t>(view.columns()) * view.rows());
  const std::vector<std::uint8_t> hidden = hidden_blocks(drawn);
  const int across = view.columns() + 1;
  parallel_for(tbb::blocked_range<std::size_t>(0, corners.size(), 32), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const int column = static_cast<int>(i) % across, row = static_cast<int>(i) / across;
      set_corner(i, is_hidden(column, row, hidden) ? Light{} : light_at(corners[i]));
    }
  });
  left_out_ = 0.0f;
  for (const Light& c : lights_)
    left_out_ = std::max(left_out_, c.left_out);
  parallel_for(tbb::blocked_range<int>(0, view.rows(), 16), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = 0; column < view.columns(); ++column)
        kinds_[static_cast<std::size_t>(row) * view.columns() + column] = kind_of(column, row);
  });
}

namespace {

/// What is drawn of it.
std::optional<PixelChange> drawn(std::optional<PixelChange> change) {
  if (!change)
    return change;
  const float fraction = ChangePicture::drawn_fraction(change->irradiance, change->before);
  if (fraction == 0.0f)
    return std::nullopt;
  change->irradiance *= fraction;
  return change;
}

} // namespace

std::optional<PixelChange> ChangePicture::at(int x, int y) const { return drawn(whole_at(x, y)); }

std::optional<PixelChange> ChangePicture::at(int x, int y, const ViewPoint& point) const {
  const Kind kind = kind_at(x, y);
  return kind == Kind::nothing ? std::nullopt : drawn(between_planes(x, y, kind, point));
}

Rgb ChangePicture::light_before(const ViewPoint& point) const {
  return field_->at(point.triangle, point.position, point.direction).before +
         field_->sun_irradiance(point.triangle, point.position, point.direction);
}

std::optional<Rgb> ChangePicture::ratio_at(int x, int y) const {
  if (kind_at(x, y) == Kind::interpolate) {
    Rgb ratio;
    interpolate_row(x, y, 1, &ratio);
    return ratio;
  }
  const auto change = at(x, y);
  return change ? std::optional(light_ratio(change->irradiance, change->before)) : std::nullopt;
}

void ChangePicture::interpolate_row(int x, int y, int count, Rgb* ratios) const {
  const Rgb* upper = &ratios_[view_->index(x / kBlock, y / kBlock)];
  const Rgb* lower = upper + view_->columns() + 1;
  const float t = along_block(y);
  const Rgb left = upper[0] + t * (lower[0] - upper[0]), step = upper[1] + t * (lower[1] - upper[1]) - left;
  for (int k = 0; k < count; ++k)
    ratios[k] = left + along_block(x + k) * step;
}

void ChangePicture::interpolate_row(int x, int y, int count, PixelChange* changes) const {
  const PixelChange* upper = &changes_[view_->index(x / kBlock, y / kBlock)];
  const PixelChange* lower = upper + view_->columns() + 1;
  const float t = along_block(y);
  const auto mix = [](const PixelChange& a, const PixelChange& b, float s) {
    return PixelChange{a.irradiance + s * (b.irradiance - a.irradiance), a.before + s * (b.before - a.before)};
  };
  const PixelChange left = mix(upper[0], lower[0], t), right = mix(upper[1], lower[1], t);
  for (int k = 0; k < count; ++k) {
    changes[k] = mix(left, right, along_block(x + k));
    changes[k].irradiance *= drawn_fraction(changes[k].irradiance, changes[k].before);
  }
}

std::optional<std::array<std::uint32_t, 4>> ChangePicture::plane_of_block(int x, int y) const {
  const std::array<std::size_t, 4> four = corners_of(x / kBlock, y / kBlock);
  std::array<std::uint32_t, 4> triangles{};
  for (std::size_t k = 0; k < 4; ++k) {
    const ViewPoint& point = view_->corners()[four[k]];
    if (!point.seen || lights_[four[k]].facing != lights_[four[0]].facing)
      return std::nullopt;
    triangles[k] = point.triangle;
  }
  return triangles;
}

/// In a block beside an object, or that shows several planes or the edge of a sun patch.
std::optional<PixelChange> ChangePicture::between_planes(int x, int y, Kind kind, const ViewPoint& pixel) const {
  if (!pixel.seen || !field_->affects(pixel.position))
    return std::nullopt;
  const std::uint32_t facing = field_->facing_of(pixel.triangle, pixel.direction);
  const std::array<float, 4> weight = corner_weights(x, y);
  const std::array<std::size_t, 4> four = corners_of(x / kBlock, y / kBlock);
  const Light* first = nullptr;
  PixelChange sum;
  float whole = 0.0f;
  bool one_sun = true;
  for (std::size_t k = 0; k < 4; ++k) {
    const Light& c = lights_[four[k]];
    if (!c.affected || c.facing != facing)
      continue;
    first = first ? first : &c;
    one_sun = one_sun && same_sun(c.sun, first->sun);
    sum.irradiance += weight[k] * c.change.irradiance;
    sum.before += weight[k] * c.change.before;
    whole += weight[k];
  }
  const Rgb sun = one_sun && whole >= kLeastWeight
                      ? first->sun
                      : field_->sun_irradiance(pixel.triangle, pixel.position, pixel.direction);
  if (kind == Kind::contact || whole < kLeastWeight) {
    const IndirectChange here = field_->at(pixel.triangle, pixel.position, pixel.direction);
    return PixelChange{here.irradiance, here.before + sun};
  }
  return PixelChange{sum.irradiance / whole, sum.before / whole + sun};
}

std::optional<PixelChange> ChangePicture::whole_at(int x, int y) const {
  const Kind kind = kind_at(x, y);
  if (kind == Kind::nothing)
    return std::nullopt;
  if (kind != Kind::interpolate)
    return between_planes(x, y, kind, view_->look(x, y));
  const std::array<float, 4> weight = corner_weights(x, y);
  const std::array<std::size_t, 4> four = corners_of(x / kBlock, y / kBlock);
  PixelChange sum;
  for (std::size_t k = 0; k < 4; ++k) {
    sum.irradiance += weight[k] * changes_[four[k]].irradiance;
    sum.before += weight[k] * changes_[four[k]].before;
  }
  return sum;
}

} // namespace daylit
