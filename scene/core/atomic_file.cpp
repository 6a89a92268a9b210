#include "scene/core/atomic_file.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <mutex>
#include <set>
#include <sys/stat.h>
#include <unistd.h>

#include "scene/core/unfinished_files.h"

namespace daylit {

namespace {

Error io_error(const std::filesystem::path& path, const char* what) {
  return {ErrorCode::io, std::string(what) + ": " + std::strerror(errno), path.string(),
          "check that the folder exists, is writable and has room"};
}

bool write_all(int fd, const std::byte* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = ::write(fd, data, size);
    if (n < 0 && errno == EINTR)
      continue;
    if (n <= 0)
      return false;
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

/// Who may read a file that is there stays as it is; a new one may be read by all.
mode_t mode_for(const std::filesystem::path& path) {
  struct stat known {};
  return ::stat(path.c_str(), &known) == 0 ? known.st_mode & 0777 : 0644;
}

/// The file that a link leads to is replaced, not the link.
std::filesystem::path behind_links(const std::filesystem::path& path) {
  std::error_code failed;
  const std::filesystem::path file =
      std::filesystem::is_symlink(path, failed) ? std::filesystem::canonical(path, failed) : path;
  return failed || file.empty() ? path : file;
}

/// Never destroyed: a process may end while files are written.
struct Unfinished {
  std::mutex mutex;
  std::set<std::string> paths;
};
Unfinished& unfinished() {
  static auto* const files = new Unfinished;
  return *files;
}

} // namespace

namespace detail {

UnfinishedFile::UnfinishedFile(const std::string& path) : path_(path) {
  const std::lock_guard lock(unfinished().mutex);
  unfinished().paths.insert(path_);
}

UnfinishedFile::~UnfinishedFile() {
  const std::lock_guard lock(unfinished().mutex);
  unfinished().paths.erase(path_);
}

void remove_unfinished_files() {
  unfinished().mutex.lock(); // and never unlocked: whoever comes next waits for the end
  for (const std::string& path : unfinished().paths)
    ::unlink(path.c_str());
}

} // namespace detail

Result<void> write_file_atomically(const std::filesystem::path& to, std::span<const std::span<const std::byte>> parts) {
  const std::filesystem::path path = behind_links(to);
  std::string temporary = path.string() + ".tmp-XXXXXX";
  const int fd = ::mkstemp(temporary.data());
  if (fd < 0)
    return io_error(path, "cannot create a file here");
  const detail::UnfinishedFile registered(temporary);
  bool good = true;
  for (const auto& part : parts)
    good = good && write_all(fd, part.data(), part.size());
  good = good && ::fchmod(fd, mode_for(path)) == 0 && ::fsync(fd) == 0;
  const int saved = errno;
  good = (::close(fd) == 0) && good;
  if (!good) {
    ::unlink(temporary.c_str());
    errno = saved;
    return io_error(path, "writing failed");
  }
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    const Error error = io_error(path, "cannot move the finished file into place");
    ::unlink(temporary.c_str());
    return error;
  }
  return {};
}

Result<void> write_file_atomically(const std::filesystem::path& path, const std::string& text) {
  const std::span<const std::byte> part = std::as_bytes(std::span(text));
  return write_file_atomically(path, std::span(&part, 1));
}

} // namespace daylit
