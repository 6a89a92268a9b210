#pragma once

// Two cameras in, augmented pictures out, for as long as it is let.
//
//   sky camera      ->  sky stage (radiance)            ->
//   interior camera ->  tracking stage (photo, pose)    ->  the run (draws)  ->  picture board  ->  viewers
//
// A thread each. Between them the newest frame wins and nothing queues; a stage begins when its last result was taken,
// and none works while nobody looks.

#include <filesystem>
#include <functional>
#include <memory>
#include <utility>

#include "runtime/live/frame_drawer.h"
#include "runtime/live/live_status.h"
#include "runtime/live/picture_board.h"
#include "runtime/live/recorder.h"
#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

/// What a run works with; all of it outlives the run, and may serve one run after another.
struct LiveSurroundings {
  PictureBoard& board;
  LiveStatus& status;
  Recorder *sky_recorder = nullptr, *interior_recorder = nullptr; ///< every whole frame of the cameras, if any
  int frames = 0; ///< so many pictures are drawn and written to [output], numbered, from the first sky on; 0: no end
  std::function<void(const DrawnFrame&)> drawn{};          ///< after each picture
  std::function<void(const std::string&)> state_changed{}; ///< in words: see LiveReport::state
  /// Between two frames, twenty times a second at least: the session, and the sky of its last frame (null: none yet).
  std::function<void(Session&, const SkyImage*)> between_frames{};
  std::function<bool()> go_on{}; ///< called ten times a second at least; false: it ends
};

class LiveRun {
public:
  /// Reads and loads all that the configuration names. No camera is touched. Errors: of any file; no [sky] camera.
  static Result<std::unique_ptr<LiveRun>> load(const RunConfig& config, Backend backend, const Progress& progress);
  ~LiveRun();

  /// Opens the cameras and draws until surroundings.go_on() or the number of frames ends it. A camera that is not
  /// there is waited for. Error: a picture could not be drawn or written.
  Result<void> run(const LiveSurroundings& surroundings);
  const std::vector<std::string>& notes() const;
  std::pair<int, int> photo_size() const; ///< width and height of the interior camera's frames, pixels

private:
  struct State;
  explicit LiveRun(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
