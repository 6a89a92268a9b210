#pragma once

// What stands between a CONFIG.toml and its picture on this machine, and what to change. Nothing is changed and no
// camera's setting touched before `look_at_cameras`.

#include <filesystem>

#include "capture/frames/aravis_source.h"
#include "runtime/doctor/finding.h"
#include "runtime/doctor/machine.h"
#include "scene/config/config.h"

namespace daylit {

/// Volume and room model (baked from it, and not damaged), objects (readable, inside the room), lens files, pictures
/// where there are no cameras.
Findings check_inputs(const RunConfig& config);

/// A camera of the configuration: is it in `found`, in a network of this machine, with packets that fit through.
/// `subject`: "sky camera". `frame_bytes`: of one frame, 0: not known.
Findings check_camera(const CameraConfig& camera, const std::string& subject, const std::vector<FoundCamera>& found,
                      const Machine& machine, std::size_t frame_bytes);

/// Opens the camera with the settings of the configuration and waits for a frame: its size against the lens file's.
/// Up to ten seconds.
Finding check_frame(const CameraConfig& camera, const std::string& subject, const std::filesystem::path& lens);

/// Folders that the daemon writes to.
Findings check_disks(const RunConfig& config);

/// Token file and port of [http].
Findings check_http(const HttpConfig& http);

/// Everything, in the order of a start. A configuration that cannot be read is the only finding then.
Findings examine(const std::filesystem::path& config);

} // namespace daylit
