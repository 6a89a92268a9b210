#include "runtime/live/frame_drawer.h"

#include <cstdio>

namespace daylit {

Result<const Frame*> render_again_once(Session& session, const FrameInput& input) {
  auto frame = session.render(input);
  if (frame || frame.error().code != ErrorCode::device)
    return frame;
  std::fprintf(stderr, "daylit-run: %s; starting the renderer again\n", frame.error().message().c_str());
  if (const auto again = session.recreate_renderer(); !again)
    return again.error();
  return session.render(input);
}

Result<FrameDrawer> FrameDrawer::open(const RunConfig& given, int width, int height, Backend backend,
                                      const Progress& progress) {
  RunConfig config = given;
  if (!config.world_from_camera) // each frame brings its own
    config.world_from_camera = glm::dmat4(1.0);
  auto session = Session::open(config, width, height, progress, backend);
  if (!session)
    return session.error();
  return FrameDrawer(std::move(*session));
}

Result<const Composite*> FrameDrawer::draw(const FrameToDraw& f) {
  const PhotoPixels pixels = f.photo.pixels();
  if (!f.can_be_drawn()) {
    untouched_.picture = pixels.copy();
    untouched_.touched.assign(pixels.size(), 0);
    untouched_.coverage.assign(pixels.size(), 0.0f);
    report_ = {};
    return &untouched_;
  }
  if (const auto posed = session_.set_pose(f.pose.world_from_camera); !posed)
    return posed.error();
  const auto frame = render_again_once(session_, {*f.sky, pixels, f.sky_id, f.photo_id, f.depth});
  if (!frame)
    return frame.error();
  report_ = (*frame)->report;
  return &(*frame)->composite;
}

} // namespace daylit
