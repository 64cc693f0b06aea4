// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/service_manager.h"

#include <systemd/sd-daemon.h>

#include <ctime>

namespace farpoint::daemon {
namespace {

std::string monotonic_usec() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::to_string(std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000);
}

}  // namespace

ServiceManager::ServiceManager() {
  std::uint64_t interval_us = 0;
  if (sd_watchdog_enabled(0, &interval_us) > 0) interval_s_ = 1e-6 * static_cast<double>(interval_us);
}

void ServiceManager::ready() {
  sd_notify(0, "READY=1");
}

// The time is what Type=notify-reload of later versions wants; systemd 252 ignores it.
void ServiceManager::reloading() {
  sd_notify(0, ("RELOADING=1\nMONOTONIC_USEC=" + monotonic_usec()).c_str());
}

void ServiceManager::stopping() {
  sd_notify(0, "STOPPING=1");
}

void ServiceManager::status(const std::string& text) {
  sd_notify(0, ("STATUS=" + text).c_str());
}

void ServiceManager::say_alive() {
  sd_notify(0, "WATCHDOG=1");
}

}  // namespace farpoint::daemon
