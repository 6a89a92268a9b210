#include "runtime/doctor/machine.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <fstream>
#include <memory>

namespace daylit {

namespace {

std::int64_t number_in(const std::filesystem::path& file) {
  std::int64_t value = 0;
  std::ifstream(file) >> value;
  return value;
}

std::uint32_t ipv4(const sockaddr* address) {
  return ntohl(reinterpret_cast<const sockaddr_in*>(address)->sin_addr.s_addr);
}

} // namespace

Machine read_machine() {
  Machine machine;
  machine.most_socket_bytes = number_in("/proc/sys/net/core/rmem_max");
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0)
    return machine;
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owned(list, freeifaddrs);
  for (const ifaddrs* i = list; i; i = i->ifa_next)
    if (i->ifa_addr && i->ifa_netmask && i->ifa_addr->sa_family == AF_INET && (i->ifa_flags & IFF_UP))
      machine.interfaces.push_back(
          {i->ifa_name, ipv4(i->ifa_addr), ipv4(i->ifa_netmask),
           static_cast<int>(number_in(std::filesystem::path("/sys/class/net") / i->ifa_name / "mtu")),
           (i->ifa_flags & IFF_LOOPBACK) != 0});
  return machine;
}

const NetworkInterface* network_of(const Machine& machine, const std::string& address) {
  in_addr parsed{};
  if (inet_pton(AF_INET, address.c_str(), &parsed) != 1)
    return nullptr;
  const std::uint32_t ip = ntohl(parsed.s_addr);
  const NetworkInterface* best = nullptr;
  for (const NetworkInterface& i : machine.interfaces)
    if ((ip & i.mask) == (i.address & i.mask) && (!best || i.mask > best->mask))
      best = &i;
  return best;
}

std::optional<Disk> disk_of(const std::filesystem::path& folder) {
  struct statvfs space {};
  if (statvfs(folder.c_str(), &space) != 0)
    return std::nullopt;
  return Disk{access(folder.c_str(), W_OK) == 0, std::uint64_t{space.f_bavail} * space.f_frsize};
}

} // namespace daylit
