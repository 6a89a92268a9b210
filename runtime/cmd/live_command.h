#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "runtime/live/frame_drawer.h"
#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

struct LiveOptions {
  std::filesystem::path config; ///< read again on SIGHUP, which the program watches for
  std::filesystem::path record; ///< folder for recordings of both cameras; empty: none
  int frames = 0;               ///< so many pictures are drawn and written to [output]; 0: until it is told to stop
  Backend backend = Backend::rays;
  bool window = false; ///< the picture on the screen; it ends when the window is closed
  std::string shared;  ///< name of shared memory that holds the newest picture; empty: none
  bool quiet = false;
  bool force = false; ///< pictures of before are written over
};

/// daylit-run CONFIG.toml with cameras: draws until SIGINT, SIGTERM or the last of `frames`. `report` is called after
/// each picture; changes of state are told on stderr. Errors: of the configuration and what it names, before a camera
/// is touched; interrupted before the last of `frames`; io: a recording ended before the run did.
Result<void> run_live(const RunConfig& config, const LiveOptions& options,
                      const std::function<void(const DrawnFrame&)>& report);

} // namespace daylit
