// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/constant_velocity.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

constexpr double kArcStep_s = 0.1;

// The motion that led from one to the other; without a velocity where more than longest_s lies between.
Motion moved(const Motion& from, const SE3& T_world_body, std::int64_t utime, double longest_s) {
  const double dt_s = seconds_between(from.utime, utime);
  Motion to{.T_world_body = T_world_body, .utime = utime};
  if (dt_s > 0.0 && dt_s < longest_s) {
    to.velocity = from.T_world_body.boxminus_to(T_world_body) / dt_s;
    to.has_velocity = true;
  }
  return to;
}

const ViewKeyframe* find_keyframe(const LocalView& view, std::uint64_t id) {
  const auto k = std::find_if(view.keyframes.begin(), view.keyframes.end(),
                              [&](const ViewKeyframe& keyframe) { return keyframe.id == id; });
  return k != view.keyframes.end() ? &*k : nullptr;
}

}  // namespace

double seconds_between(std::int64_t from_utime, std::int64_t to_utime) {
  return static_cast<double>(to_utime - from_utime) * 1e-6;
}

SE3 Motion::extrapolated(double dt_s) const {
  SE3 T = T_world_body;
  const int steps = static_cast<int>(std::ceil(dt_s / kArcStep_s));
  for (int i = 0; i < steps; ++i) T = T.boxplus(velocity * (dt_s / steps));
  return T;
}

void ConstantVelocity::start(const SE3& T_world_body, std::int64_t utime) {
  newest_ = {.T_world_body = T_world_body, .utime = utime};
  confirmed_ = newest_;
}

double ConstantVelocity::correct(const LocalView& before, const LocalView& after) {
  if (before.map_id != after.map_id) return 1.0;
  const auto common =
      std::find_if(before.keyframes.rbegin(), before.keyframes.rend(),
                   [&](const ViewKeyframe& k) { return find_keyframe(after, k.id) != nullptr; });
  if (common == before.keyframes.rend()) return 1.0;
  const ViewKeyframe &was = *common, &is = *find_keyframe(after, common->id);
  const double scale = is.scale / was.scale;
  for (Motion* m : {&newest_, &confirmed_}) {
    SE3 T_keyframe_body = was.T_world_body.inverse() * m->T_world_body;
    T_keyframe_body.t *= scale;
    m->T_world_body = is.T_world_body * T_keyframe_body;
    m->velocity.head<3>() *= scale;
  }
  return scale;
}

void ConstantVelocity::accept(const SE3& T_world_body, std::int64_t utime) {
  newest_ = moved(newest_, T_world_body, utime, kLongestStep_s);
  confirmed_ = newest_;
}

void ConstantVelocity::accept_on_trial(const SE3& T_world_body, std::int64_t utime) {
  newest_ = moved(confirmed_, T_world_body, utime, kLongestGap_s);
}

void ConstantVelocity::carry(const SE3& T_from_to, std::int64_t utime) {
  confirmed_ = moved(confirmed_, confirmed_.T_world_body * T_from_to, utime, kLongestGap_s);
  newest_ = confirmed_;
}

PosePrior ConstantVelocity::predict(std::int64_t utime) const {
  PosePrior prior;
  prior.T_world_body = newest_.T_world_body;
  const double dt_s = seconds_between(newest_.utime, utime);
  if (newest_.has_velocity && dt_s > 0.0 && dt_s <= kLongestStep_s)
    prior.T_world_body = newest_.T_world_body.boxplus(newest_.velocity * dt_s);
  return prior;
}

}  // namespace farpoint::slam
