// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/side_functions.h"

#include <spdlog/spdlog.h>

#include <stdexcept>
#include <utility>

namespace farpoint::daemon {
namespace {

std::int32_t bit(SideFunction which) {
  return std::int32_t{1} << static_cast<int>(which);
}

}  // namespace

std::string SideFunctions::attempt(const Begin& begin) {
  try {
    begin();
    return {};
  } catch (const std::exception& error) {
    failures_.fetch_add(1, std::memory_order_relaxed);
    const std::string reason = error.what();
    return reason.empty() ? "unknown reason" : reason;
  }
}

void SideFunctions::begin(SideFunction which, const std::string& what, Begin begin) {
  const std::string reason = attempt(begin);
  if (reason.empty()) return;
  spdlog::warn("{}: {}; the run goes on without it and tries again every second", what, reason);
  missing_.fetch_or(bit(which), std::memory_order_relaxed);
  waiting_.push_back({which, what, std::move(begin)});
}

void SideFunctions::start(const RealtimeConfig& config, RealtimeReport* report) {
  if (waiting_.empty()) return;
  thread_ = std::make_unique<Thread>(kThread, config, ThreadConfig{}, report, [this] { run(); });
}

void SideFunctions::stop() {
  stop_.store(true, std::memory_order_release);
  stopping_.notify();
  thread_.reset();
}

void SideFunctions::run() {
  while (!waiting_.empty()) {
    const std::uint32_t seen = stopping_.seen();
    if (stop_.load(std::memory_order_acquire)) return;
    stopping_.wait(seen, kRetryEvery_us);
    if (stop_.load(std::memory_order_acquire)) return;
    retry();
  }
}

void SideFunctions::retry() {
  std::erase_if(waiting_, [this](const Missing& function) {
    if (!attempt(function.begin).empty()) return false;
    missing_.fetch_and(~bit(function.which), std::memory_order_relaxed);
    spdlog::info("{}: works now", function.what);
    return true;
  });
}

}  // namespace farpoint::daemon
