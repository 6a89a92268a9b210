#include "runtime/output/shared_picture.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wtsan" // the fence is for readers in other processes, which ThreadSanitizer cannot see
#endif

namespace daylit {

namespace {

constexpr char kMagic[8] = "DAYLIT1";
constexpr int kMode = 0640;
constexpr std::size_t kLongestName = 200;

std::size_t pixel_bytes(int width, int height) {
  return 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

Error cannot(const std::string& name, const std::string& what) {
  return {ErrorCode::io, what + ": " + std::strerror(errno), "/dev/shm/" + name,
          "choose another name, or free memory there"};
}

/// Nothing is there, or what a run left that was killed: one that goes on holds a lock on it.
bool may_be_taken(const std::string& path) {
  const int file = shm_open(path.c_str(), O_RDONLY | O_CLOEXEC, 0);
  if (file < 0)
    return errno == ENOENT;
  char magic[sizeof kMagic] = {};
  const bool ours = ::read(file, magic, sizeof magic) == sizeof magic &&
                    std::memcmp(magic, kMagic, sizeof magic) == 0 && flock(file, LOCK_EX | LOCK_NB) == 0;
  close(file);
  return ours;
}

} // namespace

struct SharedPicture::State {
  std::string name, path;
  SharedPictureHeader* header = nullptr;
  std::size_t bytes = 0;
  int file = -1;

  Result<void> open(int width, int height) {
    if (!may_be_taken(path))
      return Error{ErrorCode::io, "the shared memory is in use, or another program's", "/dev/shm/" + name,
                   "choose another name"};
    shm_unlink(path.c_str());
    file = shm_open(path.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, kMode);
    if (file < 0)
      return cannot(name, "cannot be made");
    bytes = sizeof(SharedPictureHeader) + pixel_bytes(width, height);
    flock(file, LOCK_EX | LOCK_NB);
    const int failed =
        posix_fallocate(file, 0, static_cast<off_t>(bytes)); // a file that is full later ends the program
    void* memory = failed ? MAP_FAILED : mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED) {
      errno = failed ? failed : errno;
      const Error error = cannot(name, "is not to be had");
      shm_unlink(path.c_str());
      close(file);
      return error;
    }
    header = new (memory) SharedPictureHeader{};
    header->width = static_cast<std::uint32_t>(width);
    header->height = static_cast<std::uint32_t>(height);
    std::memcpy(header->magic, kMagic, sizeof kMagic);
    return {};
  }
  void leave() {
    if (!header)
      return;
    shm_unlink(path.c_str());
    ++header->sequence;
    header->width = 0;
    munmap(header, bytes);
    close(file);
    header = nullptr;
  }
  ~State() { leave(); }
};

SharedPicture::SharedPicture(std::unique_ptr<State> state) : state_(std::move(state)) {}
SharedPicture::SharedPicture(SharedPicture&&) noexcept = default;
SharedPicture& SharedPicture::operator=(SharedPicture&&) noexcept = default;
SharedPicture::~SharedPicture() = default;

Result<SharedPicture> SharedPicture::create(const std::string& name, int width, int height) {
  if (name.empty() || name.size() > kLongestName || name.find('/') != std::string::npos || name.starts_with('.'))
    return Error{ErrorCode::value_invalid, "is no name of shared memory", "'" + name + "'",
                 "a word without slashes: it becomes /dev/shm/NAME"};
  auto state = std::make_unique<State>();
  state->name = name;
  state->path = "/" + name;
  if (const auto opened = state->open(width, height); !opened)
    return opened.error();
  return SharedPicture(std::move(state));
}

Result<void> SharedPicture::write(const Rgb8Image& picture, std::uint64_t index) {
  State& s = *state_;
  if (!s.header || s.header->width != static_cast<std::uint32_t>(picture.width) ||
      s.header->height != static_cast<std::uint32_t>(picture.height)) {
    s.leave();
    if (const auto opened = s.open(picture.width, picture.height); !opened)
      return opened;
  }
  ++s.header->sequence;
  std::atomic_thread_fence(std::memory_order_release);
  std::memcpy(static_cast<void*>(s.header + 1), picture.bytes.data(), pixel_bytes(picture.width, picture.height));
  s.header->index = index;
  s.header->drawn_ns = std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  ++s.header->sequence;
  return {};
}

} // namespace daylit
