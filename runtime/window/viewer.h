#pragma once

#include <deque>
#include <functional>

#include "runtime/session/session.h"
#include "scene/image/image_formats.h"

namespace daylit {

/// The times of the last frames as bars in the lower left corner of a picture.
class FrameGraph {
public:
  static constexpr int kFrames = 120, kHeight_px = 60;
  static constexpr double kTop_ms = 100.0, kLine_ms = 1000.0 / 30.0; ///< longest bar; drawn line

  void add(double milliseconds);
  void draw(Rgb8Image& picture) const;

private:
  std::deque<double> times_;
};

/// What the window starts from.
struct ViewedPicture {
  PhotoPixels photo;
  const DepthPicture* depth = nullptr; ///< of the photograph's view; null: none
};

/// Shows the augmented picture in a window and lets the user turn the camera, drag objects and switch parts of the
/// light, until the window is closed or `most_frames` were drawn (0: no end). `encode`: picture to what is
/// shown. Away from the photograph's pose the room's model stands for it. Objects with `on` stay on the surfaces of the
/// room while they are dragged. `save` is called when the user asks for it. Error: of the window or the session.
Result<void> run_viewer(Session& session, const SkyImage& sky, const ViewedPicture& viewed,
                        const std::function<Rgb8Image(const RgbImage&)>& encode, const std::function<void()>& save,
                        int most_frames);

} // namespace daylit
