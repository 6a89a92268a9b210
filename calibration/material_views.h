#pragma once

// Photographs of a room of which everything but the colours of the walls is known: pose, lens, scale, light outside.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/lens.h"
#include "scene/room/room_formats.h"
#include "scene/sky/sky_image.h"

namespace daylit::calibration {

struct MaterialView {
  std::string name;                                          ///< of its configuration, without the folder
  RgbImage radiance;                                         ///< in the unit of the sky picture
  std::vector<std::uint8_t> left_out;                        ///< per pixel: kMasked, kOverRange or 0
  static constexpr std::uint8_t kMasked = 1, kOverRange = 2; ///< over range: the radiance is only known from below
  LensModel lens;
  glm::dmat4 world_from_camera{1.0}; ///< camera x right, y down, z forward
  std::size_t sky = 0;               ///< index into MaterialScene::skies
};

struct MaterialScene {
  RoomFile room;
  std::vector<SkyImage> skies;
  std::vector<MaterialView> views;
};

/// `configs`: a CONFIG.toml of daylit-run for each photograph, all of one [room] model; [room] volume and [[object]]
/// are not needed. `masks`: none, or one for each, where white is left out; "-" stands for none. Errors: of the files;
/// rooms that differ; neither [pose] nor a board of [marker] in the picture; scale = "marker"; a picture or mask of
/// another size than the lens.
Result<MaterialScene> read_material_scene(const std::vector<std::filesystem::path>& configs,
                                          const std::vector<std::filesystem::path>& masks);

} // namespace daylit::calibration
