#pragma once

// One augmented camera: everything that is loaded once, and the work of one frame.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runtime/input/interior_input.h"
#include "runtime/render/compose.h"
#include "scene/config.h"
#include "scene/program.h"
#include "scene/result.h"
#include "scene/sky_image.h"

namespace daylit {

/// Wall-clock milliseconds of the stages of a frame, in order, and what was skipped.
struct FrameReport {
  std::vector<std::pair<std::string, double>> stage_ms;
  double total_ms = 0.0;
  std::size_t sky_lights = 0, sun_lights = 0;
  std::size_t object_pixels = 0, shadow_pixels = 0;
  std::vector<std::string> skipped;
};

struct Frame {
  Composite composite;
  FrameReport report;
};

class Session {
public:
  /// Loads volume and objects, and starts the renderer. `interior`: the camera's lens, place and the size of the
  /// pictures that render() will be given. Errors: any file, no OpenGL.
  static Result<Session> open(const RunConfig& config, const InteriorInput& interior, const Progress& progress);
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  ~Session();

  /// scale = "marker": photograph per radiance, from the white of the board and the light simulated there under `sky`.
  Result<PhotoScale> scale_from_marker(const SkyImage& sky, const Rgb& marker_white) const;
  void set_photo_scale(const PhotoScale& scale);

  /// `photo`: linear. Error: the picture has another size than announced; graphics failed.
  Result<Frame> render(const SkyImage& sky, const RgbImage& photo);

  const std::vector<std::string>& notes() const;
  std::string renderer_description() const;

private:
  struct State;
  explicit Session(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
