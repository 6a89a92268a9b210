#pragma once

// Frames of a GigE Vision or USB3 Vision camera, through Aravis, or of a Video4Linux device (video_camera.h).

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frames/frame_source.h"

namespace daylit {

/// A camera that answers discovery.
struct FoundCamera {
  std::string id;      ///< what CameraSettings::camera takes; "vendor-model-serial" as a rule, or "/dev/video0"
  std::string address; ///< of its network interface; empty for USB
};

/// Asks all interfaces; about a second.
std::vector<FoundCamera> find_cameras();

/// Everything is set anew each time the camera is opened: cameras keep what another program has set.
struct CameraSettings {
  std::string camera;           ///< id, network address or /dev/video0; empty: the only one there is
  std::string pixel_format;     ///< name in the camera, "Mono16", "BayerRG8", "RGB8"; empty: as the camera has it
  std::optional<Mosaic> mosaic; ///< what the samples are when the camera calls them mono
  std::optional<double> exposure_us, gain, frame_rate_hz;
  std::optional<int> width_px, height_px;
  /// Instead of exposure_us: one after another, the next one is set whenever a frame has come. Which frame it takes
  /// effect for depends on the camera: the frames state no exposure.
  std::vector<int> exposures_us;
  int packet_bytes = 0; ///< network packets; 0: as the network allows (Aravis tries)
};

/// Opens the camera in a thread of its own and keeps it open: while it does not answer, is unplugged or frozen, next()
/// gives nothing and report().trouble says why; it is tried again every half second until the source goes.
/// Damaged frames are counted and never given out. `each`, if given, is called in that thread with every whole frame,
/// also those that are superseded; it must be quick. Error value_invalid: settings that no camera can have.
Result<std::unique_ptr<FrameSource>> open_camera(const CameraSettings& settings,
                                                 std::function<void(const CameraFrame&)> each = {});

} // namespace daylit
