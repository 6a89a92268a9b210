#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "runtime/live/picture_board.h"
#include "runtime/output/shared_picture.h"
#include "runtime/window/view_window.h"

namespace daylit {

/// Those of this machine who see every picture: a window, and programs that read shared memory. Viewers like any other,
/// so that pictures are drawn as long as it lives. Main thread only.
class LocalViewers {
public:
  /// For pictures of that size. `shared`: name of the shared memory, empty: none. Errors: device (no display); of
  /// SharedPicture::create().
  static Result<std::unique_ptr<LocalViewers>> open(PictureBoard& board, bool window, const std::string& shared,
                                                    int width, int height);
  /// Gives them the newest picture if there is a newer one, and handles what the user of the window does. False once
  /// the window was closed. Error: of the window or the memory, which are made anew for pictures of another size.
  Result<bool> follow();

private:
  LocalViewers(PictureBoard& board, int width, int height);
  Result<bool> show();

  PictureBoard::Viewer viewer_;
  std::optional<ViewWindow> window_;
  std::optional<SharedPicture> shared_;
  Rgb8Image shown_; ///< in the window: black before the first
  std::uint64_t index_ = 0;
  double shown_at_s_ = 0;
};

} // namespace daylit
