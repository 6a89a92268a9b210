#pragma once

// The one way in for files: only what lies on a disk and has a size. Pipes and devices have no end that could be
// checked before memory is taken for it, and opening a pipe may wait for ever.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

/// A regular file, open for reading.
class InputFile {
public:
  /// Does not wait. Error file_missing: missing, not readable, a folder, a pipe or a device.
  static Result<InputFile> open(const std::filesystem::path& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;
  ~InputFile();

  std::size_t size() const { return size_; } ///< bytes, when it was opened
  /// Fills `bytes` from the start of the file; how many there were. Fewer: the end, or the disk failed.
  std::size_t read(std::span<std::uint8_t> bytes) const;

private:
  InputFile(int descriptor, std::size_t size) : descriptor_(descriptor), size_(size) {}
  int descriptor_ = -1;
  std::size_t size_ = 0;
};

/// Whole file into memory. Error: as InputFile::open(), or larger than `max_bytes`, which is found out first.
Result<std::vector<std::uint8_t>> read_whole_file(const std::filesystem::path& path,
                                                  std::size_t max_bytes = std::size_t{1} << 32);

/// Whether this process has opened the file, by whatever name, as an InputFile.
bool was_read(const std::filesystem::path& path);

/// Bytes of a file that another file names (buffers, textures, material libraries), by the name written there.
using ReadFile = std::function<Result<std::vector<std::uint8_t>>(const std::string& file_name)>;

} // namespace daylit
