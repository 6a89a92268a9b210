#include "runtime/composite/compose.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/composite/change_picture.h"
#include "runtime/composite/drawn_picture.h"
#include "runtime/composite/patch_borders.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

/// Irradiance of the room at a pixel: without the objects, and what they take (negative: give).
struct RoomLoss {
  Rgb before{0.0f}, lost{0.0f};
};

/// E = E_open sky x received + E_sun x received + E_indirect and what the objects take of it; the drawn values hold the
/// fractions times the part of the pixel that shows the room.
inline RoomLoss direct_loss(const DrawnPixel& drawn, const RoomPoint& point) {
  const float whole = 1.0f / drawn.lost_sky.w;
  const Rgb lost_sky = whole * Rgb(drawn.lost_sky), lost_sun = whole * drawn.lost_sun;
  const glm::vec2 received = whole * drawn.received;
  return {point.open_sky_irradiance * received.x + point.sun_normal_irradiance * received.y + point.indirect_irradiance,
          point.open_sky_irradiance * lost_sky + point.sun_normal_irradiance * lost_sun};
}

/// The light between two points of a plane.
inline void mix(const RoomPoint& a, const RoomPoint& b, float t, RoomPoint& between) {
  between.indirect_irradiance = a.indirect_irradiance + t * (b.indirect_irradiance - a.indirect_irradiance);
  between.open_sky_irradiance = a.open_sky_irradiance + t * (b.open_sky_irradiance - a.open_sky_irradiance);
}

inline bool casts_shadow(const DrawnPixel& pixel) {
  const Rgb& sun = pixel.lost_sun;
  return pixel.lost_sky.w > 0.0f &&
         std::max({pixel.lost_sky.x, pixel.lost_sky.y, pixel.lost_sky.z, sun.r, sun.g, sun.b}) > 0.0f;
}

/// The photograph's pixel after that: photo x (E - lost) / E, or photo - scale rho/pi lost (Debevec 1998; Gibson &
/// Murta 2000).
inline Rgb changed(const Rgb& photo, const RoomLoss& loss, const Rgb& reflectance, const ComposeSettings& settings) {
  if (settings.mode == ShadowMode::difference) {
    const Rgb change = reflectance * loss.lost * std::numbers::inv_pi_v<float>;
    return glm::max(photo - settings.photo.apply(change), Rgb(0.0f));
  }
  return photo * light_ratio(-loss.lost, loss.before);
}

constexpr int kBlock = ChangePicture::kBlock;
constexpr float kLarge = 0.1f; // change of one surface that would show in a pixel of several

/// Some number of a row of pixels differs by more than the threshold, as exceeds() says.
bool any_exceeds(const float* before, const float* after, std::size_t count, float threshold) {
  int any = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const float b = std::fabs(before[k]), a = std::fabs(after[k]), largest = b > a ? b : a;
    any |= std::fabs(after[k] - before[k]) > threshold * largest;
  }
  return any != 0;
}

/// All that a pixel of the photograph is made of.
class Compositor {
public:
  Compositor(const PhotoPixels& photo, const DrawnPicture& drawn, const RoomLookup& room,
             const ComposeSettings& settings, const ChangePicture* change)
      : photo_(photo), drawn_(drawn), room_(room), settings_(settings), change_(change) {}

  struct Pixel {
    Rgb value{0.0f};
    float coverage = 0.0f;
  };
  struct Counts {
    std::size_t shadow_pixels = 0, object_pixels = 0;
  };
  /// Pixels of one block of ChangePicture; the result holds the photograph there.
  void fill_block(const PixelBox& block, Composite& result, Counts& counts) const {
    if (drawn_.things && shows_thing(block))
      thing_block(block, result, counts);
    else if (settings_.mode == ShadowMode::ratio && !drawn_.may_show(block))
      change_block(block, result, counts);
    else if (!shadow_block(block, result, counts))
      for (int y = block.y0; y < block.y1; ++y)
        for (int x = block.x0; x < block.x1; ++x)
          if (const auto after = at(x, y))
            write(photo_.index(x, y), *after, result, counts);
  }

private:
  /// Empty where nothing changes.
  std::optional<Pixel> at(int x, int y) const {
    const DrawnPixel pixel = drawn_.photo_pixel(x, y);
    const float coverage = std::min(pixel.object.w, 1.0f);
    const Rgb before = photo_[photo_.index(x, y)];
    if (coverage < kLeastCoverage && !casts_shadow(pixel) && settings_.mode == ShadowMode::ratio) {
      const auto ratio = change_ && settings_.differential ? change_ratio(x, y) : std::nullopt;
      return ratio ? std::optional(Pixel{before * *ratio, coverage}) : std::nullopt;
    }
    Rgb background = before;
    bool differs = coverage >= kLeastCoverage;
    if (coverage < 1.0f && settings_.differential)
      if (const auto loss = loss_at(x, y, pixel)) {
        background = changed(before, loss->loss, loss->reflectance, settings_);
        differs = true;
      }
    if (!differs)
      return std::nullopt;
    return object_over(background, pixel);
  }
  Pixel object_over(const Rgb& background, const DrawnPixel& pixel) const {
    const float coverage = std::min(pixel.object.w, 1.0f);
    if (coverage < kLeastCoverage)
      return {background, coverage};
    return {(1.0f - coverage) * background + settings_.photo.apply(Rgb(pixel.object)), coverage};
  }

  bool shows_thing(const PixelBox& block) const {
    for (int y = block.y0; y < block.y1; ++y)
      for (int x = block.x0; x < block.x1; ++x)
        if (drawn_.things->part[photo_.index(x, y)] > 0.0f)
          return true;
    return false;
  }
  void thing_block(const PixelBox& block, Composite& result, Counts& counts) const {
    for (int y = block.y0; y < block.y1; ++y)
      for (int x = block.x0; x < block.x1; ++x) {
        const std::size_t i = photo_.index(x, y);
        const float part = drawn_.things->part[i];
        if (const auto after = part > 0.0f ? std::optional(at_thing(x, y, part)) : at(x, y))
          write(i, *after, result, counts);
      }
  }
  /// A thing takes its own change of light, and no part in that of the room behind it.
  Pixel at_thing(int x, int y, float part) const {
    const DrawnPixel pixel = drawn_.photo_pixel(x, y);
    const Rgb before = photo_[photo_.index(x, y)];
    if (!settings_.differential || pixel.object.w >= 1.0f)
      return object_over(before, pixel);
    Rgb behind = before;
    if (part < 1.0f)
      if (const auto loss = loss_at(x, y, pixel))
        behind = changed(before, loss->loss, loss->reflectance, settings_);
    return object_over(glm::mix(behind, before * drawn_.things->light_ratio(x, y), part), pixel);
  }

  /// What nothing but the change of indirect light makes of a pixel. One that shows several surfaces of the room holds
  /// the sum of f rho E, f their parts of the pixel: sum f rho (E + change) / sum f rho E.
  std::optional<Rgb> change_ratio(int x, int y) const {
    const std::optional<Rgb> single = change_->ratio_at(x, y);
    if (!single || change_->kind_at(x, y) == ChangePicture::Kind::interpolate || !exceeds(Rgb(1.0f), *single, kLarge))
      return single;
    const std::vector<ViewCorners::Part> parts = change_->view().parts(x, y);
    if (parts.empty())
      return single;
    std::array<std::optional<PixelChange>, kMostRoomParts> change;
    for (std::size_t k = 0; k < parts.size(); ++k)
      change[k] = change_->at(x, y, parts[k].point);
    Rgb before(0.0f), gained(0.0f);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const auto point = room_(parts[k].point.direction, parts[k].point.triangle);
      const Rgb weight = parts[k].fraction * (point ? point->reflectance : Rgb(0.0f));
      before += weight * (change[k] ? change[k]->before : change_->light_before(parts[k].point));
      gained += change[k] ? weight * change[k]->irradiance : Rgb(0.0f);
    }
    return light_ratio(gained, before);
  }

  /// A block where nothing but the indirect light of the room changes.
  void change_block(const PixelBox& block, Composite& result, Counts& counts) const {
    using Kind = ChangePicture::Kind;
    const Kind kind = change_ && settings_.differential ? change_->kind_at(block.x0, block.y0) : Kind::nothing;
    if (kind == Kind::nothing)
      return;
    std::array<Rgb, kBlock> ratio, after;
    for (int y = block.y0; y < block.y1; ++y) {
      const std::size_t first = photo_.index(block.x0, y);
      if (kind == Kind::interpolate) {
        change_->interpolate_row(block.x0, y, block.width(), ratio.data());
        for (int k = 0; k < block.width(); ++k)
          after[k] = photo_[first + k] * ratio[k];
        write_room(first, {after.data(), static_cast<std::size_t>(block.width())}, result, counts);
        continue;
      }
      for (int k = 0; k < block.width(); ++k)
        if (const auto single = change_ratio(block.x0 + k, y))
          write(first + k, {photo_[first + k] * *single, 0.0f}, result, counts);
    }
  }

  /// The room's light at the corner pixels of a block that shows nothing but one plane of the room, all of it seen by
  /// the frame; empty for others.
  std::optional<std::array<RoomPoint, 4>> plain_corners(const PixelBox& block) const {
    if (!change_ || !settings_.differential || settings_.mode != ShadowMode::ratio || !drawn_.shows_plainly(block))
      return std::nullopt;
    const ChangePicture::Kind kind = change_->kind_at(block.x0, block.y0);
    const auto plane = change_->plane_of_block(block.x0, block.y0);
    if (!plane || (kind != ChangePicture::Kind::nothing && kind != ChangePicture::Kind::interpolate))
      return std::nullopt;
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x) {
        const DrawnPixel& pixel = drawn_.frame.at(x, y);
        if (pixel.object.w >= kLeastCoverage || std::find(plane->begin(), plane->end(), pixel.triangle) == plane->end())
          return std::nullopt;
      }
    }
    std::array<RoomPoint, 4> corner;
    for (int k = 0; k < 4; ++k) {
      const int x = k & 1 ? block.x1 - 1 : block.x0, y = k & 2 ? block.y1 - 1 : block.y0;
      const auto point = room_(drawn_.camera.direction(glm::dvec2(x, y)), drawn_.triangle(x, y));
      if (!point)
        return std::nullopt;
      corner[static_cast<std::size_t>(k)] = *point;
    }
    return corner;
  }

  /// Shadow on one plane: the room's light changes slowly there and is looked up at the corners. False: not done.
  bool shadow_block(const PixelBox& block, Composite& result, Counts& counts) const {
    const auto corner = plain_corners(block);
    if (!corner)
      return false;
    const std::array<RoomPoint, 4>& c = *corner;
    const bool changes = change_->kind_at(block.x0, block.y0) == ChangePicture::Kind::interpolate;
    const float per_x = 1.0f / static_cast<float>(std::max(block.width() - 1, 1)),
                per_y = 1.0f / static_cast<float>(std::max(block.height() - 1, 1));
    std::array<PixelChange, kBlock> change{};
    std::array<Rgb, kBlock> after;
    RoomPoint left = c[0], right = c[0], here = c[0];
    for (int y = block.y0; y < block.y1; ++y) {
      if (changes)
        change_->interpolate_row(block.x0, y, block.width(), change.data());
      const float t = per_y * static_cast<float>(y - block.y0);
      mix(c[0], c[2], t, left);
      mix(c[1], c[3], t, right);
      const std::size_t first = photo_.index(block.x0, y);
      for (int k = 0; k < block.width(); ++k) {
        mix(left, right, per_x * static_cast<float>(k), here);
        const DrawnPixel pixel = drawn_.at(block.x0 + k, y);
        RoomLoss loss = direct_loss(pixel, here);
        loss.lost -= change[static_cast<std::size_t>(k)].irradiance;
        after[k] = changed(photo_[first + k], loss, here.reflectance, settings_);
      }
      write_room(first, {after.data(), static_cast<std::size_t>(block.width())}, result, counts);
    }
    return true;
  }

  void write(std::size_t i, const Pixel& after, Composite& result, Counts& counts) const {
    result.coverage[i] = after.coverage;
    if (!exceeds(photo_[i], after.value, settings_.threshold))
      return;
    const bool object = after.coverage >= kLeastCoverage;
    result.picture.texels[i] = after.value;
    result.touched[i] = object ? 2 : 1;
    ++(object ? counts.object_pixels : counts.shadow_pixels);
  }

  /// The same of pixels side by side that show no object.
  void write_room(std::size_t first, std::span<const Rgb> after, Composite& result, Counts& counts) const {
    std::array<Rgb, kBlock> before;
    photo_.read(first, after.size(), before.data());
    if (!any_exceeds(&before[0].r, &after[0].r, 3 * after.size(), settings_.threshold))
      return;
    for (std::size_t k = 0; k < after.size(); ++k)
      if (exceeds(before[k], after[k], settings_.threshold)) {
        result.picture.texels[first + k] = after[k];
        result.touched[first + k] = 1;
        ++counts.shadow_pixels;
      }
  }

  struct Loss {
    RoomLoss loss;
    Rgb reflectance{0.5f};
  };
  /// A photograph's pixel that shows several surfaces of the room holds the sum of f rho E, f their parts of the pixel.
  /// What objects leave of it is the sum of s rho (E - lost), s their parts that show, and is spread over those.
  std::optional<Loss> loss_of_parts(std::span<const DrawnPart> parts, int x, int y) const {
    Rgb before(0.0f), after(0.0f);
    float shown = 0.0f;
    for (const DrawnPart& part : parts) {
      const glm::dvec3 direction = glm::normalize(part.position - drawn_.camera.eye());
      const auto point = room_(direction, part.light.triangle);
      if (!point)
        return std::nullopt;
      RoomLoss loss = direct_loss(part.light, *point);
      if (const auto change =
              change_ ? change_->at(x, y, {true, part.light.triangle, part.position, direction}) : std::nullopt)
        loss.lost -= change->irradiance;
      before += part.light.lost_sky.w * point->reflectance * loss.before;
      after += part.shown * point->reflectance * (loss.before - loss.lost);
      shown += part.shown;
    }
    return Loss{{before, before - after / shown}, Rgb(1.0f)};
  }

  std::optional<Loss> loss_at(int x, int y, const DrawnPixel& pixel) const {
    if (const auto parts = drawn_.parts(x, y); !parts.empty())
      return loss_of_parts(parts, x, y);
    const bool shadow = casts_shadow(pixel);
    const auto change = change_ ? change_->at(x, y) : std::nullopt;
    const bool needs_room = shadow || (change && settings_.mode == ShadowMode::difference);
    const auto point = needs_room
                           ? room_(drawn_.camera.direction(glm::dvec2(drawn_.position(x, y))), drawn_.triangle(x, y))
                           : std::nullopt;
    if ((needs_room && !point) || (!needs_room && !change))
      return std::nullopt;
    Loss loss;
    if (point)
      loss.reflectance = point->reflectance;
    if (shadow)
      loss.loss = direct_loss(pixel, *point);
    else
      loss.loss.before = change->before;
    if (change)
      loss.loss.lost -= change->irradiance;
    return loss;
  }

  const PhotoPixels& photo_;
  const DrawnPicture& drawn_;
  const RoomLookup& room_;
  const ComposeSettings& settings_;
  const ChangePicture* change_;
};

void add_edges(const ThingLayer& things, Composite& result) {
  for (const auto& [i, more] : things.edges) {
    result.picture.texels[i] = glm::max(result.picture.texels[i] + more, Rgb(0.0f));
    result.touched[i] = std::max<std::uint8_t>(result.touched[i], 1);
  }
}

} // namespace

void compose(const PhotoPixels& photo, const RenderedFrame& frame, const RenderCamera& camera, const RoomLookup& room,
             const ComposeSettings& settings, Composite& result, const ChangePicture* change,
             const ThingLayer* things) {
  result.picture.width = photo.width();
  result.picture.height = photo.height();
  result.picture.texels.resize(photo.size()); // keeps the memory of the last frame, as the others do
  result.touched.resize(photo.size());
  result.coverage.resize(photo.size());
  const DrawnPicture drawn{frame, camera, things};
  const Compositor compositor(photo, drawn, room, settings, change);
  std::atomic<std::size_t> object_pixels{0}, shadow_pixels{0};
  parallel_for(0, (photo.height() + kBlock - 1) / kBlock, [&](int row) {
    const int y0 = row * kBlock, y1 = std::min(y0 + kBlock, photo.height());
    const std::size_t first = photo.index(0, y0), count = photo.index(0, y1) - first;
    photo.read(first, count, &result.picture.texels[first]);
    std::fill_n(&result.touched[first], count, std::uint8_t{0});
    std::fill_n(&result.coverage[first], count, 0.0f);
    Compositor::Counts counts;
    for (int x0 = 0; x0 < photo.width(); x0 += kBlock)
      compositor.fill_block({x0, y0, std::min(x0 + kBlock, photo.width()), y1}, result, counts);
    shadow_pixels += counts.shadow_pixels;
    object_pixels += counts.object_pixels;
  });
  result.shadow_pixels = shadow_pixels;
  result.object_pixels = object_pixels;
  if (settings.differential)
    fill_patch_borders(drawn, result);
  if (things)
    add_edges(*things, result);
}

Composite compose(const PhotoPixels& photo, const RenderedFrame& frame, const RenderCamera& camera,
                  const RoomLookup& room, const ComposeSettings& settings) {
  Composite result;
  compose(photo, frame, camera, room, settings, result);
  return result;
}

} // namespace daylit
