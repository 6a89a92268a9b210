#include "runtime/live/picture_board.h"

#include <utility>

namespace daylit {

const std::string& LivePicture::jpeg() const {
  std::call_once(encoded_, [&] {
    if (const auto bytes = encoded_jpeg(view_))
      jpeg_.assign(bytes->begin(), bytes->end());
  });
  return jpeg_;
}

void PictureBoard::publish(Rgb8Image view, RgbImage linear) {
  auto picture = std::make_shared<const LivePicture>(last_index_ + 1, std::move(view), std::move(linear));
  {
    const std::lock_guard lock(mutex_);
    newest_.swap(picture);
    ++last_index_;
  }
  changed_.notify_all();
}

std::shared_ptr<const LivePicture> PictureBoard::after(std::uint64_t index, std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  const auto is_newer = [&] { return newest_ && newest_->index() > index; };
  return changed_.wait_for(lock, wait, is_newer) ? newest_ : nullptr;
}

} // namespace daylit
