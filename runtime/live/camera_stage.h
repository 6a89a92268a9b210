#pragma once

// The thread between a camera and the picture: the camera's newest frame, made ready to be drawn from.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

#include "capture/frames/frame_source.h"
#include "runtime/live/camera_watch.h"
#include "runtime/live/newest.h"

namespace daylit {

/// It begins with the newest frame there is when its last result was taken, or as much later as the next is still in
/// time, and only while results are wanted: nothing is made ready that nobody will see. `Ready`: what a frame becomes;
/// nothing where more frames are needed for it.
template <class Ready>
class CameraStage {
public:
  using MakeReady = std::function<Result<std::optional<Ready>>(const CameraFrame&)>;
  enum class Takes {
    newest, ///< frame, when a result is wanted
    all,    ///< frames as they come, as far as there is time: several of them make one result
  };

  /// `source` and `watch` must outlive it. Frames older than `oldest_s` are left out.
  CameraStage(FrameSource& source, CameraWatch& watch, double oldest_s, MakeReady make_ready,
              Takes takes = Takes::newest)
      : source_(source), watch_(watch), oldest_s_(oldest_s), make_ready_(std::move(make_ready)), takes_(takes),
        thread_([this](const std::stop_token& stop) { work(stop); }) {}

  void want(bool wanted) { wanted_ = wanted; }
  /// As Newest::take(). The one after it is wanted in `next_in`: a frame that is taken up later is a younger one.
  std::optional<Ready> take(std::chrono::milliseconds wait, std::chrono::nanoseconds next_in = {}) {
    auto taken = ready_.take(wait);
    if (taken) {
      begin_ns_ = now_ns() + next_in.count() - work_ns_;
      told_ = true;
    }
    return taken;
  }
  CameraReport report() const { return watch_.report(source_.report()); }

private:
  static std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

  void work(const std::stop_token& stop) {
    using namespace std::chrono_literals;
    while (!stop.stop_requested()) {
      if (!wanted_)
        std::this_thread::sleep_for(5ms);
      else if (takes_ == Takes::all)
        make_next(50ms);
      else if (!ready_.wait_until_taken(50ms))
        continue;
      else if (!told_)
        std::this_thread::sleep_for(100us);
      else if (const std::chrono::nanoseconds early(begin_ns_ - now_ns()); early > 0ns)
        std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(early, 50ms));
      else
        make_next(50ms);
    }
  }

  void make_next(std::chrono::milliseconds wait) {
    const auto next = source_.next(wait);
    if (!next)
      return watch_.refuse(next.error().message());
    if (!*next || age_s(**next) > oldest_s_ || !watch_.accept(**next))
      return;
    const std::int64_t begin = now_ns();
    auto made = make_ready_(**next);
    work_ns_ = now_ns() - begin;
    if (!made)
      return watch_.refuse(made.error().message());
    watch_.used(**next);
    if (!*made)
      return;
    told_ = false;
    ready_.put(std::move(**made));
  }

  FrameSource& source_;
  CameraWatch& watch_;
  const double oldest_s_;
  const MakeReady make_ready_;
  const Takes takes_;
  std::atomic<bool> wanted_ = false;
  std::atomic<std::int64_t> begin_ns_ = 0, work_ns_ = 0; ///< not before that; what the last frame took
  std::atomic<bool> told_ = true;                        ///< begin_ns_ is of the result that was taken last
  Newest<Ready> ready_;
  std::jthread thread_; ///< last: it uses all of the above
};

} // namespace daylit
