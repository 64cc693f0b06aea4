// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/mapping_loop.h"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kLookEvery_us = 10'000;

}  // namespace

MappingLoop::MappingLoop(slam::Estimator* estimator, const TrackingLoop* tracking, double limit_s)
    : estimator_(*estimator), tracking_(*tracking), progress_(limit_s) {
  estimator_.listen(&times_);
}

void MappingLoop::run(const std::function<void()>& on_mapped) {
  for (;;) {
    const std::uint32_t seen = jobs_.seen();
    // Read before looking for a job: none can come after the last look.
    const bool is_last = tracking_.has_ended();
    const bool has_mapped = estimator_.map();
    if (has_mapped) times_.hand_over();
    if (has_mapped && on_mapped) on_mapped();
    progress_.step();
    if (has_mapped) continue;
    if (is_last) break;
    jobs_.wait(seen, kLookEvery_us);
  }
  progress_.end();
}

}  // namespace farpoint::daemon
