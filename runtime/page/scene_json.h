#pragma once

// The scene as text for the page.

#include <string>

#include "runtime/page/session_desk.h"
#include "runtime/session/session.h"

namespace daylit {

std::string objects_json(const Session& session, const ShownParts& shown,
                         const std::vector<std::filesystem::path>& models);
std::string room_json(const Session& session);
/// Needs a sky.
std::string light_json(const Session& session, const SkyImage& sky);

} // namespace daylit
