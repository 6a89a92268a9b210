#include "runtime/cmd/local_viewers.h"

#include <chrono>
#include <utility>

#include "scene/core/seconds.h"

namespace daylit {

namespace {

constexpr double kEvents_s = 0.05; ///< mouse and keyboard are asked at least so often

Result<void> open_window(std::optional<ViewWindow>& window, int width, int height) {
  auto opened = ViewWindow::open(width, height, "daylit");
  if (!opened)
    return opened.error();
  window.emplace(std::move(*opened));
  return {};
}

} // namespace

LocalViewers::LocalViewers(PictureBoard& board, int width, int height)
    : viewer_(board, PictureBoard::Wants::view), shown_{width, height,
                                                        std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width) *
                                                                                  height)} {}

Result<std::unique_ptr<LocalViewers>> LocalViewers::open(PictureBoard& board, bool window, const std::string& shared,
                                                         int width, int height) {
  std::unique_ptr<LocalViewers> viewers(new LocalViewers(board, width, height));
  if (window)
    if (const auto opened = open_window(viewers->window_, width, height); !opened)
      return opened.error();
  if (!shared.empty()) {
    auto made = SharedPicture::create(shared, width, height);
    if (!made)
      return made.error();
    viewers->shared_.emplace(std::move(*made));
  }
  return viewers;
}

Result<bool> LocalViewers::follow() {
  const auto newer = viewer_.after(index_, std::chrono::milliseconds(0));
  if (!newer)
    return window_ && wall_seconds() - shown_at_s_ > kEvents_s ? show() : Result<bool>(true);
  index_ = newer->index();
  const Rgb8Image& view = newer->view();
  if (shared_)
    if (const auto written = shared_->write(view, index_); !written)
      return written.error();
  if (!window_)
    return true;
  if (view.width != shown_.width || view.height != shown_.height)
    if (const auto opened = open_window(window_, view.width, view.height); !opened)
      return opened.error();
  shown_ = view;
  return show();
}

Result<bool> LocalViewers::show() {
  shown_at_s_ = wall_seconds();
  return window_->show(shown_);
}

} // namespace daylit
