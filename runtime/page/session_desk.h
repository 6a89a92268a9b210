#pragma once

// Where threads that answer requests meet the one that draws.

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

#include "runtime/session/session.h"
#include "scene/core/result.h"
#include "scene/sky/sky_image.h"

namespace daylit {

/// What there is between two frames. The session is that of the last frame; `sky` its sky, null before the first.
struct BetweenFrames {
  Session& session;
  const SkyImage* sky = nullptr;
};

class SessionDesk {
public:
  using Work = std::function<Result<void>(const BetweenFrames&)>;
  static constexpr std::size_t kMostWaiting = 32;

  /// Has `work` done between two frames by the thread that draws, and waits for it. Keep it short. Any thread. Error:
  /// of the work; device: no frame within `wait` (it is then not done), or kMostWaiting wait already.
  Result<void> ask(Work work, std::chrono::milliseconds wait = std::chrono::seconds(2));
  /// Called by the thread that draws, once per frame. Quick when nobody asks.
  void serve(const BetweenFrames& between);

private:
  struct Question {
    Work work;
    bool taken = false, done = false;
    Result<void> answer;
  };
  std::mutex mutex_;
  std::condition_variable answered_;
  std::deque<std::shared_ptr<Question>> waiting_;
};

} // namespace daylit
