#pragma once

// Fake cameras need an address of this machine each.

#include <cstring>
#include <string>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/socket.h>

namespace daylit::test {

/// Of the loopback device, besides 127.0.0.1 (scripts/test adds one); empty: this machine has no other. Frames do not
/// come through on the address of every network card.
inline std::string second_address() {
  ifaddrs* all = nullptr;
  std::string found;
  if (getifaddrs(&all) != 0)
    return found;
  for (const ifaddrs* a = all; a && found.empty(); a = a->ifa_next)
    if (a->ifa_addr && a->ifa_addr->sa_family == AF_INET && (a->ifa_flags & IFF_UP) != 0) {
      char text[INET_ADDRSTRLEN] = {};
      inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(a->ifa_addr)->sin_addr, text, sizeof(text));
      if (std::strncmp(text, "127.", 4) == 0 && std::strcmp(text, "127.0.0.1") != 0)
        found = text;
    }
  freeifaddrs(all);
  return found;
}

} // namespace daylit::test
