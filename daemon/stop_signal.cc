#include "daemon/stop_signal.h"

#include <spdlog/fmt/fmt.h>

namespace farpoint::daemon {
namespace {

volatile std::sig_atomic_t stop_signal = 0;

void note(int signal) {
  stop_signal = signal;
}

}  // namespace

StopOnSignal::StopOnSignal()
    : on_interrupt_(std::signal(SIGINT, note)), on_terminate_(std::signal(SIGTERM, note)) {
  stop_signal = 0;
}

StopOnSignal::~StopOnSignal() {
  std::signal(SIGINT, on_interrupt_);
  std::signal(SIGTERM, on_terminate_);
}

int StopOnSignal::signal() {
  return stop_signal;
}

void StopOnSignal::check() {
  if (stop_signal != 0)
    throw std::runtime_error(fmt::format("stopped by signal {}, no output written", int{stop_signal}));
}

}  // namespace farpoint::daemon
