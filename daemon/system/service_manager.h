// SPDX-License-Identifier: Apache-2.0
// Reports to the service manager (systemd): ready, reloading, stopping, alive. Without one all calls do
// nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace farpoint::daemon {

class ServiceManager {
 public:
  // Reads the watchdog's interval.
  ServiceManager();

  void ready();
  void reloading();
  void stopping();
  // One line for 'systemctl status'.
  void status(const std::string& text);

  // Call often, from one thread. Evaluates `alive` at most twenty times in the watchdog's interval and feeds
  // the watchdog if it is true. The manager restarts the service one interval after the last feed. Feeding at
  // half the interval would prolong a hang by up to half an interval.
  template <typename Alive>
  void watch(double now_s, Alive alive) {
    if (!interval_s_ || now_s < next_s_) return;
    next_s_ = now_s + *interval_s_ / kAsksAnInterval;
    if (alive()) say_alive();
  }
  [[nodiscard]] std::optional<double> watchdog_s() const { return interval_s_; }

 private:
  static constexpr double kAsksAnInterval = 20.0;

  void say_alive();

  std::optional<double> interval_s_;
  double next_s_ = 0;
};

}  // namespace farpoint::daemon
