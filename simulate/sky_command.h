#pragma once

#include <filesystem>

#include "scene/core/result.h"
#include "scene/sky/sky.h"

namespace daylit {

/// daylit-simulate sky: the radiance of a sky along directions from stdin, or the sky as an equirectangular picture.
struct SkyCommandArguments {
  SkyArguments sky;
  double ground_albedo = -1.0;  ///< < 0: what the sky says
  std::filesystem::path output; ///< EXR; empty: answer directions
  int height_px = 512;
  bool quiet = false, json = false;
};

Result<void> run_sky(const SkyCommandArguments& arguments);

} // namespace daylit
