// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/feature_budget.h"

#include <algorithm>
#include <cmath>

namespace farpoint::daemon {
namespace {

// kLate late frames of kWindow are overload. Fewer are a hiccup of the machine, which makes as many frames
// late as the queue holds.
constexpr int kLate = 4, kWindow = 12;
constexpr double kStep = 0.8;
// On-time frames before more is tried: at first about a second. Where that was too much, twice as long, so
// that a machine that is too slow is not overloaded again every second.
constexpr int kPatience = 30, kMostPatience = 1920;

}  // namespace

FeatureBudget::FeatureBudget(int configured, double least_share)
    : configured_(configured), least_share_(least_share), patience_(kPatience) {}

int FeatureBudget::features() const {
  return static_cast<int>(std::lround(share_ * configured_));
}

void FeatureBudget::note(bool late) {
  late_ += late ? 1 : 0;
  on_time_run_ = late ? 0 : on_time_run_ + 1;
  if (frames_since_raise_ >= 0 && ++frames_since_raise_ >= kPatience) {  // it was not too much
    frames_since_raise_ = -1;
    patience_ = kPatience;
  }
  if (late_ >= kLate) return lower();
  if (++frames_ >= kWindow) late_ = frames_ = 0;
  if (share_ < 1.0 && on_time_run_ >= patience_) raise();
}

void FeatureBudget::lower() {
  late_ = frames_ = on_time_run_ = 0;
  share_ = std::max(least_share_, share_ * kStep);
  if (frames_since_raise_ < 0) return;
  frames_since_raise_ = -1;
  patience_ = std::min(2 * patience_, kMostPatience);
}

void FeatureBudget::raise() {
  on_time_run_ = 0;
  share_ = std::min(1.0, share_ / kStep);
  frames_since_raise_ = 0;
}

}  // namespace farpoint::daemon
