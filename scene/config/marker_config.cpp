#include "scene/config/marker_config.h"

#include "scene/config/config_sections.h"

namespace daylit {

Result<MarkerConfig> read_marker_config(const std::filesystem::path& path) {
  auto file = detail::parse_config_file(path);
  if (!file)
    return file.error();
  detail::TomlSection root(*file, &file->root, "");
  std::optional<MarkerConfig> marker;
  detail::read_marker(root.section("marker"), marker);
  if (!marker)
    file->report(1, "section [marker] is missing: it says what the board is and where it hangs");
  if (auto error = file->error())
    return *error;
  return *marker;
}

} // namespace daylit
