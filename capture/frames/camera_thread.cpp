#include "capture/frames/camera_thread.h"

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

namespace daylit {

namespace {

using namespace std::chrono_literals;

constexpr auto kRetry = 500ms;
constexpr auto kLeave = 150ms; ///< that long the thread may take to end; to open a camera that is away takes 2.5 s

class CameraSource final : public FrameSource {
public:
  explicit CameraSource(std::shared_ptr<CameraThread> camera)
      : camera_(std::move(camera)), worker_([kept = camera_] { kept->work(); }) {}
  ~CameraSource() override {
    camera_->leave();
    if (camera_->is_over())
      worker_.join();
    else
      worker_.detach();
  }
  CameraSource(const CameraSource&) = delete;
  CameraSource& operator=(const CameraSource&) = delete;

  Result<std::optional<CameraFrame>> next(std::chrono::milliseconds wait) override { return camera_->next(wait); }
  bool finished() const override { return false; }
  SourceReport report() const override { return camera_->report(); }

private:
  std::shared_ptr<CameraThread> camera_;
  std::thread worker_;
};

} // namespace

std::unique_ptr<FrameSource> source_of(std::shared_ptr<CameraThread> camera) {
  return std::make_unique<CameraSource>(std::move(camera));
}

Result<std::optional<CameraFrame>> CameraThread::next(std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, wait, [&] { return newest_.has_value(); });
  return std::exchange(newest_, std::nullopt);
}

SourceReport CameraThread::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

namespace {
std::atomic<int> g_leaving = 0; ///< threads that were told to end and have not
}

bool is_camera_leaving() { return g_leaving > 0; }

void CameraThread::work() {
  while (!stop_) {
    say_lost(stream_until_lost());
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kRetry, [&] { return stop_.load(); });
  }
  --g_leaving;
  const std::lock_guard lock(mutex_);
  over_ = true;
  changed_.notify_all();
}

void CameraThread::leave() {
  {
    const std::lock_guard lock(each_mutex_);
    each_ = {};
  }
  ++g_leaving;
  std::unique_lock lock(mutex_);
  stop_ = true;
  changed_.notify_all();
  changed_.wait_for(lock, kLeave, [&] { return over_; });
}

bool CameraThread::is_over() const {
  const std::lock_guard lock(mutex_);
  return over_;
}

void CameraThread::say_connected() {
  const std::lock_guard lock(mutex_);
  ++report_.connections;
  report_.connected = true;
  report_.trouble.clear();
}

void CameraThread::say_lost(const std::string& trouble) {
  const std::lock_guard lock(mutex_);
  report_.connected = false;
  report_.trouble = trouble;
}

void CameraThread::take(std::optional<CameraFrame> frame, std::uint64_t missing) {
  if (const std::lock_guard lock(each_mutex_); frame && each_)
    each_(*frame);
  const std::lock_guard lock(mutex_);
  report_.missing += missing;
  if (!frame) {
    ++report_.damaged;
    return;
  }
  ++report_.whole;
  report_.superseded += newest_.has_value();
  newest_ = std::move(frame);
  changed_.notify_all();
}

} // namespace daylit
