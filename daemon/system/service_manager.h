// What the service manager is told: ready, reloading, stopping, alive. Nothing happens where there is none.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace farpoint::daemon {

class ServiceManager {
 public:
  // Reads how often it wants to hear that the service is alive.
  ServiceManager();

  void ready();
  void reloading();
  void stopping();
  // One line for 'systemctl status'.
  void status(const std::string& text);

  // Call as often as convenient, from one thread; `alive` is asked at most twenty times in the watchdog's
  // interval, and the manager told where it says yes. A service that is not alive is not told of: it is
  // killed and restarted, an interval after it was last said to be alive. Told at half the interval only, as
  // is usual, it would hang for up to half an interval more.
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
