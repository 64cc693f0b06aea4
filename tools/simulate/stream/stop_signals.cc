// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/stream/stop_signals.h"

#include <csignal>

namespace farpoint::tools::simulate {
namespace {

constexpr int kStopping[2] = {SIGINT, SIGTERM}, kWriting[2] = {SIGPIPE, SIGXFSZ};
volatile std::sig_atomic_t stop_signal = 0;

}  // namespace

StopSignals::StopSignals() {
  stop_signal = 0;
  for (int i = 0; i < kKinds; ++i) {
    stopping_[i] = std::signal(kStopping[i], [](int signal) { stop_signal = signal; });
    writing_[i] = std::signal(kWriting[i], SIG_IGN);
  }
}

StopSignals::~StopSignals() {
  for (int i = 0; i < kKinds; ++i) {
    std::signal(kStopping[i], stopping_[i]);
    std::signal(kWriting[i], writing_[i]);
  }
}

int StopSignals::received() {
  return stop_signal;
}

}  // namespace farpoint::tools::simulate
