#pragma once

// What this computer gives the daemon: networks, buffers of sockets, disks, graphics.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace daylit {

/// An IPv4 network of this machine.
struct NetworkInterface {
  std::string name;                    ///< "eth0"
  std::uint32_t address = 0, mask = 0; ///< host byte order
  int mtu_bytes = 0;                   ///< largest packet
  bool is_loopback = false;
};

struct Machine {
  std::vector<NetworkInterface> interfaces;
  std::int64_t most_socket_bytes = 0; ///< net.core.rmem_max: the largest receive buffer that a program may ask for
};

/// As Linux reports it. Quick; asks nothing of the network.
Machine read_machine();

/// The network in which an IPv4 address lies; the narrowest. Null: in none, or `address` is no such address.
const NetworkInterface* network_of(const Machine& machine, const std::string& address);

/// Space for files.
struct Disk {
  bool writable = false;
  std::uint64_t free_bytes = 0;
};
/// Empty: there is no such folder.
std::optional<Disk> disk_of(const std::filesystem::path& folder);

} // namespace daylit
