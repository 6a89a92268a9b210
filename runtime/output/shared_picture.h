#pragma once

// The live picture in POSIX shared memory, for other programs of this machine.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "scene/core/result.h"
#include "scene/image/image_formats.h"

namespace daylit {

/// What /dev/shm/NAME begins with; the pixels follow at byte 64: RGB, 8 bits each, row by row without padding. Little
/// endian. A reader copies the pixels between two looks at `sequence`: they are of one picture when both are the same
/// even number. `width` 0: the memory was left, for another size or at the end; open the name again.
struct SharedPictureHeader {
  char magic[8];                            ///< "DAYLIT1" and a zero
  std::atomic<std::uint32_t> width, height; ///< pixels
  std::atomic<std::uint64_t> sequence;      ///< odd while the picture is being written
  std::atomic<std::uint64_t> index;         ///< of the picture, from 1
  std::atomic<std::int64_t> drawn_ns;       ///< when it was drawn, CLOCK_MONOTONIC
  char reserved[24];
};
static_assert(sizeof(SharedPictureHeader) == 64 && std::atomic<std::uint64_t>::is_always_lock_free);

class SharedPicture {
public:
  /// The name, without a slash. Only its owner may read it, and the owner's group. What a run left there that was
  /// killed is taken over. Errors: value_invalid (no such name can be), io (in use, something else's, or the memory
  /// cannot be had).
  static Result<SharedPicture> create(const std::string& name, int width, int height);
  SharedPicture(SharedPicture&&) noexcept;
  SharedPicture& operator=(SharedPicture&&) noexcept;
  ~SharedPicture(); ///< the name goes with it

  /// A copy of the picture; of another size than the one before: in new memory. Error: as create().
  Result<void> write(const Rgb8Image& picture, std::uint64_t index);

private:
  struct State;
  explicit SharedPicture(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
