#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "runtime/base/photo_pixels.h"
#include "runtime/session/cached.h"
#include "runtime/session/session.h"
#include "runtime/sky/sky_map.h"
#include "runtime/sky/steady_sun.h"
#include "scene/image/rgb_image.h"
#include "scene/volume/volume_combiner.h"

namespace daylit {

/// Tells whether a picture is the one before: by its id where the source gives one, else by its bits.
class PictureVersion {
public:
  /// Grows when the picture differs from the one of the last call. `context`: another one makes another picture.
  Version of(const PhotoPixels& image, std::uint64_t id, const void* context = nullptr) {
    const bool alike =
        version_ > 0 && context == context_ && image.width() == width_ && image.height() == height_ && id == id_;
    if (alike && (id != 0 || image.same_as(copy_)))
      return version_;
    if (id == 0)
      copy_ = image.copy();
    context_ = context;
    id_ = id;
    width_ = image.width();
    height_ = image.height();
    return ++version_;
  }

private:
  RgbImage copy_; ///< of the last picture, when it had no id
  Version version_ = 0;
  const void* context_ = nullptr;
  std::uint64_t id_ = 0;
  int width_ = 0, height_ = 0;
};

/// What a picture of the sky says about its radiance.
struct SkyLight {
  std::vector<SkyMap> pyramid;    ///< without the sun
  std::optional<DetectedSun> sun; ///< its energy steadied over frames
};

/// From a picture of the sky to its light outside and in the room.
class SkyStage {
public:
  /// `volume` must outlive it.
  explicit SkyStage(const BasisVolume& volume) : volume_(volume), combiner_(VolumeCombiner::make(volume)) {}

  /// Adds its times to the report.
  void update(const SkyImage& sky, std::uint64_t id, FrameReport& report);

  const SkyLight& operator*() const { return *light_; }
  const SkyLight* operator->() const { return &*light_; }
  const LightField& field() const { return combiner_.field(); } ///< indirect light at the probes
  Version version() const { return light_.version(); }

private:
  /// What depends on the camera of the sky only.
  struct Tables {
    std::shared_ptr<const SkyGeometry> geometry;
    SkyResampler resampler;
    RegionSums regions;
  };
  Tables make_tables(const SkyImage& sky) const;

  const BasisVolume& volume_;
  VolumeCombiner combiner_;
  PictureVersion picture_;
  SteadySun steady_sun_;
  std::optional<Tables> tables_;
  Cached<SkyLight> light_;
};

} // namespace daylit
