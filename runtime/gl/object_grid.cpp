#include "runtime/gl/object_grid.h"

#include <algorithm>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kSide = 4; // pixels between corners
constexpr float kSameSideCosine = 0.8f;
constexpr float kSamePieceShare = 0.2f; // of the objects' radius, metres apart
constexpr float kSteepShare = 0.2f;     // corners that differ by more do not speak for what is between
constexpr float kLeastWeight = 0.75f;   // of the corners that speak for a pixel

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

/// Between the corners of the block that show the objects: one at least, all of them on the pixel's piece of surface
/// and nearly alike.
bool ObjectGrid::interpolate(const ObjectPoints& points, int x, int y, Share& share) const {
  const int column = x / kSide, row = y / kSide, width = points.box.width(), height = points.box.height();
  const auto i = static_cast<std::size_t>(y * width + x);
  const float s = static_cast<float>(x % kSide) / kSide, t = static_cast<float>(y % kSide) / kSide;
  const float weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  glm::vec3 least(2.0f), most(-2.0f), lost(0.0f), past(0.0f);
  float whole = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const int u = (column + k % 2) * kSide, v = (row + k / 2) * kSide;
    const auto at = static_cast<std::size_t>(v * width + u);
    if (u >= width || v >= height || points.offset[at].w <= 0.0f)
      continue;
    if (!same_piece(points, i, at))
      return false;
    const std::int32_t asked = corner(column + k % 2, row + k / 2);
    if (asked < 0)
      continue;
    const Share& c = corner_shares_[static_cast<std::size_t>(asked)];
    least = glm::min(least, c.past - c.lost);
    most = glm::max(most, c.past - c.lost);
    lost += weight[k] * c.lost;
    past += weight[k] * c.past;
    whole += weight[k];
  }
  if (whole < kLeastWeight)
    return false;
  const glm::vec3 range = most - least;
  share = {lost / whole, past / whole};
  return std::max({range.x, range.y, range.z}) <= kSteepShare;
}

const LightPoints& ObjectGrid::ask_pixels(const ObjectPoints& points, const LightAnswers& corners,
                                          LightAnswers& shares) {
  corner_shares_.resize(corner_points_.size());
  for (std::size_t k = 0; k < corner_shares_.size(); ++k)
    corner_shares_[k] = share_of(corners, k);
  const std::size_t count = points.offset.size();
  shares.unblocked.resize(count, glm::vec4(1.0f)); // and stays
  shares.lost.resize(count);
  shares.past_room.resize(count);
  asks_.assign(count, 0);
  parallel_for(tbb::blocked_range<int>(0, points.box.height(), 16), [&](const tbb::blocked_range<int>& rows) {
    for (int y = rows.begin(); y != rows.end(); ++y)
      for (int x = 0; x < points.box.width(); ++x) {
        const auto i = static_cast<std::size_t>(y * points.box.width() + x);
        if (points.offset[i].w <= 0.0f)
          continue;
        Share share;
        asks_[i] = points.normal[i].w > 0.0f || !interpolate(points, x, y, share);
        shares.lost[i] = glm::vec4(share.lost, 0.0f);
        shares.past_room[i] = glm::vec4(share.past, 0.0f);
      }
  });
  asked_pixels_.clear();
  for (std::size_t i = 0; i < count; ++i)
    if (asks_[i])
      asked_pixels_.push_back(static_cast<std::uint32_t>(i));
  pixel_points_.resize(asked_pixels_.size());
  for (std::size_t k = 0; k < asked_pixels_.size(); ++k)
    pixel_points_.set(k, glm::vec3(points.offset[asked_pixels_[k]]), glm::vec3(points.normal[asked_pixels_[k]]));
  return pixel_points_;
}

void ObjectGrid::fill(const LightAnswers& pixels, LightAnswers& shares) const {
  for (std::size_t k = 0; k < asked_pixels_.size(); ++k) {
    const Share share = share_of(pixels, k);
    shares.lost[asked_pixels_[k]] = glm::vec4(share.lost, 0.0f);
    shares.past_room[asked_pixels_[k]] = glm::vec4(share.past, 0.0f);
  }
}

} // namespace daylit
