#include "runtime/base/service_notify.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace daylit {

namespace {

const char* words_of(ServiceState state) {
  switch (state) {
  case ServiceState::ready:
    return "READY=1";
  case ServiceState::picture:
    return "WATCHDOG=1";
  case ServiceState::reloading:
    return "RELOADING=1";
  case ServiceState::stopping:
    break;
  }
  return "STOPPING=1";
}

} // namespace

/// One datagram of lines to the Unix socket that NOTIFY_SOCKET names; '@' stands for the zero byte of an abstract name.
bool notify_service(ServiceState state, const std::string& status) {
  const char* path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  const std::size_t length = path ? std::strlen(path) : 0;
  if (length < 2 || length >= sizeof address.sun_path)
    return false;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path, length);
  if (path[0] == '@')
    address.sun_path[0] = '\0';
  std::string text = words_of(state);
  if (!status.empty())
    text += "\nSTATUS=" + status.substr(0, status.find('\n'));
  const int to = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length);
  const bool sent = to >= 0 && ::sendto(to, text.data(), text.size(), MSG_NOSIGNAL,
                                        reinterpret_cast<const sockaddr*>(&address), size) > 0;
  if (to >= 0)
    ::close(to);
  return sent;
}

} // namespace daylit
