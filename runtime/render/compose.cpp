#include "runtime/render/compose.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/render/change_picture.h"

namespace daylit {

namespace {

constexpr float kLeastCoverage = 1.0f / 510.0f;

/// The three drawn values at a photograph pixel.
struct DrawnPixel {
  glm::vec4 object{0.0f}, lost_sky{0.0f}, room{0.0f};
};

struct DrawnPicture {
  const RenderedFrame& frame;
  const RenderCamera& camera;

  DrawnPixel at(int x, int y) const {
    if (!frame.box.contains(x, y))
      return {};
    const std::size_t i = frame.index(x, y);
    return {frame.object[i], frame.lost_sky[i], frame.room[i]};
  }

  /// Photograph pixels outside show nothing new.
  PixelBox photo_box() const {
    return camera.drawn_position.empty() ? frame.box : PixelBox{0, 0, camera.photo_width_px, camera.photo_height_px};
  }

  const RoomSurface* surface(int x, int y) const {
    if (!camera.drawn_position.empty() || frame.surface.empty())
      return nullptr;
    const RoomSurface& seen = frame.surface[frame.index(x, y)];
    return seen.triangle == 0xFFFFFFFFu ? nullptr : &seen;
  }

  glm::vec2 position(int x, int y) const {
    return camera.drawn_position.empty()
               ? glm::vec2(x, y)
               : camera.drawn_position[static_cast<std::size_t>(y) * camera.photo_width_px + x];
  }

  /// The drawn pixel itself, or the bilinear mean of four where the photograph is distorted.
  DrawnPixel photo_pixel(int x, int y) const {
    if (camera.drawn_position.empty())
      return at(x, y);
    const glm::vec2 p = position(x, y);
    if (p.x < 0.0f || p.y < 0.0f)
      return {};
    const int x0 = std::min(static_cast<int>(p.x), frame.width_px - 1), x1 = std::min(x0 + 1, frame.width_px - 1);
    const int y0 = std::min(static_cast<int>(p.y), frame.height_px - 1), y1 = std::min(y0 + 1, frame.height_px - 1);
    const float s = p.x - static_cast<float>(x0), t = p.y - static_cast<float>(y0);
    const DrawnPixel a = at(x0, y0), b = at(x1, y0), c = at(x0, y1), d = at(x1, y1);
    const auto mix = [&](const glm::vec4& pa, const glm::vec4& pb, const glm::vec4& pc, const glm::vec4& pd) {
      return (1.0f - t) * ((1.0f - s) * pa + s * pb) + t * ((1.0f - s) * pc + s * pd);
    };
    return {mix(a.object, b.object, c.object, d.object), mix(a.lost_sky, b.lost_sky, c.lost_sky, d.lost_sky),
            mix(a.room, b.room, c.room, d.room)};
  }
};

/// Irradiance of the room at a pixel: without the objects, and what they take (negative: give).
struct RoomLoss {
  Rgb before{0.0f}, lost{0.0f};
};

RoomLoss direct_loss(const DrawnPixel& drawn, const RoomPoint& point) {
  const Rgb lost_sky = Rgb(drawn.lost_sky) / drawn.lost_sky.w;
  const glm::vec3 shares = glm::vec3(drawn.room) / drawn.lost_sky.w;
  return {point.open_sky_irradiance * shares.x + point.sun_normal_irradiance * shares.y + point.indirect_irradiance,
          point.open_sky_irradiance * lost_sky + point.sun_normal_irradiance * shares.z};
}

bool casts_shadow(const DrawnPixel& pixel) {
  return pixel.lost_sky.w > 0.0f &&
         std::max({pixel.lost_sky.x, pixel.lost_sky.y, pixel.lost_sky.z, pixel.room.z}) > 0.0f;
}

/// The photograph's pixel after that.
Rgb changed(const Rgb& photo, const RoomLoss& loss, const Rgb& reflectance, const ComposeSettings& settings) {
  if (settings.mode == ShadowMode::difference) {
    const Rgb change = reflectance * loss.lost * std::numbers::inv_pi_v<float>;
    return glm::max(photo - settings.photo.apply(change), Rgb(0.0f));
  }
  Rgb ratio(1.0f);
  for (int c = 0; c < 3; ++c)
    if (loss.before[c] > 0.0f)
      ratio[c] = std::max(1.0f - loss.lost[c] / loss.before[c], 0.0f);
  return photo * ratio;
}

/// All that a pixel of the photograph is made of.
class Compositor {
public:
  Compositor(const RgbImage& photo, const DrawnPicture& drawn, const RoomLookup& room, const ComposeSettings& settings,
             const ChangePicture* change)
      : photo_(photo), drawn_(drawn), room_(room), settings_(settings), change_(change) {}

  PixelBox box() const {
    PixelBox box = drawn_.photo_box();
    if (change_)
      box.include(change_->box());
    return box.clipped(photo_.width, photo_.height);
  }

  struct Pixel {
    Rgb value{0.0f};
    float coverage = 0.0f;
  };
  /// Empty where nothing changes.
  std::optional<Pixel> at(int x, int y) const {
    const DrawnPixel pixel = drawn_.photo_pixel(x, y);
    const float coverage = std::min(pixel.object.w, 1.0f);
    const Rgb before = photo_.at(x, y);
    if (coverage < kLeastCoverage && !casts_shadow(pixel) && settings_.mode == ShadowMode::ratio) {
      const auto ratio = change_ && settings_.differential ? change_->ratio_at(x, y) : std::nullopt;
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
    if (coverage < kLeastCoverage)
      return Pixel{background, coverage};
    return Pixel{(1.0f - coverage) * background + settings_.photo.apply(Rgb(pixel.object)), coverage};
  }

private:
  struct Loss {
    RoomLoss loss;
    Rgb reflectance{0.5f};
  };
  std::optional<Loss> loss_at(int x, int y, const DrawnPixel& pixel) const {
    const bool shadow = casts_shadow(pixel);
    const auto change = change_ ? change_->at(x, y) : std::nullopt;
    const bool needs_room = shadow || (change && settings_.mode == ShadowMode::difference);
    const auto point = needs_room
                           ? room_(drawn_.camera.direction(glm::dvec2(drawn_.position(x, y))), drawn_.surface(x, y))
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

  const RgbImage& photo_;
  const DrawnPicture& drawn_;
  const RoomLookup& room_;
  const ComposeSettings& settings_;
  const ChangePicture* change_;
};

bool exceeds(const Rgb& before, const Rgb& after, float threshold) {
  for (int c = 0; c < 3; ++c)
    if (std::fabs(after[c] - before[c]) > threshold * std::max(std::fabs(before[c]), std::fabs(after[c])))
      return true;
  return false;
}

} // namespace

Rgb PhotoScale::apply(const Rgb& radiance) const { return Rgb(scale * (colour_matrix * glm::dvec3(radiance))); }

void compose(const RgbImage& photo, const RenderedFrame& frame, const RenderCamera& camera, const RoomLookup& room,
             const ComposeSettings& settings, Composite& result, const ChangePicture* change) {
  result.picture = photo; // assignment keeps the memory of the last frame
  result.touched.assign(photo.texels.size(), 0);
  result.coverage.assign(photo.texels.size(), 0.0f);
  const DrawnPicture drawn{frame, camera};
  const Compositor compositor(photo, drawn, room, settings, change);
  const PixelBox box = compositor.box();
  std::atomic<std::size_t> object_pixels{0}, shadow_pixels{0};
  tbb::parallel_for(tbb::blocked_range<int>(box.y0, std::max(box.y0, box.y1), 4), [&](const auto& rows) {
    std::size_t count[3] = {};
    for (int y = rows.begin(); y != rows.end(); ++y)
      for (int x = box.x0; x < box.x1; ++x) {
        const auto after = compositor.at(x, y);
        if (!after)
          continue;
        const std::size_t i = static_cast<std::size_t>(y) * photo.width + x;
        result.coverage[i] = after->coverage;
        if (!exceeds(photo.texels[i], after->value, settings.threshold))
          continue;
        const std::uint8_t kind = after->coverage < kLeastCoverage ? 1 : 2;
        result.picture.texels[i] = after->value;
        result.touched[i] = kind;
        ++count[kind];
      }
    shadow_pixels += count[1];
    object_pixels += count[2];
  });
  result.shadow_pixels = shadow_pixels;
  result.object_pixels = object_pixels;
}

Composite compose(const RgbImage& photo, const RenderedFrame& frame, const RenderCamera& camera, const RoomLookup& room,
                  const ComposeSettings& settings) {
  Composite result;
  compose(photo, frame, camera, room, settings, result);
  return result;
}

} // namespace daylit
