#include "scene/format/foreign_model.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "scene/core/lower_case.h"

namespace daylit::detail {

std::optional<Error> refuse_foreign_model(const std::filesystem::path& path, const std::string& known) {
  static constexpr std::array<std::string_view, 22> kForeign = {
      ".3ds", ".3mf", ".abc",  ".blend", ".c4d", ".dae", ".dxf",  ".fbx",  ".iges", ".lwo", ".max",
      ".off", ".skp", ".step", ".stl",   ".stp", ".usd", ".usda", ".usdc", ".usdz", ".wrl", ".x3d"};
  const std::string extension = lower_case(path.extension().string());
  if (std::ranges::find(kForeign, extension) == kForeign.end())
    return std::nullopt;
  return Error{ErrorCode::file_malformed, extension + " files are not read", path.string(), "export it as " + known};
}

} // namespace daylit::detail
