#include "runtime/http/detail/connection.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace daylit::detail {

namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kAsk = 3s, kSilence = 2s, kStopSlice = 50ms;
constexpr std::size_t kMostRequestBytes = 64 * 1024;

} // namespace

Connection::Connection(socket_t socket, const std::atomic<bool>& stopping)
    : socket_(socket), stopping_(stopping), ask_until_(Clock::now() + kAsk) {}

/// What the client still sends is read away first: closing over it would reset the connection, and the reply with it.
Connection::~Connection() {
  ::shutdown(socket_, SHUT_WR);
  for (int k = 0; k < 16 && ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT) > 0; ++k) {
  }
  ::close(socket_);
}

bool Connection::wait(short events, Clock::time_point until) const {
  while (!stopping_) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    if (left <= 0ms)
      return false;
    pollfd p{socket_, events, 0};
    const int ready = ::poll(&p, 1, static_cast<int>(std::min<std::chrono::milliseconds>(left, kStopSlice).count()));
    if (ready > 0)
      return true;
    if (ready < 0 && errno != EINTR)
      return false;
  }
  return false;
}

bool Connection::is_readable() const { return begin_ < end_ || wait(POLLIN, ask_until_); }
bool Connection::is_writable() const { return wait(POLLOUT, Clock::now() + kSilence); }

ssize_t Connection::read(char* out, std::size_t size) {
  if (begin_ == end_) {
    if (received_ >= kMostRequestBytes || !wait(POLLIN, ask_until_))
      return -1;
    const ssize_t got = ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    if (got <= 0)
      return got;
    begin_ = 0;
    end_ = static_cast<std::size_t>(got);
    received_ += end_;
  }
  const std::size_t count = std::min(size, end_ - begin_);
  std::memcpy(out, buffer_.data() + begin_, count);
  begin_ += count;
  return static_cast<ssize_t>(count);
}

ssize_t Connection::write(const char* data, std::size_t size) {
  while (is_writable()) {
    const ssize_t sent = ::send(socket_, data, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent >= 0)
      return sent;
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)
      return -1;
  }
  return -1;
}

// Nothing here asks where a client is.
void Connection::get_remote_ip_and_port(std::string&, int&) const {}
void Connection::get_local_ip_and_port(std::string&, int&) const {}

} // namespace daylit::detail
