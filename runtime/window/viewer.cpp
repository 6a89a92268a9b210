#include "runtime/window/viewer.h"

#include <algorithm>
#include <cmath>

#include "runtime/window/view_control.h"
#include "runtime/window/view_window.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr double kStep_m = 1e-4; // what is dragged stops at whole steps: a file with such places reads well

glm::dvec3 rounded(const glm::dvec3& p) {
  return {kStep_m * std::round(p.x / kStep_m), kStep_m * std::round(p.y / kStep_m), p.z};
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
  bool is_photo() const { return seen_from_ == pose_; }
  std::uint64_t number() const { return number_; }

private:
  PhotoPixels photo_;
  RgbImage model_;
  glm::dmat4 pose_, seen_from_{0.0};
  std::uint64_t number_ = 0;
};

/// What stands on a surface follows the mouse over it; beside it, it stays where it stood last.
Result<void> follow_objects(Session& session, ViewControl& control) {
  for (std::size_t k = 0; k < session.placements().size(); ++k) {
    ObjectConfig object = session.placements()[k];
    const glm::dvec3 wanted = rounded(control.position(k));
    const bool moved = object.on ? glm::dvec2(wanted) != glm::dvec2(object.position) : wanted != object.position;
    if (control.held() == k && moved) {
      object.position = wanted;
      if (const auto placed = session.set_placement(k, object); !placed && !object.on)
        return placed;
    }
    control.place(k, session.placements()[k].position);
  }
  return {};
}

Result<void> follow(Session& session, ViewControl& control, const glm::dmat4& photo_pose) {
  session.show(control.parts());
  if (const auto followed = follow_objects(session, control); !followed)
    return followed;
  return session.set_pose(control.orbit() ? control.orbit()->pose() : photo_pose);
}

void listen(ViewWindow& window, ViewControl& control, Session& session) {
  const auto button = [&](bool down, const glm::dvec2& pixel) {
    const RenderCamera& camera = session.camera();
    if (down)
      control.press(pixel, camera, session.object_at(camera.eye(), ViewControl::direction(pixel, camera)),
                    session.object_bounds(0).centre);
    else
      control.release();
  };
  window.on({button, [&](const glm::dvec2& pixel) { control.move(pixel, session.camera()); },
             [&](double steps) { control.scroll(steps, session.camera()); }, [&](char key) { control.key(key); }});
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

Result<void> run_viewer(Session& session, const SkyImage& sky, const ViewedPicture& viewed,
                        const std::function<Rgb8Image(const RgbImage&)>& encode, const std::function<void()>& save,
                        int most_frames) {
  const PhotoPixels& photo = viewed.photo;
  auto window = ViewWindow::open(photo.width(), photo.height(), "daylit");
  if (!window)
    return window.error();
  std::vector<glm::dvec3> positions;
  for (const ObjectConfig& object : session.placements())
    positions.push_back(object.position);
  ViewControl control(std::move(positions));
  listen(*window, control, session);
  const glm::dmat4 photo_pose = session.camera().world_from_camera;
  Background background(photo, photo_pose);
  FrameGraph graph;
  if (const auto first = session.render({sky, photo, 1, background.number() + 1}); !first) // light for the background
    return first.error();
  for (int k = 0; most_frames == 0 || k < most_frames; ++k) {
    if (interrupted())
      return interrupted_error("frame " + std::to_string(k));
    if (const auto followed = follow(session, control, photo_pose); !followed)
      return followed;
    background.follow(session, session.camera().world_from_camera);
    const auto frame = session.render(
        {sky, background.picture(), 1, background.number(), background.is_photo() ? viewed.depth : nullptr});
    if (!frame)
      return frame.error();
    graph.add((*frame)->report.total_ms);
    Rgb8Image picture = encode((*frame)->composite.picture);
    if (control.shows_frame_times())
      graph.draw(picture);
    const auto open = window->show(picture);
    if (!open)
      return open.error();
    if (control.take_save())
      save();
    if (!*open)
      break;
  }
  return {};
}

} // namespace daylit
