#pragma once

#include <filesystem>
#include <string>

#include "scene/core/result.h"
#include "scene/sky/sky.h"

namespace daylit {

/// daylit-simulate compare DIR: a result against truth.exr, interior.exr, mask.exr and se.exr of the folder.
struct CompareArguments {
  std::filesystem::path folder, result, result_mask, second_truth, output;
  int frame = 0; ///< of a sequence
  int zoom = 0;  ///< > 0: `output` shows the object's surroundings alone, so many times as large
  bool force = false, json = false;
};

/// Prints the table (or JSON) on stdout; with `output` also writes result, truth and difference side by side as PNG.
Result<void> run_compare(const CompareArguments& arguments);

/// daylit-simulate sky: the radiance of a sky along directions from stdin, or the sky as an equirectangular picture.
struct SkyCommandArguments {
  SkyArguments sky;
  double ground_albedo = -1.0;  ///< < 0: what the sky says
  std::filesystem::path output; ///< EXR; empty: answer directions
  int height_px = 512;
  bool force = false, quiet = false, json = false;
};

Result<void> run_sky(const SkyCommandArguments& arguments);

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
