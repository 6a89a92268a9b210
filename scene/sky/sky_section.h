#pragma once

#include <string>

#include "scene/format/toml_section.h"
#include "scene/sky/sky_description.h"

namespace daylit::detail {

/// [sky] of SCENE.toml; what is wrong is reported to the section's file.
void read_sky_section(TomlSection sky, SkyDescription& description);
/// Reading it back gives the same model. Weather and Perez skies become "general".
std::string sky_toml(const SkyModel& sky);

} // namespace daylit::detail
