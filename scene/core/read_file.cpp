#include "scene/core/read_file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <mutex>
#include <set>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace daylit {

namespace {

/// Device and number: the same file by any name.
using FileIdentity = std::pair<dev_t, ino_t>;

struct FilesRead {
  std::mutex mutex;
  std::set<FileIdentity> files;
};

FilesRead& files_read() {
  static FilesRead read;
  return read;
}

Error not_a_file(const char* what, const std::filesystem::path& path) {
  return {ErrorCode::file_missing, what, path.string(), "give the path of a file on disk"};
}

} // namespace

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0)
    return Error{ErrorCode::file_missing, std::string("cannot open the file: ") + std::strerror(errno), path.string(),
                 "check the path"};
  InputFile file(descriptor, 0);
  struct stat status = {};
  if (::fstat(descriptor, &status) != 0)
    return not_a_file("cannot be examined", path);
  if (S_ISDIR(status.st_mode))
    return not_a_file("this is a folder, not a file", path);
  if (!S_ISREG(status.st_mode))
    return not_a_file(S_ISFIFO(status.st_mode) ? "this is a pipe, not a file" : "this is a device, not a file", path);
  file.size_ = static_cast<std::size_t>(status.st_size);
  const std::lock_guard lock(files_read().mutex);
  files_read().files.emplace(status.st_dev, status.st_ino);
  return file;
}

InputFile::InputFile(InputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_) {}

InputFile::~InputFile() {
  if (descriptor_ >= 0)
    ::close(descriptor_);
}

std::size_t InputFile::read(std::span<std::uint8_t> bytes) const {
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t n = ::pread(descriptor_, bytes.data() + got, bytes.size() - got, static_cast<off_t>(got));
    if (n < 0 && errno == EINTR)
      continue;
    if (n <= 0)
      break;
    got += static_cast<std::size_t>(n);
  }
  return got;
}

Result<std::vector<std::uint8_t>> read_whole_file(const std::filesystem::path& path, std::size_t max_bytes) {
  const Result<InputFile> file = InputFile::open(path);
  if (!file)
    return file.error();
  if (file->size() > max_bytes)
    return Error{ErrorCode::limit_exceeded,
                 "the file has " + std::to_string(file->size()) + " bytes, at most " + std::to_string(max_bytes) +
                     " are read",
                 path.string(), "check that it is the right file"};
  std::vector<std::uint8_t> bytes(file->size());
  bytes.resize(file->read(bytes));
  return bytes;
}

bool was_read(const std::filesystem::path& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0)
    return false;
  const std::lock_guard lock(files_read().mutex);
  return files_read().files.contains({status.st_dev, status.st_ino});
}

} // namespace daylit
