#pragma once

#include <filesystem>

#include "scene/core/result.h"

namespace daylit {

/// daylit-simulate compare DIR: a result against truth.exr, interior.exr, mask.exr and se.exr of the folder.
struct CompareArguments {
  std::filesystem::path folder, result, result_mask, output;
  int frame = 0; ///< of a sequence
  bool json = false;
};

/// Prints the table (or JSON) on stdout; with `output` also writes result, truth and difference side by side as PNG.
Result<void> run_compare(const CompareArguments& arguments);

} // namespace daylit
