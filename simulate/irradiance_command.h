#pragma once

#include <filesystem>
#include <string>

#include "scene/core/result.h"
#include "scene/sky/sky.h"

namespace daylit {

/// daylit-simulate irradiance: points on stdin, values and standard errors on stdout.
struct IrradianceArguments {
  std::filesystem::path room;
  SkyArguments sky;
  std::string up = "z";
  double ground_albedo = -1.0; ///< < 0: 0.2 where a fish-eye sees no ground, else what the sky says
  int samples = 8192;
  std::uint32_t seed = 0;
  bool coefficients = false, total = false, quiet = false, json = false;
};

Result<void> run_irradiance(const IrradianceArguments& arguments);

} // namespace daylit
