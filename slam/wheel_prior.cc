// SPDX-License-Identifier: Apache-2.0
#include "slam/wheel_prior.h"

namespace farpoint::slam {

PosePrior WheelPrior::predict(std::int64_t utime) const {
  const ConstantVelocity& frames = tracker_.motion();
  PosePrior prior = frames.predict(utime);
  const Motion& newest = frames.newest();
  const LocalView* view = tracker_.view();
  if (view == nullptr || !view->judgement.metric || !wheels_.trusted() ||
      seconds_between(newest.utime, utime) < kLongStep_s)
    return prior;
  if (const std::optional<SE3> moved = wheels_.motion(newest.utime, utime))
    prior.T_world_body = newest.T_world_body * *moved;
  return prior;
}

}  // namespace farpoint::slam
