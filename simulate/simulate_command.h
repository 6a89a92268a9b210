#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

/// daylit-simulate SCENE.toml -o DIR, or --demo NAME -o DIR.
struct SimulateArguments {
  std::filesystem::path scene, folder;
  std::string depth;          ///< "exr" or "png": a depth picture of the room is written too; empty: none
  double depth_noise_m = 0.0; ///< deviation of a depth 1 m away, as [interior] depth_noise_m
  std::string demo;           ///< overcast, sun or shade: writes the scene into the folder first
  std::vector<int> size{512, 496};
  int frames = 1;
  int samples = 0; ///< 0: as the scene says
  std::uint32_t seed = 0;
  bool force = false; ///< replace files of these names that hold something else
  bool quiet = false, json = false;
};

/// Writes sky.exr and sky.yaml (unless the scene names a sky picture), interior.exr, interior.yaml, truth.exr, se.exr,
/// mask.exr, mask.png, interior.png, truth.png and CONFIG.toml; with `depth` also depth.exr or depth.png. With --frames
/// N > 1 camera and sun go along the scene's [path]; the pictures and the configuration of frame k > 0 carry its number
/// (truth_0001.exr, CONFIG_0001.toml). Each frame has its own sensor noise.
Result<void> run_simulate(const SimulateArguments& arguments);

} // namespace daylit
