#pragma once

// What the page in the browser asks about the scene, and what it changes.

#include <vector>

#include "runtime/http/http_server.h"
#include "runtime/page/scene_editor.h"
#include "runtime/page/session_desk.h"

namespace daylit {

/// Both outlive the server.
///   GET  /scene          objects, parts of the light shown, camera, models that objects can be made of
///   GET  /scene/room     triangles, windows, the probes that are shown
///   GET  /scene/light    light at these probes, light samples and windows in the sky picture, sun
///   GET  /scene/regions  outlines of the sky regions that count, an SVG path in the sky picture
///                        (both null before the first sky)
///   GET  /scene/sky.jpg  the sky picture
///   GET  /scene/pick?x=&y=   the object under a pixel of the photograph
///   POST /scene/change   {"object": 0, "position": [x, y, z], "rotation": [...], "scale": 1}
///                        or "pixel": [x, y], "grip": [x, y] in the place of the position
///   POST /scene/add      {"model": 0, "position": [x, y, z]}
///   POST /scene/remove   {"object": 0}
///   POST /scene/show     {"direct": true, "indirect": true, "differential": true}
///   POST /scene/save     to the configuration file
/// Lengths in metres, world; angles in degrees. A failure is {"error": "what; what to do"}.
std::vector<HttpRoute> scene_routes(SessionDesk& desk, SceneEditor& editor);

} // namespace daylit
