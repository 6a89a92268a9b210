#pragma once

// Pixels that show one material each, with the light that falls on what they show.

#include <cstdint>
#include <vector>

#include "calibration/material_views.h"
#include "calibration/room_transport.h"

namespace daylit::calibration {

struct MaterialSample {
  std::uint32_t view = 0, material = 0;
  std::uint32_t tile = 0; ///< part of the picture, counted over all views: errors of the model are alike there
  Rgb radiance{0.0f};     ///< measured
  Rgb direct{0.0f};       ///< irradiance straight from the sky
  glm::vec2 pixel{0.0f};
};

struct MaterialSamples {
  static constexpr std::size_t kRays = 256; ///< cosine-distributed, from each point
  std::vector<MaterialSample> list;
  std::vector<std::int32_t> patch;           ///< [sample][ray]: what the rays meet, -1 for the outside
  std::vector<std::vector<double>> coverage; ///< [view][material]: fraction of the picture
  std::vector<double> over_range;            ///< [view]: fraction of the pixels that show surfaces
};

/// Of each material at most a fixed number from each view, evenly spread; none where masked, over range, beside the
/// edge of a surface (the lens mixes both) or black. Error: interrupted.
Result<MaterialSamples> sample_materials(const MaterialScene& scene, const RoomTransport& transport,
                                         const Progress& progress);

/// Ray through a pixel, world; empty outside the field of the lens.
std::optional<glm::dvec3> pixel_direction(const MaterialView& view, const glm::dvec2& pixel);

} // namespace daylit::calibration
