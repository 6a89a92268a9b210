#pragma once

#include <filesystem>
#include <string>

#include "scene/result.h"
#include "scene/sky_image.h"

namespace daylit {

/// daylit-simulate irradiance: points on stdin, values and standard errors on stdout.
struct IrradianceArguments {
  std::filesystem::path room, sky;
  std::string projection = "equirect", up = "z";
  std::vector<double> forward{1.0, 0.0, 0.0}, sky_up{0.0, 0.0, 1.0};
  double sky_rotation_deg = 0.0;
  double ground_albedo = 0.2;
  int samples = 8192;
  std::uint32_t seed = 0;
  bool coefficients = false, total = false, quiet = false, json = false;
};

Result<void> run_irradiance(const IrradianceArguments& arguments);

} // namespace daylit
