#include "runtime/live/recorder.h"

namespace daylit {

namespace {
constexpr std::size_t kMostWaiting = 16;
}

Result<std::unique_ptr<Recorder>> Recorder::start(const std::filesystem::path& folder) {
  auto writer = RecordingWriter::create(folder);
  if (!writer)
    return writer.error();
  return std::make_unique<Recorder>(std::move(*writer));
}

Recorder::Recorder(RecordingWriter writer) : writer_(std::move(writer)), worker_([this] { work(); }) {}

Recorder::~Recorder() { finish(); }

RecorderReport Recorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  if (worker_.joinable())
    worker_.join();
  return report();
}

void Recorder::offer(const CameraFrame& frame) {
  CameraFrame copy = frame;
  {
    const std::lock_guard lock(mutex_);
    if (over_ || !report_.trouble.empty() || waiting_.size() >= kMostWaiting) {
      ++report_.dropped;
      return;
    }
    waiting_.push_back(std::move(copy));
  }
  changed_.notify_all();
}

RecorderReport Recorder::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void Recorder::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return over_ || !waiting_.empty(); });
    if (waiting_.empty())
      return;
    const CameraFrame frame = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    const auto written = writer_.add(frame);
    lock.lock();
    if (written) {
      ++report_.recorded;
      continue;
    }
    report_.trouble = written.error().message();
    report_.dropped += 1 + waiting_.size();
    waiting_.clear();
  }
}

} // namespace daylit
