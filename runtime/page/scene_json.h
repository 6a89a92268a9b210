#pragma once

// The scene as text for the page.

#include <string>

#include "runtime/page/session_desk.h"
#include "runtime/session/session.h"

namespace daylit {

std::string objects_json(const Session& session, const ShownParts& shown,
                         const std::vector<std::filesystem::path>& models);
std::string room_json(const Session& session);
/// Outlines of the sky regions whose light reaches a probe, as one SVG path in pixels of the sky picture.
std::string regions_json(const Session& session, const SkyImage& sky);
/// Needs a sky.
std::string light_json(const Session& session, const SkyImage& sky);

} // namespace daylit
