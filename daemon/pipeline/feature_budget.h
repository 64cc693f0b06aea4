// SPDX-License-Identifier: Apache-2.0
// How many features a frame may have: those of the configuration, and fewer while tracking does not keep the
// camera's pace. Fewer features cost less here and in mapping (a keyframe's cost grows with them), and an
// older pose is worse for a controller than a slightly noisier one.
#pragma once

namespace farpoint::daemon {

class FeatureBudget {
 public:
  // least_share: of the configured features, above 0 to 1.
  FeatureBudget(int configured, double least_share);

  // For the next frame.
  [[nodiscard]] int features() const;
  // What became of the frame. late: another image waited when it was taken, or had been dropped.
  void note(bool late);

 private:
  void lower();
  void raise();

  const int configured_;
  const double least_share_;
  double share_ = 1.0;
  int late_ = 0, frames_ = 0;  // of the present window
  int on_time_run_ = 0;
  int patience_;                 // on-time frames before there are more features again
  int frames_since_raise_ = -1;  // below 0: none to judge
};

}  // namespace farpoint::daemon
