// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/stop_signal.h"

namespace farpoint::daemon {
namespace {

volatile std::sig_atomic_t stop_signal = 0;
volatile std::sig_atomic_t reload_asked = 0;

void note(int signal) {
  stop_signal = signal;
}
void note_reload(int) {
  reload_asked = 1;
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

void StopOnSignal::ask() {
  note(SIGTERM);
}

int StopOnSignal::signal() {
  return stop_signal;
}

ReloadOnSignal::ReloadOnSignal() : on_hangup_(std::signal(SIGHUP, note_reload)) {
  reload_asked = 0;
}

ReloadOnSignal::~ReloadOnSignal() {
  std::signal(SIGHUP, on_hangup_);
}

bool ReloadOnSignal::take() {
  if (reload_asked == 0) return false;
  reload_asked = 0;
  return true;
}

}  // namespace farpoint::daemon
