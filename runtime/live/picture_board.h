#pragma once

// The newest picture, for everybody who wants to see it.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Shared by all who look at it.
class LivePicture {
public:
  LivePicture(std::uint64_t index, Rgb8Image view, RgbImage linear)
      : index_(index), view_(std::move(view)), linear_(std::move(linear)) {}
  std::uint64_t index() const { return index_; }     ///< grows from picture to picture, from 1
  const Rgb8Image& view() const { return view_; }    ///< in the photograph's code values
  const RgbImage& linear() const { return linear_; } ///< empty unless somebody had asked for it
  /// Encoded when the first one asks, for all of them.
  const std::string& jpeg() const;

private:
  std::uint64_t index_;
  Rgb8Image view_;
  RgbImage linear_;
  mutable std::once_flag encoded_;
  mutable std::string jpeg_;
};

/// One writer, many viewers. Nobody waits for a viewer.
class PictureBoard {
public:
  enum class Wants { view, linear };
  /// As long as it lives, pictures are drawn.
  class Viewer {
  public:
    Viewer(PictureBoard& board, Wants wants) : board_(board), wants_(wants) { board_.add(wants_, 1); }
    ~Viewer() { board_.add(wants_, -1); }
    Viewer(const Viewer&) = delete;
    Viewer& operator=(const Viewer&) = delete;
    /// The newest picture after picture `index`; waits for it that long. Null: there is none.
    std::shared_ptr<const LivePicture> after(std::uint64_t index, std::chrono::milliseconds wait) {
      return board_.after(index, wait);
    }

  private:
    PictureBoard& board_;
    Wants wants_;
  };

  int viewers() const { return views_ + linears_; }
  bool wants_linear() const { return linears_ > 0; }
  /// Of the picture that was published last; 0: none yet.
  std::uint64_t last_index() const { return last_index_; }
  /// Gives the picture the next index.
  void publish(Rgb8Image view, RgbImage linear);

private:
  void add(Wants wants, int count) { (wants == Wants::view ? views_ : linears_) += count; }
  std::shared_ptr<const LivePicture> after(std::uint64_t index, std::chrono::milliseconds wait);

  std::mutex mutex_; ///< of newest_; held to copy a pointer
  std::condition_variable changed_;
  std::shared_ptr<const LivePicture> newest_;
  std::atomic<std::uint64_t> last_index_ = 0;
  std::atomic<int> views_ = 0, linears_ = 0;
};

} // namespace daylit
