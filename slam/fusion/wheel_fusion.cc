// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_fusion.h"

#include <algorithm>
#include <cmath>

#include "slam/fusion/wheel_motion_model.h"

namespace farpoint::slam {

namespace {

// A yaw rate known no better than this tells no turn.
constexpr double kUsefulYawRate_rad_per_s = 0.1;
// Error of a turn by steering geometry and track width, as a share of it.
constexpr double kTurnShare = 0.1;
// The body's axes are mounted along the rolling direction to within three degrees: the motion across is known
// no better.
constexpr double kAcrossShare = 0.05;
// Error of the images' motion between two keyframes: share of its length (0.3 to 1 % on recorded roads), and
// turn.
constexpr double kImageShare = 0.01, kImageTurn_rad = 0.002;
// An interval whose length is known no better than this tells no scale.
constexpr double kUsefulShare = 0.2;
// Links behind the newest keyframe that still wait for samples.
constexpr int kWaitingLinks = 16;
// Intervals that must agree, and their share of all.
constexpr int kFewestIntervals = 4, kFewestToContradict = 8;
constexpr double kAgreedShare = 0.5;
// A factor beyond this many sigmas is not the configured wheel.
constexpr double kContradiction_sigmas = 4.0;
// Turn that must be seen before another gain than this is a contradiction: a bend, and half or twice of it.
constexpr double kTurned_rad = 0.3, kLeastGain = 0.5, kMostGain = 2.0;
// Least turn of an interval that tells the gain.
constexpr double kSeenTurn_rad = 0.01;
// Change of a metric map's unit that bundle adjustment would bend the map for.
constexpr double kWrongUnit = 0.1;

double squared(double x) {
  return x * x;
}

}  // namespace

WheelFusion::WheelFusion(const WheelConfig& config, const Eigen::Vector3d& point_m)
    : config_(config), point_m_(point_m), track_(track_options(config)) {}

void WheelFusion::add(std::span<const WheelSample> samples) {
  for (const WheelSample& s : samples)
    if (const std::optional<WheelSample> usable = usable_sample(s, config_)) (void)track_.add(*usable);
}

// The readings' errors within one interval are one error: speed of a worn tyre, a yaw rate's bias.
std::optional<WheelMotion> WheelFusion::motion_of(const ChainLink& link) const {
  std::optional<WheelMotion> motion = track_.between(link.from_utime, link.to_utime);
  if (!motion) return motion;
  motion->displacement_m *= config_.factor;
  motion->covariance.topLeftCorner<2, 2>() *= squared(config_.factor);
  const double dt_s = motion->duration_s(), way_m = motion->displacement_m.norm();
  Eigen::Matrix3d& C = motion->covariance;
  C(0, 0) += squared(config_.speed_sigma_mps * dt_s) + squared(config_.slip_sigma * way_m);
  C(1, 1) += squared(config_.speed_sigma_mps * dt_s) + squared(kAcrossShare * way_m);
  C(2, 2) += squared(config_.yaw_rate_sigma_radps * dt_s) + squared(kTurnShare * motion->yaw_rad);
  return motion;
}

void WheelFusion::fill_links(Map* map, KeyframeHandle newest) {
  KeyframeHandle at = newest;
  for (int i = 0; i < kWaitingLinks && !at.is_null(); ++i, at = map->chain().before(at)) {
    ChainLink* link = map->link_to(at);
    if (link != nullptr && !link->wheels && link->removed_keyframes == 0) link->wheels = motion_of(*link);
  }
}

// -------------------------------------------------------------------------------------------------------------
// Factors

void WheelFusion::add_to(const Map& map, std::span<const int> pose_index, const MapJudgement& judgement,
                         BundleProblem* problem) {
  factors_.clear();
  if (!judgement.metric || judgement.wheels != WheelTrust::kTrusted) return;
  const double factor = judgement.metre() == MetreSource::kCameras ? judgement.wheel_factor : 1.0;
  map.keyframes().for_each([&](KeyframeHandle to, const Keyframe&) {
    const ChainLink* link = map.chain().link_to(to);
    if (link == nullptr || !link->wheels || link->wheels_slipped) return;
    const int b = pose_index[to.index], a = pose_index[map.chain().before(to).index];
    if (a < 0 || b < 0) return;
    const auto fixed = [&](int pose) { return problem->poses[static_cast<std::size_t>(pose)].fixed; };
    if (fixed(a) && fixed(b)) return;
    WheelMotion motion = *link->wheels;
    motion.displacement_m *= factor;
    factors_.emplace_back(WheelFactorStates{a, b}, motion, point_m_);
  });
  for (const WheelFactor& f : factors_) problem->factors.push_back(&f);
}

// -------------------------------------------------------------------------------------------------------------
// Wheels against images

MotionVerdict WheelFusion::judge(Map* map, KeyframeHandle newest, const MapJudgement& judgement) {
  fill_links(map, newest);
  compare(map, newest);
  MotionVerdict verdict{judgement.wheels, judgement.wheel_factor, judgement.unit_sigma, {}};
  if (turns_otherwise()) {
    verdict.trust = WheelTrust::kContradicted;
    return verdict;
  }
  const std::optional<Consensus> all = consensus();
  if (!all) return verdict;
  mark_slips(*all);
  if (judgement.metre() == MetreSource::kCameras)
    judge_factor(*all, &verdict);
  else
    judge_unit(*all, judgement, &verdict);
  return verdict;
}

void WheelFusion::compare(Map* map, KeyframeHandle newest) {
  comparisons_.clear();
  turning_ = {};
  double driven_s = 0.0;
  for (KeyframeHandle to = newest; driven_s < kCompared_s; to = map->chain().before(to)) {
    ChainLink* link = map->link_to(to);
    if (link == nullptr) return;
    if (!link->wheels) continue;
    const std::size_t before = comparisons_.size();
    add_comparison(map->keyframes()[map->chain().before(to)].T_world_body, map->keyframes()[to].T_world_body,
                   link);
    if (comparisons_.size() > before) driven_s += link->duration_s();
  }
}

void WheelFusion::add_comparison(const SE3& T_world_a, const SE3& T_world_b, ChainLink* link) {
  const WheelMotion& wheels = *link->wheels;
  const double way_m = wheels.displacement_m.norm();
  const Eigen::Vector2d along = wheels.displacement_m / std::max(way_m, 1e-9);
  const double sigma_m = std::sqrt(along.dot(wheels.covariance.topLeftCorner<2, 2>() * along));
  const SE3 T_a_b = T_world_a.inverse() * T_world_b;
  const double turn_rad = so3_log(T_a_b.q).z();
  note_turn(wheels, turn_rad);
  // The point's way is the body's, times the unknown scale, and what the turn moves it by.
  const double turned_m = along.dot((T_a_b.q * point_m_ - point_m_).head<2>());
  const double images = along.dot(T_a_b.t.head<2>());
  if (sigma_m > kUsefulShare * way_m || images <= 0.0 || way_m - turned_m <= 0.0) return;
  Comparison c;
  c.link = link;
  c.log_ratio = std::log((way_m - turned_m) / images);
  c.sigma = std::hypot(sigma_m / way_m, kImageShare);
  const double sigma_rad = std::hypot(std::sqrt(wheels.covariance(2, 2)), kImageTurn_rad);
  c.yaw_agrees = std::fabs(wheels.yaw_rad - turn_rad) <= config_.gate_sigmas * sigma_rad;
  comparisons_.push_back(c);
}

void WheelFusion::note_turn(const WheelMotion& wheels, double turn_rad) {
  const bool unknown = wheels.covariance(2, 2) > squared(kUsefulYawRate_rad_per_s * wheels.duration_s());
  if (unknown || std::fabs(turn_rad) < kSeenTurn_rad) return;
  turning_.images += turn_rad * turn_rad;
  turning_.both += turn_rad * wheels.yaw_rad;
  turning_.turned_rad += std::fabs(turn_rad);
}

bool WheelFusion::turns_otherwise() const {
  if (turning_.turned_rad < kTurned_rad) return false;
  const double gain = turning_.both / turning_.images;
  return gain < kLeastGain || gain > kMostGain;
}

bool WheelFusion::agrees(const Comparison& c, double log_ratio, double sigma) const {
  if (config_.gate_sigmas <= 0.0) return true;
  return c.yaw_agrees &&
         std::fabs(c.log_ratio - log_ratio) <= config_.gate_sigmas * std::hypot(c.sigma, sigma);
}

double WheelFusion::median() {
  sorted_.clear();
  double sum = 0.0;
  for (const Comparison& c : comparisons_) {
    sorted_.emplace_back(c.log_ratio, 1.0 / squared(c.sigma));
    sum += sorted_.back().second;
  }
  std::sort(sorted_.begin(), sorted_.end());
  double below = 0.0;
  for (const auto& [log_ratio, weight] : sorted_)
    if ((below += weight) >= 0.5 * sum) return log_ratio;
  return sorted_.back().first;
}

// The mean of those that agree with the median. Its sigma grows with their spread.
std::optional<WheelFusion::Consensus> WheelFusion::consensus() {
  if (comparisons_.size() < static_cast<std::size_t>(kFewestIntervals)) return std::nullopt;
  const double middle = median();
  Consensus out;
  double weights = 0.0, sum = 0.0, squares = 0.0;
  for (const Comparison& c : comparisons_) {
    if (!agrees(c, middle, 0.0)) continue;
    const double w = 1.0 / squared(c.sigma);
    weights += w;
    sum += w * c.log_ratio;
    squares += w * squared(c.log_ratio - middle);
    ++out.intervals;
  }
  if (out.intervals < kFewestIntervals) return std::nullopt;
  out.log_ratio = sum / weights;
  const double spread = std::max(1.0, squares / (out.intervals - 1));
  out.sigma = std::sqrt(spread / weights);
  out.share = out.intervals / static_cast<double>(comparisons_.size());
  return out;
}

void WheelFusion::mark_slips(const Consensus& consensus) {
  for (const Comparison& c : comparisons_)
    c.link->wheels_slipped = !agrees(c, consensus.log_ratio, consensus.sigma);
}

// The cameras give the metre: the wheels' factor is estimated, or they are left out.
void WheelFusion::judge_factor(const Consensus& consensus, MotionVerdict* verdict) const {
  const double prior = squared(config_.scale_sigma), seen = squared(consensus.sigma);
  if (static_cast<int>(comparisons_.size()) < kFewestToContradict) return;
  if (consensus.share < kAgreedShare ||
      std::fabs(consensus.log_ratio) > kContradiction_sigmas * std::sqrt(prior + seen)) {
    verdict->trust = WheelTrust::kContradicted;
    return;
  }
  verdict->trust = WheelTrust::kTrusted;
  verdict->wheel_factor = std::exp(-consensus.log_ratio * prior / (prior + seen));
}

void WheelFusion::judge_unit(const Consensus& consensus, const MapJudgement& judgement,
                             MotionVerdict* verdict) const {
  const double sigma = std::hypot(consensus.sigma, config_.scale_sigma);
  if (consensus.share < kAgreedShare || sigma > kMetricSigma) return;
  verdict->trust = WheelTrust::kTrusted;
  verdict->unit_sigma = sigma;
  const bool wrong = judgement.metric && consensus.intervals >= kFewestToContradict &&
                     std::fabs(consensus.log_ratio) > kWrongUnit;
  if ((!judgement.metric && judgement.steady && judgement.sound) || wrong)
    verdict->metres_per_unit = std::exp(consensus.log_ratio);
}

}  // namespace farpoint::slam
