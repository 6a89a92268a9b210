#include "runtime/gl/room_grid.h"

#include <algorithm>
#include <bit>

#include <glm/common.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kSide = RenderedFrame::kBlock;
constexpr float kSteepShare = 0.35f; // corners that differ by more do not speak for what is between: contact shadows
constexpr float kSameSun = 0.02f;    // of the sun's light: its shadows are too sharp for interpolation

/// Part of a whole, `otherwise` where there is no whole.
glm::vec3 share(const glm::vec4& part, const glm::vec4& whole, float otherwise) {
  glm::vec3 s;
  for (int c = 0; c < 3; ++c)
    s[c] = whole[c] > 0.0f ? part[c] / whole[c] : otherwise;
  return s;
}

float mean(const glm::vec3& v) { return (v.x + v.y + v.z) / 3.0f; }

void set_sky(const LightAnswers& sky, std::size_t k, RoomLoss& loss) {
  loss.lost_sky = share(sky.lost[k], sky.unblocked[k], 0.0f);
  loss.shares.x = mean(share(sky.past(k), sky.unblocked[k], 1.0f));
}

void set_sun(const LightAnswers& sun, std::size_t k, float whole, RoomLoss& loss) {
  const glm::vec4 &past = sun.past(k), &lost = sun.lost[k];
  loss.shares.y = (past.x + past.y + past.z) / whole;
  loss.shares.z = (lost.x + lost.y + lost.z) / whole;
}

bool loses_any(const RoomLoss& loss) {
  return loss.lost_sky.x > 0.0f || loss.lost_sky.y > 0.0f || loss.lost_sky.z > 0.0f || loss.shares.z > 0.0f;
}

template <class Do>
void each_row(int rows, const Do& task) {
  parallel_for(tbb::blocked_range<int>(0, rows, 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      task(row);
  });
}

} // namespace

PixelBox RoomGrid::block_pixels(const Scene& scene, int column, int row) const {
  return PixelBox{column * kSide, row * kSide, (column + 1) * kSide, (row + 1) * kSide}.clipped(scene.view.width(),
                                                                                                scene.view.height());
}

/// Corners that the objects may shadow, and all next to them: blocks that a shadow touches have all corners.
void RoomGrid::reach_corners(const Scene& scene) {
  const int stride = columns_ + 1;
  corners_.assign(static_cast<std::size_t>(stride) * static_cast<std::size_t>(rows_ + 1), {});
  std::vector<std::uint8_t> reached(corners_.size(), 0);
  std::vector<glm::vec3> offset(corners_.size());
  const auto index = [&](int column, int row) { return static_cast<std::size_t>(row * stride + column); };
  const auto pixel = [&](int column, int row) {
    return glm::ivec2(std::min(column * kSide, scene.view.width() - 1), std::min(row * kSide, scene.view.height() - 1));
  };
  each_row(rows_ + 1, [&](int row) {
    for (int column = 0; column <= columns_; ++column) {
      const glm::ivec2 p = pixel(column, row);
      Corner& c = corners_[index(column, row)];
      c.plane = scene.view.plane_number(scene.room, p.x, p.y);
      if (c.plane == 0)
        continue;
      const glm::vec3 x = scene.view.surface(scene.room, p.x, p.y).position;
      offset[index(column, row)] = x - scene.reach.centre;
      reached[index(column, row)] = scene.reach.meets(x);
    }
  });
  asked_corners_.clear();
  for (int row = 0; row <= rows_; ++row)
    for (int column = 0; column <= columns_; ++column) {
      bool near = false;
      for (int v = std::max(row - 1, 0); v <= std::min(row + 1, rows_); ++v)
        for (int u = std::max(column - 1, 0); u <= std::min(column + 1, columns_); ++u)
          near = near || reached[index(u, v)];
      Corner& c = corners_[index(column, row)];
      c.asked = near && c.plane != 0;
      if (c.asked)
        asked_corners_.push_back(static_cast<std::uint32_t>(index(column, row)));
    }
  corner_points_.resize(asked_corners_.size());
  for (std::size_t k = 0; k < asked_corners_.size(); ++k) {
    const int i = static_cast<int>(asked_corners_[k]);
    const glm::ivec2 p = pixel(i % stride, i / stride);
    corner_points_.set(k, offset[asked_corners_[k]], scene.view.normal(scene.room, p.x, p.y));
  }
}

const LightPoints& RoomGrid::ask_corners(const Scene& scene) {
  columns_ = (scene.view.width() + kSide - 1) / kSide;
  rows_ = (scene.view.height() + kSide - 1) / kSide;
  corner_points_.resize(0);
  asked_corners_.clear();
  corners_.clear();
  if (scene.share)
    reach_corners(scene);
  return corner_points_;
}

void RoomGrid::take_corners(const Scene& scene, const LightAnswers& sky, const LightAnswers& sun) {
  for (std::size_t k = 0; k < asked_corners_.size(); ++k) {
    RoomLoss& loss = corners_[asked_corners_[k]].loss;
    set_sky(sky, k, loss);
    if (scene.whole_sun > 0.0f)
      set_sun(sun, k, scene.whole_sun, loss);
  }
}

/// The corners of the block and those around it lose the same of the sun: no edge runs through, and hardly one between.
bool RoomGrid::sun_agrees(const Scene& scene, int column, int row) const {
  float least = 2.0f, most = -1.0f, least_past = 2.0f, most_past = -1.0f;
  for (int v = std::max(row - 1, 0); scene.whole_sun > 0.0f && v <= std::min(row + 2, rows_); ++v)
    for (int u = std::max(column - 1, 0); u <= std::min(column + 2, columns_); ++u)
      if (const Corner& c = corner(u, v); c.asked) {
        least = std::min(least, c.loss.shares.z);
        most = std::max(most, c.loss.shares.z);
        least_past = std::min(least_past, c.loss.shares.y);
        most_past = std::max(most_past, c.loss.shares.y);
      }
  return most - least <= kSameSun && most_past - least_past <= kSameSun;
}

RoomGrid::Block RoomGrid::look_at_corners(const Scene& scene, int column, int row) const {
  Block block;
  if (!scene.share) {
    block.reached = true;
    return block;
  }
  const Corner* c[4] = {&corner(column, row), &corner(column + 1, row), &corner(column, row + 1),
                        &corner(column + 1, row + 1)};
  block.reached = std::any_of(c, c + 4, [](const Corner* k) { return k->asked; });
  if (!std::all_of(c, c + 4, [&](const Corner* k) { return k->asked && k->plane == c[0]->plane; }))
    return block;
  block.plane = c[0]->plane;
  glm::vec3 least(2.0f), most(-2.0f);
  for (const Corner* k : c) {
    const glm::vec3 after = k->loss.shares.x - k->loss.lost_sky;
    least = glm::min(least, after);
    most = glm::max(most, after);
  }
  const glm::vec3 range = most - least;
  block.smooth_sky = std::max({range.x, range.y, range.z}) <= kSteepShare;
  block.smooth_sun = sun_agrees(scene, column, row);
  return block;
}

RoomGrid::Block RoomGrid::choose_block(const Scene& scene, const ObjectPixels& objects, int column, int row) const {
  Block block = look_at_corners(scene, column, row);
  const PixelBox pixels = block_pixels(scene, column, row);
  for (int y = pixels.y0; block.reached && y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      const int shown = scene.view.plane_number(scene.room, x, y);
      const bool sky = !(block.smooth_sky && shown == block.plane),
                 sun = scene.whole_sun > 0.0f && !(block.smooth_sun && shown == block.plane);
      if (shown == 0 || !(sky || sun) || objects.at(x, y).w >= 1.0f ||
          !scene.reach.meets(scene.view.surface(scene.room, x, y).position))
        continue;
      const unsigned bit = 1u << ((y - pixels.y0) * kSide + x - pixels.x0);
      block.sky = static_cast<std::uint16_t>(block.sky | (sky ? bit : 0u));
      block.sun = static_cast<std::uint16_t>(block.sun | (sun ? bit : 0u));
    }
  return block;
}

void RoomGrid::choose_pixels(const Scene& scene, const ObjectPixels& objects) {
  blocks_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  each_row(rows_, [&](int row) {
    for (int column = 0; column < columns_; ++column)
      blocks_[block_index(column, row)] = choose_block(scene, objects, column, row);
  });
  std::uint32_t sky = 0, sun = 0;
  for (Block& b : blocks_) {
    b.first_sky = sky;
    b.first_sun = sun;
    sky += static_cast<std::uint32_t>(std::popcount(b.sky));
    sun += static_cast<std::uint32_t>(std::popcount(b.sun));
  }
  sky_points_.resize(sky);
  sun_points_.resize(sun);
  each_row(rows_, [&](int row) {
    for (int column = 0; column < columns_; ++column)
      set_points(scene, column, row);
  });
}

void RoomGrid::set_points(const Scene& scene, int column, int row) {
  const Block& block = blocks_[block_index(column, row)];
  if (block.sky == 0 && block.sun == 0)
    return;
  std::size_t sky = block.first_sky, sun = block.first_sun;
  for (int k = 0; k < kSide * kSide; ++k) {
    const unsigned bit = 1u << k;
    if (!((block.sky | block.sun) & bit))
      continue;
    const int x = column * kSide + k % kSide, y = row * kSide + k / kSide;
    const glm::vec3 offset = scene.view.surface(scene.room, x, y).position - scene.reach.centre,
                    normal = scene.view.normal(scene.room, x, y);
    if (block.sky & bit)
      sky_points_.set(sky++, offset, normal);
    if (block.sun & bit)
      sun_points_.set(sun++, offset, normal);
  }
}

/// Bilinear between the corners of the block; the last ones stand on the picture's last pixels. Kept for the pixels on
/// the corners' plane.
void RoomGrid::interpolate(const Scene& scene, int column, int row, std::span<RoomLoss> losses) const {
  const PixelBox pixels = block_pixels(scene, column, row);
  const Block& block = blocks_[block_index(column, row)];
  const float per_x = 1.0f / static_cast<float>(std::max(std::min(kSide, scene.view.width() - 1 - pixels.x0), 1));
  const float per_y = 1.0f / static_cast<float>(std::max(std::min(kSide, scene.view.height() - 1 - pixels.y0), 1));
  const auto mix = [](const RoomLoss& a, const RoomLoss& b, float t) {
    return RoomLoss{a.lost_sky + t * (b.lost_sky - a.lost_sky), a.shares + t * (b.shares - a.shares)};
  };
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    const float t = per_y * static_cast<float>(y - pixels.y0);
    const RoomLoss left = mix(corner(column, row).loss, corner(column, row + 1).loss, t);
    const RoomLoss right = mix(corner(column + 1, row).loss, corner(column + 1, row + 1).loss, t);
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      if (scene.view.plane_number(scene.room, x, y) != block.plane)
        continue;
      const RoomLoss mixed = mix(left, right, per_x * static_cast<float>(x - pixels.x0));
      RoomLoss& loss = losses[static_cast<std::size_t>((y - pixels.y0) * kSide + x - pixels.x0)];
      if (block.smooth_sky) {
        loss.lost_sky = mixed.lost_sky;
        loss.shares.x = mixed.shares.x;
      }
      if (block.smooth_sun) {
        loss.shares.y = mixed.shares.y;
        loss.shares.z = mixed.shares.z;
      }
    }
  }
}

/// Of the pixels of a block, kSide to a row.
void RoomGrid::find_losses(const Scene& scene, const LightAnswers& sky, const LightAnswers& sun, int column, int row,
                           std::span<RoomLoss> losses) const {
  const Block& block = blocks_[block_index(column, row)];
  if (block.plane != 0 && (block.smooth_sky || block.smooth_sun))
    interpolate(scene, column, row, losses);
  std::size_t next_sky = block.first_sky, next_sun = block.first_sun;
  for (unsigned left = block.sky; left != 0; left &= left - 1)
    set_sky(sky, next_sky++, losses[static_cast<std::size_t>(std::countr_zero(left))]);
  for (unsigned left = block.sun; left != 0; left &= left - 1)
    set_sun(sun, next_sun++, scene.whole_sun, losses[static_cast<std::size_t>(std::countr_zero(left))]);
}

void RoomGrid::fill_block(const Scene& scene, const ObjectPixels& objects, const LightAnswers& sky,
                          const LightAnswers& sun, int column, int row, RenderedFrame& frame) const {
  const PixelBox pixels = block_pixels(scene, column, row);
  RoomLoss losses[kSide * kSide];
  if (blocks_[block_index(column, row)].reached)
    find_losses(scene, sky, sun, column, row, losses);
  bool shows = std::any_of(std::begin(losses), std::end(losses), loses_any);
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x)
      shows = shows || objects.at(x, y).w > 0.0f;
  frame.shows[frame.block_index(pixels.x0, pixels.y0)] = shows ? 1 : 0;
  for (int y = pixels.y0; shows && y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      const std::size_t i = frame.index(x, y);
      const RoomLoss& loss = losses[(y - pixels.y0) * kSide + x - pixels.x0];
      frame.object[i] = objects.at(x, y);
      frame.surface[i] = scene.view.surface(scene.room, x, y);
      const float open = scene.view.id(x, y) > 0 ? 1.0f - frame.object[i].w : 0.0f;
      frame.lost_sky[i] = open * glm::vec4(loss.lost_sky, 1.0f);
      frame.room[i] = open * glm::vec4(loss.shares, 0.0f);
    }
}

void RoomGrid::fill(const Scene& scene, const ObjectPixels& objects, const LightAnswers& sky, const LightAnswers& sun,
                    RenderedFrame& frame) const {
  const std::size_t pixels = static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px);
  frame.box = {0, 0, frame.width_px, frame.height_px};
  for (auto* pass : {&frame.object, &frame.lost_sky, &frame.room})
    pass->resize(pixels);
  frame.surface.resize(pixels);
  frame.shows.resize(blocks_.size());
  each_row(rows_, [&](int row) {
    for (int column = 0; column < columns_; ++column)
      fill_block(scene, objects, sky, sun, column, row, frame);
  });
}

} // namespace daylit
