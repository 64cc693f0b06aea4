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

  // Call as often as convenient, from one thread; `alive` is asked at half the watchdog's interval at most,
  // and the manager told where it says yes. A service that is not alive is not told of: it is killed and
  // restarted.
  template <typename Alive>
  void watch(double now_s, Alive alive) {
    if (!interval_s_ || now_s < next_s_) return;
    next_s_ = now_s + 0.5 * *interval_s_;
    if (alive()) say_alive();
  }
  [[nodiscard]] std::optional<double> watchdog_s() const { return interval_s_; }

 private:
  void say_alive();

  std::optional<double> interval_s_;
  double next_s_ = 0;
};

}  // namespace farpoint::daemon
