#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "scene/program.h"
#include "scene/result.h"

namespace daylit {

/// daylit-simulate SCENE.toml -o DIR, or --demo NAME -o DIR.
struct SimulateArguments {
  std::filesystem::path scene, folder;
  std::string demo; ///< overcast, sun or shade: writes the scene into the folder first
  std::vector<int> size{512, 496};
  int frames = 1;
  int samples = 0; ///< 0: as the scene says
  std::uint32_t seed = 0;
  bool quiet = false, json = false;
};

/// Writes sky.exr, sky.yaml, interior.exr, interior.yaml, truth.exr, se.exr, mask.exr, mask.png, interior.png,
/// truth.png and CONFIG.toml. With --frames N > 1 the pictures of frame k > 0 carry its number (truth_0001.exr) and
/// another sensor noise.
Result<void> run_simulate(const SimulateArguments& arguments);

} // namespace daylit
