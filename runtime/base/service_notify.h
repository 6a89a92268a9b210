#pragma once

// What a service tells systemd (man sd_notify, Type=notify of packaging/daylit-run.service). Without systemd: nothing.

#include <string>

namespace daylit {

enum class ServiceState {
  ready,     ///< everything is loaded; also after reloading
  picture,   ///< pictures are drawn, or frames come that nobody wants to see, or no camera is there: feeds the watchdog
  reloading, ///< SIGHUP has come; `ready` follows
  stopping,
};

/// `status`: what `systemctl status` shows, one line; empty: as before. Any thread, never waits. False: systemd did not
/// start this process, or does not listen.
bool notify_service(ServiceState state, const std::string& status = {});

} // namespace daylit
