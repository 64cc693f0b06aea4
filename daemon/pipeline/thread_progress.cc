// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/thread_progress.h"

namespace farpoint::daemon {

bool ThreadProgress::is_alive(double now_s, bool has_work) {
  const std::int64_t steps = steps_.load(std::memory_order_relaxed);
  const bool progressed = steps != seen_;
  seen_ = steps;
  if (progressed || !has_work || ended_.load(std::memory_order_relaxed)) alive_s_ = now_s;
  return now_s - alive_s_ <= limit_s_;
}

}  // namespace farpoint::daemon
