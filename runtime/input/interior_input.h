#pragma once

// What the interior camera contributes to a frame: its picture, lens, pose, and how its values compare with radiance.

#include <optional>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>

#include "capture/markers/marker_pose.h"
#include "runtime/base/photo_scale.h"
#include "runtime/input/photograph.h"
#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/image/depth_picture.h"

namespace daylit {

struct InteriorInput {
  Photograph photo;
  LensModel lens; ///< for the picture's size
  glm::dmat4 world_from_camera{1.0};
  std::optional<MarkerPose> pose;    ///< when the pose comes from a marker
  std::optional<Rgb> marker_white;   ///< linear RGB of the paper around it, for scale = "marker"
  std::optional<DepthPicture> depth; ///< of the same view
  std::vector<std::string> notes;    ///< one line per thing a user should know
};

/// The lens of [interior] for pictures of that size: scaled when the calibration was made at another resolution of
/// the same view. Errors: of the lens file; a picture of another shape.
Result<LensModel> interior_lens(const InteriorConfig& interior, int width_px, int height_px);

/// Reads and locates the picture of [interior] with [pose] or [marker]. A given [pose] wins over the marker's.
Result<InteriorInput> read_interior(const RunConfig& config);

/// scale = "marker": the photograph's white divided by the radiance that paper of `white_reflectance` has under
/// `irradiance` (simulated, at the marker, facing along the board's z; radiance unit x sr). Without a colour matrix of
/// the user's the three channels are matched one by one, as a camera's white balance does; with one, the luminance.
/// Error value_invalid: a channel without simulated light, or a black white.
Result<PhotoScale> scale_from_marker(const Rgb& marker_white, const Rgb& irradiance, double white_reflectance,
                                     const glm::dmat3& colour_matrix);

/// The same with the irradiance worked out: indirect light of the room's volume and the direct sky at the marker.
/// config.marker and input.marker_white must be there. Errors: the volume cannot be read, the marker is outside it.
Result<PhotoScale> scale_from_marker(const RunConfig& config, const InteriorInput& input, const SkyImage& sky);

} // namespace daylit
