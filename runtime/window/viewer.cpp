#include "runtime/window/viewer.h"

#include <algorithm>
#include <cmath>

#include "runtime/window/view_control.h"
#include "runtime/window/view_window.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

std::vector<BoundingSphere> spheres_of(const Session& session, std::size_t objects) {
  std::vector<BoundingSphere> spheres;
  for (std::size_t k = 0; k < objects; ++k)
    spheres.push_back(session.object_bounds(k));
  return spheres;
}

/// The photograph, or what the room's model shows from elsewhere.
class Background {
public:
  Background(const PhotoPixels& photo, const glm::dmat4& pose) : photo_(photo), model_(photo.copy()), pose_(pose) {}

  /// The light of the session's last frame. Returns whether there is another picture than before.
  bool follow(Session& session, const glm::dmat4& pose) {
    if (pose == seen_from_)
      return false;
    seen_from_ = pose;
    ++number_;
    if (pose != pose_)
      parallel_for(0, model_.height, [&](int y) {
        for (int x = 0; x < model_.width; ++x)
          model_.at(x, y) = session.room_radiance({x, y});
      });
    return true;
  }
  PhotoPixels picture() const { return seen_from_ == pose_ ? photo_ : PhotoPixels(model_); }
  std::uint64_t number() const { return number_; }

private:
  PhotoPixels photo_;
  RgbImage model_;
  glm::dmat4 pose_, seen_from_{0.0};
  std::uint64_t number_ = 0;
};

Result<void> follow(Session& session, const ViewControl& control, std::vector<ObjectConfig>& objects,
                    const glm::dmat4& photo_pose) {
  session.show(control.parts());
  for (std::size_t k = 0; k < objects.size(); ++k)
    if (objects[k].position != control.position(k)) {
      objects[k].position = control.position(k);
      if (const auto placed = session.set_placement(k, objects[k]); !placed)
        return placed;
    }
  return session.set_pose(control.orbit() ? control.orbit()->pose() : photo_pose);
}

} // namespace

void FrameGraph::add(double milliseconds) {
  times_.push_back(milliseconds);
  if (times_.size() > kFrames)
    times_.pop_front();
}

void FrameGraph::draw(Rgb8Image& picture) const {
  const auto height_of = [](double ms) {
    return static_cast<int>(std::lround(kHeight_px * std::clamp(ms / kTop_ms, 0.0, 1.0)));
  };
  const auto put = [&picture](int x, int up, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    const int y = picture.height - 1 - up;
    if (x >= picture.width || y < 0)
      return;
    std::uint8_t* pixel =
        &picture.bytes[3 * (static_cast<std::size_t>(y) * picture.width + static_cast<std::size_t>(x))];
    pixel[0] = r, pixel[1] = g, pixel[2] = b;
  };
  for (int x = 0; x < static_cast<int>(times_.size()); ++x) {
    const double ms = times_[static_cast<std::size_t>(x)];
    for (int up = 0; up < height_of(ms); ++up)
      ms > kLine_ms ? put(x, up, 230, 120, 40) : put(x, up, 70, 180, 90);
    put(x, height_of(kLine_ms), 255, 255, 255);
  }
}

Result<void> run_viewer(Session& session, const RunConfig& config, const SkyImage& sky, const PhotoPixels& photo,
                        const std::function<Rgb8Image(const RgbImage&)>& encode, int most_frames) {
  auto window = ViewWindow::open(photo.width(), photo.height(), "daylit");
  if (!window)
    return window.error();
  std::vector<ObjectConfig> objects = config.objects;
  std::vector<glm::dvec3> positions;
  for (const ObjectConfig& object : objects)
    positions.push_back(object.position);
  ViewControl control(positions);
  window->on({[&](bool down, const glm::dvec2& pixel) {
                if (down)
                  control.press(pixel, session.camera(), spheres_of(session, objects.size()));
                else
                  control.release();
              },
              [&](const glm::dvec2& pixel) { control.move(pixel, session.camera()); },
              [&](double steps) { control.scroll(steps, session.camera()); }, [&](char key) { control.key(key); }});
  const glm::dmat4 photo_pose = session.camera().world_from_camera;
  Background background(photo, photo_pose);
  FrameGraph graph;
  if (const auto first = session.render({sky, photo, 1, background.number() + 1}); !first) // light for the background
    return first.error();
  for (int k = 0; most_frames == 0 || k < most_frames; ++k) {
    if (interrupted())
      return interrupted_error("frame " + std::to_string(k));
    if (const auto followed = follow(session, control, objects, photo_pose); !followed)
      return followed;
    background.follow(session, session.camera().world_from_camera);
    const auto frame = session.render({sky, background.picture(), 1, background.number()});
    if (!frame)
      return frame.error();
    graph.add((*frame)->report.total_ms);
    Rgb8Image picture = encode((*frame)->composite.picture);
    if (control.shows_frame_times())
      graph.draw(picture);
    const auto open = window->show(picture);
    if (!open)
      return open.error();
    if (!*open)
      break;
  }
  return {};
}

} // namespace daylit
