#pragma once

// A place for one value between two threads: the newest wins, nothing queues.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

namespace daylit {

template <class T>
class Newest {
public:
  void put(T value) {
    std::optional<T> next(std::move(value)); // the old one goes when the lock is free again
    {
      const std::lock_guard lock(mutex_);
      value_.swap(next);
    }
    changed_.notify_all();
  }
  /// Waits for a value that long. Nothing: none came.
  std::optional<T> take(std::chrono::milliseconds wait) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, wait, [&] { return value_.has_value(); });
    std::optional<T> taken = std::exchange(value_, std::nullopt);
    lock.unlock();
    changed_.notify_all();
    return taken;
  }
  /// Waits until the last value was taken. False: it still is there.
  bool wait_until_taken(std::chrono::milliseconds wait) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, wait, [&] { return !value_.has_value(); });
  }

private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<T> value_;
};

} // namespace daylit
