#pragma once

// One client's socket as cpp-httplib reads and writes it, with limits on time and size.

#include <array>
#include <atomic>
#include <chrono>

#include <httplib.h>

namespace daylit::detail {

class Connection final : public httplib::Stream {
public:
  /// `stopping` ends it within a tenth of a second.
  Connection(socket_t socket, const std::atomic<bool>& stopping);
  ~Connection() override; ///< closes the socket

  bool is_readable() const override;
  bool is_writable() const override;
  ssize_t read(char* out, std::size_t size) override;
  ssize_t write(const char* data, std::size_t size) override;
  void get_remote_ip_and_port(std::string& ip, int& port) const override;
  void get_local_ip_and_port(std::string& ip, int& port) const override;
  socket_t socket() const override { return socket_; }

private:
  using Clock = std::chrono::steady_clock;
  /// True when the socket is ready for `events` before `until`.
  bool wait(short events, Clock::time_point until) const;

  socket_t socket_;
  const std::atomic<bool>& stopping_;
  Clock::time_point ask_until_; ///< the whole request must be here by then
  std::array<char, 4096> buffer_{};
  std::size_t begin_ = 0, end_ = 0; ///< of what is read and not yet given out
  std::size_t received_ = 0;
};

} // namespace daylit::detail
