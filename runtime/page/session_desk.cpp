#include "runtime/page/session_desk.h"

#include <algorithm>
#include <utility>

namespace daylit {

Result<void> SessionDesk::ask(Work work, std::chrono::milliseconds wait) {
  const auto question = std::make_shared<Question>();
  question->work = std::move(work);
  std::unique_lock lock(mutex_);
  if (waiting_.size() >= kMostWaiting)
    return Error{ErrorCode::device, "too many changes wait for the next frame", "", "try again"};
  waiting_.push_back(question);
  answered_.wait_for(lock, wait, [&] { return question->done; });
  if (!question->done && question->taken) // it is being done: short
    answered_.wait(lock, [&] { return question->done; });
  if (question->done)
    return question->answer;
  waiting_.erase(std::remove(waiting_.begin(), waiting_.end(), question), waiting_.end());
  return Error{ErrorCode::device, "no frame is drawn at the moment", "", "see whether both cameras send frames"};
}

/// The lock is not held while the work is done.
void SessionDesk::serve(const BetweenFrames& between) {
  std::unique_lock lock(mutex_);
  for (std::size_t most = waiting_.size(); most > 0 && !waiting_.empty(); --most) {
    const auto question = waiting_.front();
    waiting_.pop_front();
    question->taken = true;
    lock.unlock();
    Result<void> answer = question->work(between);
    lock.lock();
    question->answer = std::move(answer);
    question->done = true;
  }
  lock.unlock();
  answered_.notify_all();
}

} // namespace daylit
