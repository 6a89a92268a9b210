#pragma once

// Differential composite (Debevec 1998; Gibson & Murta 2000): only the change that the virtual objects cause is added
// to the photograph. A pixel that they do not change keeps its bits.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "runtime/base/photo_pixels.h"
#include "runtime/base/photo_scale.h"
#include "runtime/base/render_camera.h"
#include "runtime/indirect/room_light.h"
#include "runtime/picture/picture_renderer.h"
#include "scene/image/rgb_image.h"

namespace daylit {

enum class ShadowMode {
  ratio,      ///< photo x L_with / L_without: right for textured surfaces, unknown reflectance, saturated pixels
  difference, ///< photo - (L_without - L_with): right where the room model's reflectance is
};

struct ComposeSettings {
  PhotoScale photo;
  ShadowMode mode = ShadowMode::ratio;
  /// Smallest relative change of a linear pixel that is written: half a code value of 255.
  float threshold = 1.0f / 510.0f;
  bool differential = true; ///< false: objects are drawn on the photograph, and nothing happens to it
};

struct Composite {
  RgbImage picture;                  ///< linear, in the photograph's scale
  std::vector<std::uint8_t> touched; ///< per pixel: 0 = bit-identical to the photograph, 1 = shadow, 2 = object
  std::vector<float> coverage;       ///< per pixel: fraction of it that visible virtual objects fill
  std::size_t object_pixels = 0, shadow_pixels = 0; ///< shadow: every pixel of the room that changes
};

/// What the room shows along a world direction from the camera; empty where there is no surface. `triangle`: that is
/// seen there, or kUnknownTriangle.
using RoomLookup = std::function<std::optional<RoomPoint>(const glm::dvec3& direction, std::uint32_t triangle)>;

/// Real things that stand before the room's model (runtime/depth/thing_layer.h).
struct ThingLayer;
/// What the objects do to the indirect light of the room, where it is known (change_picture.h).
class ChangePicture;

/// `photo`: camera.photo_width_px x photo_height_px. `room` is called, from several threads, only for pixels
/// that lose light. Giving the last composite of the same size again saves its memory.
void compose(const PhotoPixels& photo, const RenderedFrame& frame, const RenderCamera& camera, const RoomLookup& room,
             const ComposeSettings& settings, Composite& result, const ChangePicture* change = nullptr,
             const ThingLayer* things = nullptr);
Composite compose(const PhotoPixels& photo, const RenderedFrame& frame, const RenderCamera& camera,
                  const RoomLookup& room, const ComposeSettings& settings);

} // namespace daylit
