#include "runtime/base/service_notify.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace daylit {
namespace {

/// What systemd listens on; an abstract name, so that no file is left behind.
class ServiceNotify : public testing::Test {
protected:
  void SetUp() override {
    const std::string name = "daylit-notify-" + std::to_string(::getpid());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path + 1, sizeof address.sun_path - 1);
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    ASSERT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), size), 0);
    ::setenv("NOTIFY_SOCKET", ("@" + name).c_str(), 1);
  }
  void TearDown() override {
    ::close(socket_);
    ::unsetenv("NOTIFY_SOCKET");
  }
  std::string heard() const {
    std::array<char, 256> text{};
    const auto n = ::recv(socket_, text.data(), text.size(), 0);
    return n > 0 ? std::string(text.data(), static_cast<std::size_t>(n)) : "";
  }
  int socket_ = -1;
};

TEST_F(ServiceNotify, systemd_hears_each_state_and_one_line_of_status) {
  EXPECT_TRUE(notify_service(ServiceState::ready, "drawing\nnot this"));
  EXPECT_EQ(heard(), "READY=1\nSTATUS=drawing");
  EXPECT_TRUE(notify_service(ServiceState::picture));
  EXPECT_EQ(heard(), "WATCHDOG=1");
  EXPECT_TRUE(notify_service(ServiceState::reloading));
  EXPECT_EQ(heard(), "RELOADING=1");
  EXPECT_TRUE(notify_service(ServiceState::stopping));
  EXPECT_EQ(heard(), "STOPPING=1");
}

/// A listener that does not read must not hold up the picture.
TEST_F(ServiceNotify, a_full_socket_does_not_block) {
  int sent = 0;
  while (sent < 100000 && notify_service(ServiceState::picture))
    ++sent;
  EXPECT_LT(sent, 100000);
}

TEST(ServiceNotifyAlone, without_systemd_nothing_happens) {
  ::unsetenv("NOTIFY_SOCKET");
  EXPECT_FALSE(notify_service(ServiceState::ready));
  ::setenv("NOTIFY_SOCKET", "/nonexistent/socket", 1);
  EXPECT_FALSE(notify_service(ServiceState::ready));
  ::setenv("NOTIFY_SOCKET", std::string(300, 'x').c_str(), 1);
  EXPECT_FALSE(notify_service(ServiceState::ready));
  ::unsetenv("NOTIFY_SOCKET");
}

} // namespace
} // namespace daylit
