#include "runtime/render/object_grid.h"

#include <algorithm>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr int kSide = 4; // pixels between corners
constexpr float kSameSideCosine = 0.8f;
constexpr float kSamePieceShare = 0.2f; // of the objects' radius, metres apart
constexpr float kSteepShare = 0.2f;     // corners that differ by more do not speak for what is between

} // namespace

bool ObjectGrid::same_piece(const ObjectPoints& points, std::size_t a, std::size_t b) const {
  const glm::vec3 apart(points.offset[a] - points.offset[b]);
  const float reach = kSamePieceShare * radius_;
  return glm::dot(glm::vec3(points.normal[a]), glm::vec3(points.normal[b])) >= kSameSideCosine &&
         glm::dot(apart, apart) < reach * reach;
}

ObjectGrid::Share ObjectGrid::share_of(const LightAnswers& answers, std::size_t k) {
  Share share;
  for (int c = 0; c < 3; ++c)
    if (const float whole = answers.unblocked[k][c]; whole > 0.0f) {
      share.lost[c] = answers.lost[k][c] / whole;
      share.past[c] = answers.past(k)[c] / whole;
    }
  return share;
}

const LightPoints& ObjectGrid::ask_corners(const ObjectPoints& points, float radius) {
  const int width = points.box.width();
  radius_ = radius;
  columns_ = (width + kSide - 1) / kSide;
  rows_ = (points.box.height() + kSide - 1) / kSide;
  corner_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), -1);
  corner_points_.resize(corner_.size());
  std::size_t count = 0;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const auto i = static_cast<std::size_t>(row * kSide * width + column * kSide);
      if (points.offset[i].w <= 0.0f || points.normal[i].w > 0.0f)
        continue;
      corner_[static_cast<std::size_t>(row * columns_ + column)] = static_cast<std::int32_t>(count);
      corner_points_.set(count++, glm::vec3(points.offset[i]), glm::vec3(points.normal[i]));
    }
  corner_points_.resize(count);
  return corner_points_;
}

bool ObjectGrid::is_smooth(const ObjectPoints& points, int column, int row) const {
  glm::vec3 least(2.0f), most(-2.0f);
  const int width = points.box.width(), first = row * kSide * width + column * kSide;
  for (int k = 0; k < 4; ++k) {
    const std::int32_t at = corner(column + k % 2, row + k / 2);
    const int pixel = first + k % 2 * kSide + k / 2 * kSide * width;
    if (at < 0 || !same_piece(points, static_cast<std::size_t>(first), static_cast<std::size_t>(pixel)))
      return false;
    const Share& s = corner_shares_[static_cast<std::size_t>(at)];
    least = glm::min(least, s.past - s.lost);
    most = glm::max(most, s.past - s.lost);
  }
  const glm::vec3 range = most - least;
  return std::max({range.x, range.y, range.z}) <= kSteepShare;
}

/// Of the box: a pixel that shows one piece of surface, the same as the corners of its block.
bool ObjectGrid::is_between(const ObjectPoints& points, int x, int y) const {
  const int column = x / kSide, row = y / kSide, width = points.box.width();
  const auto i = static_cast<std::size_t>(y * width + x);
  if (!smooth_[static_cast<std::size_t>(row * columns_ + column)] || points.normal[i].w > 0.0f)
    return false;
  const int first = row * kSide * width + column * kSide;
  return same_piece(points, i, static_cast<std::size_t>(first)) &&
         same_piece(points, i, static_cast<std::size_t>(first + kSide * width + kSide));
}

const LightPoints& ObjectGrid::ask_pixels(const ObjectPoints& points, const LightAnswers& corners) {
  corner_shares_.resize(corner_points_.size());
  for (std::size_t k = 0; k < corner_shares_.size(); ++k)
    corner_shares_[k] = share_of(corners, k);
  smooth_.resize(corner_.size());
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      smooth_[static_cast<std::size_t>(row * columns_ + column)] = is_smooth(points, column, row);
  asked_pixels_.clear();
  const int width = points.box.width();
  for (int y = 0; y < points.box.height(); ++y)
    for (int x = 0; x < width; ++x)
      if (const auto i = static_cast<std::uint32_t>(y * width + x);
          points.offset[i].w > 0.0f && !is_between(points, x, y))
        asked_pixels_.push_back(i);
  pixel_points_.resize(asked_pixels_.size());
  for (std::size_t k = 0; k < asked_pixels_.size(); ++k)
    pixel_points_.set(k, glm::vec3(points.offset[asked_pixels_[k]]), glm::vec3(points.normal[asked_pixels_[k]]));
  return pixel_points_;
}

ObjectGrid::Share ObjectGrid::between(int x, int y) const {
  const int column = x / kSide, row = y / kSide;
  const float s = static_cast<float>(x % kSide) / kSide, t = static_cast<float>(y % kSide) / kSide;
  const float weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  Share mixed{glm::vec3(0.0f), glm::vec3(0.0f)};
  for (int k = 0; k < 4; ++k) {
    const Share& c = corner_shares_[static_cast<std::size_t>(corner(column + k % 2, row + k / 2))];
    mixed.lost += weight[k] * c.lost;
    mixed.past += weight[k] * c.past;
  }
  return mixed;
}

void ObjectGrid::fill(const ObjectPoints& points, const LightAnswers& pixels, LightAnswers& shares) const {
  const std::size_t count = points.offset.size();
  shares.unblocked.assign(count, glm::vec4(1.0f));
  shares.lost.resize(count);
  shares.past_room.resize(count);
  const auto set = [&](std::size_t i, const Share& share) {
    shares.lost[i] = glm::vec4(share.lost, 0.0f);
    shares.past_room[i] = glm::vec4(share.past, 0.0f);
  };
  std::size_t next = 0;
  const int width = points.box.width();
  for (int y = 0; y < points.box.height(); ++y)
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y * width + x);
      if (next < asked_pixels_.size() && asked_pixels_[next] == i)
        set(i, share_of(pixels, next++));
      else if (points.offset[i].w > 0.0f)
        set(i, between(x, y));
    }
}

} // namespace daylit
