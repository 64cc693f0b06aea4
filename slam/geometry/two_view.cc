// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/two_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "slam/geometry/five_point.h"
#include "slam/geometry/match_columns.h"
#include "slam/geometry/random.h"
#include "slam/geometry/relative_motion.h"
#include "slam/geometry/robust.h"
#include "slam/geometry/short_list.h"
#include "slam/geometry/triangulation.h"

namespace farpoint::slam {

namespace {

// Chance that RANSAC may miss every clean sample.
constexpr double kMissChance = 1e-3;
// Sampled by every model whatever the inlier share: minimal samples of noisy matches differ in quality.
constexpr int kMinSamples = 60;
// Essential matrices (Frobenius norm 1) further apart than this count as different hypotheses.
constexpr double kDifferentEssential = 0.25;
constexpr size_t kMaxHypotheses = 4;
// Refined motions further apart than this are rivals, not the same optimum.
constexpr double kDifferentTranslation_rad = 0.2;
constexpr double kDifferentRotation_rad = 0.05;
// A point counts as in front of both views unless it is behind one by more than this many sigma.
constexpr double kBehindSigmas = 3.0;
// The homography must beat the essential motion's GRIC by this factor.
constexpr double kHomographyAdvantage = 0.98;

// Samples that reach a clean one with the wanted probability at this inlier share.
int needed_samples(double inlier_share, int sample_size, int max_samples) {
  const double clean = std::pow(std::clamp(inlier_share, 0.0, 1.0), sample_size);
  if (clean >= 1.0 - 1e-9) return kMinSamples;
  const double needed = std::log(kMissChance) / std::log1p(-clean);
  return needed >= max_samples ? max_samples : std::max(kMinSamples, static_cast<int>(std::ceil(needed)));
}

struct Problem {
  Bearings b1, b2;
  double sigma_rad;
  const TwoViewOptions& options;
  MatchColumns columns;
  TwoViewWorkspace& work;

  [[nodiscard]] size_t size() const { return b1.size(); }
  [[nodiscard]] float limit2(double chi2) const { return static_cast<float>(chi2 * sigma_rad * sigma_rad); }
  template <typename Kernel>
  [[nodiscard]] double share(const Kernel& kernel, double chi2) const {
    const Eigen::Index padding = columns.padded() - static_cast<Eigen::Index>(size());
    return static_cast<double>(columns.count(kernel, limit2(chi2)) - padding) / static_cast<double>(size());
  }
};

template <size_t K>
void gather(const Problem& p, const std::array<size_t, K>& indices, std::array<Eigen::Vector3d, K>* s1,
            std::array<Eigen::Vector3d, K>* s2) {
  for (size_t i = 0; i < K; ++i) {
    (*s1)[i] = p.b1[indices[i]];
    (*s2)[i] = p.b2[indices[i]];
  }
}

template <size_t K>
constexpr std::array<uint8_t, K> all_of() {
  std::array<uint8_t, K> mask{};
  mask.fill(1);
  return mask;
}

// --- rotation alone ---

struct RotationFit {
  Eigen::Matrix3d R_2_1 = Eigen::Matrix3d::Identity();
  size_t inliers = 0;
};

void find_rotation_inliers(const Problem& p, const Eigen::Matrix3d& r, double chi2,
                           std::vector<uint8_t>* mask) {
  mask->resize(p.size());
  for (size_t i = 0; i < p.size(); ++i) {
    (*mask)[i] = rotation_residual2_rad2(r, p.b1[i], p.b2[i]) < chi2 * p.sigma_rad * p.sigma_rad ? 1 : 0;
  }
}

size_t count_set(const std::vector<uint8_t>& mask) {
  return static_cast<size_t>(std::count(mask.begin(), mask.end(), uint8_t{1}));
}

RotationFit find_rotation(const Problem& p) {
  constexpr size_t kSample = 2;
  SampleGenerator generator(p.options.seed);
  RotationFit best;
  float best_cost = std::numeric_limits<float>::max();
  int samples = p.options.max_samples;
  for (int k = 0; k < samples; ++k) {
    std::array<Eigen::Vector3d, kSample> s1, s2;
    gather(p, generator.sample<kSample>(p.size()), &s1, &s2);
    // A rotation keeps angles: most contaminated samples end here.
    if (std::abs(parallax_angle(s1[0], s1[1]) - parallax_angle(s2[0], s2[1])) > 6.0 * p.sigma_rad) continue;
    const Eigen::Matrix3d r = fit_rotation(s1, s2, all_of<kSample>());
    const TransferKernel kernel{r.cast<float>()};
    const float cost = p.columns.cost(kernel, p.limit2(kChi2TwoDof99), best_cost);
    if (cost >= best_cost) continue;
    best_cost = cost;
    best.R_2_1 = r;
    samples = needed_samples(p.share(kernel, kChi2TwoDof99), kSample, p.options.max_samples);
  }
  std::vector<uint8_t>& mask = p.work.mask;
  find_rotation_inliers(p, best.R_2_1, kChi2TwoDof99, &mask);
  for (int round = 0; round < 3 && count_set(mask) >= kSample; ++round) {
    best.R_2_1 = fit_rotation(p.b1, p.b2, mask);
    find_rotation_inliers(p, best.R_2_1, kChi2TwoDof99, &mask);
  }
  best.inliers = count_set(mask);
  return best;
}

// --- homography ---

struct HomographyFit {
  bool found = false;
  Eigen::Matrix3d h = Eigen::Matrix3d::Identity();
  std::span<const double> chi2;  // of each match
  size_t inliers = 0;
};

HomographyFit find_homography(const Problem& p) {
  constexpr size_t kSample = 4;
  SampleGenerator generator(p.options.seed + 1);
  HomographyFit best;
  float best_cost = std::numeric_limits<float>::max();
  int samples = p.options.max_samples;
  for (int k = 0; k < samples; ++k) {
    std::array<Eigen::Vector3d, kSample> s1, s2;
    gather(p, generator.sample<kSample>(p.size()), &s1, &s2);
    Eigen::Matrix3d h;
    if (!fit_homography(s1, s2, all_of<kSample>(), &h)) continue;
    bool forward = true;
    for (size_t i = 0; i < kSample; ++i) forward = forward && s2[i].dot(h * s1[i]) > 0.0;
    if (!forward) continue;
    const TransferKernel kernel{h.cast<float>()};
    const float cost = p.columns.cost(kernel, p.limit2(kChi2TwoDof99), best_cost);
    if (cost >= best_cost) continue;
    best_cost = cost;
    best.found = true;
    best.h = h;
    samples = needed_samples(p.share(kernel, kChi2TwoDof99), kSample, p.options.max_samples);
  }
  if (!best.found) return best;
  best.h = refine_homography(p.b1, p.b2, p.sigma_rad, best.h);
  std::vector<double>& chi2 = p.work.plane_chi2;
  chi2.resize(p.size());
  for (size_t i = 0; i < p.size(); ++i) {
    chi2[i] = homography_residual2_rad2(best.h, p.b1[i], p.b2[i]) / (p.sigma_rad * p.sigma_rad);
    best.inliers += chi2[i] < kChi2TwoDof99 ? 1U : 0U;
  }
  best.chi2 = chi2;
  return best;
}

// --- essential motion ---

struct EssentialHypothesis {
  float cost = 0.0F;
  Eigen::Matrix3d e = Eigen::Matrix3d::Identity();
};

// One more than are kept: the next one is inserted before the last one goes.
using Hypotheses = ShortList<EssentialHypothesis, kMaxHypotheses + 1>;

double essential_distance(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::min((a - b).norm(), (a + b).norm());
}

// Keeps the best few hypotheses that differ from each other, best first.
void keep(const EssentialHypothesis& candidate, Hypotheses* kept) {
  for (const EssentialHypothesis& other : *kept) {
    if (other.cost <= candidate.cost && essential_distance(other.e, candidate.e) < kDifferentEssential)
      return;
  }
  kept->erase_if([&](const EssentialHypothesis& other) {
    return essential_distance(other.e, candidate.e) < kDifferentEssential;
  });
  const auto place = std::find_if(kept->begin(), kept->end(), [&](const EssentialHypothesis& other) {
    return candidate.cost < other.cost;
  });
  kept->insert(place, candidate);
  if (kept->size() > kMaxHypotheses) kept->pop_back();
}

Hypotheses find_essentials(const Problem& p) {
  constexpr size_t kSample = 5;
  SampleGenerator generator(p.options.seed + 2);
  Hypotheses kept;
  float best_cost = std::numeric_limits<float>::max();
  int samples = p.options.max_samples;
  for (int k = 0; k < samples; ++k) {
    std::array<Eigen::Vector3d, kSample> s1, s2;
    gather(p, generator.sample<kSample>(p.size()), &s1, &s2);
    const EssentialCandidates candidates = solve_five_point(s1, s2);
    for (size_t i = 0; i < candidates.count; ++i) {
      const EssentialKernel kernel{candidates.matrix[i].cast<float>()};
      const float enough =
          kept.size() < kMaxHypotheses ? std::numeric_limits<float>::max() : kept.back().cost;
      const float cost = p.columns.cost(kernel, p.limit2(kChi2OneDof99), enough);
      if (cost >= enough) continue;
      keep({cost, candidates.matrix[i]}, &kept);
      if (cost >= best_cost) continue;
      best_cost = cost;
      samples = needed_samples(p.share(kernel, kChi2OneDof99), kSample, p.options.max_samples);
    }
  }
  return kept;
}

// --- comparing motions ---

using Side = MatchGeometry::Side;

MatchGeometry match_geometry(const SE3& T_2_1, const Eigen::Vector3d& b1, const Eigen::Vector3d& b2,
                             double sigma_rad) {
  MatchGeometry m;
  m.chi2 = epipolar_residual2_rad2(T_2_1, b1, b2) / (sigma_rad * sigma_rad);
  const InverseDepth depth = triangulate_inverse_depth(b1, T_2_1, b2);
  m.inverse_depth = depth.inverse_depth;
  m.parallax_rad = depth.parallax_rad;
  m.inverse_depth_sigma =
      inverse_depth_sigma(b1, T_2_1, std::max(0.0, depth.inverse_depth), sigma_rad, sigma_rad);
  if (depth.ok && depth.inverse_depth > 0.0) {
    m.side = Side::kFront;
  } else {
    // Infinity within the noise, if the rays point the same way; along the baseline there is no depth to be
    // wrong.
    const bool far = (T_2_1.q * b1).dot(b2) > 0.0 && depth.inverse_depth <= 0.0 &&
                     depth.inverse_depth > -kBehindSigmas * m.inverse_depth_sigma;
    m.side = far ? Side::kNoDepth : Side::kBehind;
  }
  return m;
}

bool is_inlier(const MatchGeometry& m) {
  return m.supported && m.chi2 < kChi2OneDof99 && m.side != Side::kBehind;
}

struct Candidate {
  SE3 T_2_1;
  double translation_sigma_rad = 0.0;
  double cost = 0.0;
};
constexpr size_t kPlaneMotions = 4;
using Candidates = ShortList<Candidate, kMaxHypotheses + kPlaneMotions>;

// Truncated chi-square of a match's epipolar residual; a point behind a view costs as much as an outlier.
double match_cost(const Problem& p, const SE3& T_2_1, size_t i) {
  const double chi2 = epipolar_residual2_rad2(T_2_1, p.b1[i], p.b2[i]) / (p.sigma_rad * p.sigma_rad);
  if (chi2 >= kChi2OneDof99) return kChi2OneDof99;
  const bool behind = match_geometry(T_2_1, p.b1[i], p.b2[i], p.sigma_rad).side == Side::kBehind;
  return behind ? kChi2OneDof99 : chi2;
}

double motion_cost(const Problem& p, const SE3& T_2_1) {
  double cost = 0.0;
  for (size_t i = 0; i < p.size(); ++i) cost += match_cost(p, T_2_1, i);
  return cost;
}

// The motion of an essential matrix that puts most points in front of both views.
SE3 motion_in_front(const Problem& p, const Eigen::Matrix3d& essential) {
  SE3 best;
  double best_cost = std::numeric_limits<double>::max();
  for (const SE3& motion : decompose_essential(essential)) {
    const double cost = motion_cost(p, motion);
    if (cost < best_cost) {
      best_cost = cost;
      best = motion;
    }
  }
  return best;
}

double rotation_difference_rad(const SE3& a, const SE3& b) {
  return so3_log(a.q.conjugate() * b.q).norm();
}

bool different(const SE3& a, const SE3& b) {
  return parallax_angle(a.t, b.t) > kDifferentTranslation_rad ||
         rotation_difference_rad(a, b) > kDifferentRotation_rad;
}

// Motions of either model with their costs.
Candidates plane_motions(const Problem& p, const HomographyFit& plane) {
  Candidates motions;
  if (!plane.found) return motions;
  const PlaneMotions all = decompose_homography(plane.h);
  for (size_t i = 0; i < all.count; ++i) {
    motions.push_back({all.motion[i].T_2_1, 0.0, motion_cost(p, all.motion[i].T_2_1)});
  }
  return motions;
}

Candidates essential_motions(const Problem& p, const Hypotheses& essentials) {
  Candidates motions;
  for (const EssentialHypothesis& hypothesis : essentials) {
    const SE3 motion = motion_in_front(p, hypothesis.e);
    motions.push_back({motion, 0.0, motion_cost(p, motion)});
  }
  return motions;
}

// Stable, by insertion: std::stable_sort calls the heap.
void sort_by_cost(Candidates* motions) {
  for (Candidate* next = motions->begin(); next != motions->end(); ++next) {
    Candidate* const place =
        std::upper_bound(motions->begin(), next, *next,
                         [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
    std::rotate(place, next, next + 1);
  }
}

// The best few that differ from each other, each moved to its own optimum of the epipolar cost, best first.
Candidates refined_candidates(const Problem& p, Candidates motions) {
  sort_by_cost(&motions);
  Candidates candidates;
  for (const Candidate& motion : motions) {
    const bool known = std::any_of(candidates.begin(), candidates.end(),
                                   [&](const Candidate& c) { return !different(c.T_2_1, motion.T_2_1); });
    if (!known && candidates.size() < kMaxHypotheses) candidates.push_back(motion);
  }
  for (Candidate& candidate : candidates) {
    const MotionFit fit = refine_motion(p.b1, p.b2, p.sigma_rad, candidate.T_2_1, &p.work.motion);
    candidate = {fit.T_2_1, fit.translation_sigma_rad, motion_cost(p, fit.T_2_1)};
  }
  sort_by_cost(&candidates);
  return candidates;
}

// Torr's GRIC over the matches that either model explains: residuals truncated at 2 (r - d), plus the price
// of the structure's dimension d (a point on a plane has 2, in space 3, data dimension r = 4) and of the k
// parameters.
bool plane_is_better(const HomographyFit& plane, const std::vector<MatchGeometry>& general) {
  double cost_plane = 0.0, cost_general = 0.0, n = 0.0;
  for (size_t i = 0; i < general.size(); ++i) {
    if (plane.chi2[i] >= kChi2TwoDof99 && general[i].chi2 >= kChi2OneDof99) continue;
    cost_plane += std::min(plane.chi2[i], 4.0) + 2.0 * std::log(4.0);
    cost_general += std::min(general[i].chi2, 2.0) + 3.0 * std::log(4.0);
    n += 1.0;
  }
  if (n < 1.0) return false;
  cost_plane += 8.0 * std::log(4.0 * n);
  cost_general += 5.0 * std::log(4.0 * n);
  return cost_plane < kHomographyAdvantage * cost_general;
}

// Variance of the residuals in units of sigma^2 as the matches show it, at least 1.
double observed_variance(const std::vector<MatchGeometry>& geometry, std::vector<double>* memory) {
  std::vector<double>& chi2 = *memory;
  chi2.clear();
  for (const MatchGeometry& m : geometry) {
    if (is_inlier(m)) chi2.push_back(m.chi2);
  }
  if (chi2.empty()) return 1.0;
  const auto middle = chi2.begin() + static_cast<std::ptrdiff_t>(chi2.size() / 2);
  std::nth_element(chi2.begin(), middle, chi2.end());
  return std::max(1.0, *middle / kChi2OneDof50);
}

const std::vector<MatchGeometry>& all_geometry(const Problem& p, const SE3& T_2_1) {
  std::vector<MatchGeometry>& geometry = p.work.geometry;
  geometry.resize(p.size());
  const std::vector<uint8_t>& supported =
      supported_matches(p.b1, p.b2, T_2_1, std::sqrt(kChi2OneDof99) * p.sigma_rad, &p.work.motion);
  for (size_t i = 0; i < p.size(); ++i) {
    geometry[i] = match_geometry(T_2_1, p.b1[i], p.b2[i], p.sigma_rad);
    geometry[i].supported = supported[i] != 0;
  }
  return geometry;
}

void fill_matches(const std::vector<MatchGeometry>& geometry, std::vector<double>* memory,
                  TwoViewResult* result) {
  std::vector<double>& parallaxes = *memory;
  parallaxes.clear();
  result->inliers = 0;
  result->valid_depths = 0;
  for (size_t i = 0; i < geometry.size(); ++i) {
    const bool inlier = is_inlier(geometry[i]);
    const bool deep = inlier && geometry[i].side == Side::kFront;
    result->inlier[i] = inlier ? 1 : 0;
    result->inverse_depth[i] = deep ? geometry[i].inverse_depth : 0.0;
    result->parallax_rad[i] = geometry[i].parallax_rad;
    result->inliers += inlier ? 1U : 0U;
    if (deep) parallaxes.push_back(geometry[i].parallax_rad);
  }
  result->valid_depths = parallaxes.size();
  if (parallaxes.empty()) return;
  const auto middle = parallaxes.begin() + static_cast<std::ptrdiff_t>(parallaxes.size() / 2);
  std::nth_element(parallaxes.begin(), middle, parallaxes.end());
  result->median_parallax_rad = *middle;
}

void set_rotation_only(const Problem& p, const RotationFit& rotation, TwoViewResult* result) {
  result->status = TwoViewStatus::kNoParallax;
  result->model = TwoViewModel::kNone;
  result->T_2_1 = {Eigen::Quaterniond(rotation.R_2_1).normalized(), Eigen::Vector3d::Zero()};
  find_rotation_inliers(p, rotation.R_2_1, kChi2TwoDof99, &result->inlier);
  result->inliers = rotation.inliers;
  result->valid_depths = 0;
  result->median_parallax_rad = 0.0;
  for (size_t i = 0; i < p.size(); ++i) {
    result->inverse_depth[i] = 0.0;
    result->parallax_rad[i] = parallax_angle(rotation.R_2_1 * p.b1[i], p.b2[i]);
  }
}

// Share of the matches that the motion explains and the rotation does not, at the noise as it turned out.
double unexplained_share(const Problem& p, const RotationFit& rotation,
                         const std::vector<MatchGeometry>& geometry) {
  const double variance = observed_variance(geometry, &p.work.values);
  const double limit = kChi2TwoDof99 * variance * p.sigma_rad * p.sigma_rad;
  size_t explained = 0, unexplained = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    if (!is_inlier(geometry[i])) continue;
    (rotation_residual2_rad2(rotation.R_2_1, p.b1[i], p.b2[i]) < limit ? explained : unexplained) += 1;
  }
  const size_t all = explained + unexplained;
  return all > 0 ? static_cast<double>(unexplained) / static_cast<double>(all) : 0.0;
}

bool enough_inliers(const Problem& p, size_t inliers) {
  return inliers >= p.options.min_inliers &&
         static_cast<double>(inliers) >= p.options.min_inlier_share * static_cast<double>(p.size());
}

// The plane's own motion that agrees with the best one, or null.
const Candidate* agreeing(const Candidates& on_plane, const SE3& best) {
  const Candidate* chosen = nullptr;
  for (const Candidate& c : on_plane) {
    if (!different(c.T_2_1, best) && (chosen == nullptr || c.cost < chosen->cost)) chosen = &c;
  }
  return chosen;
}

// Vuong's statistic of the best motion against the best different one, with the second moment about zero in
// place of the variance, which vanishes where every match pays the same. Motions that share a plane's
// homography see different components of each match's noise, so that their costs differ by chance by the root
// of the sum of squares.
double rival_sigmas(const Problem& p, const Candidates& candidates) {
  const SE3& best = candidates.front().T_2_1;
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate& c : candidates) {
    if (!different(c.T_2_1, best)) continue;
    double sum = 0.0, sum2 = 0.0;
    for (size_t i = 0; i < p.size(); ++i) {
      const double difference = match_cost(p, c.T_2_1, i) - match_cost(p, best, i);
      sum += difference;
      sum2 += difference * difference;
    }
    least = std::min(least, sum2 > 0.0 ? sum / std::sqrt(sum2) : 0.0);
  }
  return least;
}

// All values of an empty result, in the memory of an older one.
void begin_result(size_t matches, TwoViewResult* result) {
  TwoViewResult empty;
  empty.inlier = std::move(result->inlier);
  empty.inverse_depth = std::move(result->inverse_depth);
  empty.parallax_rad = std::move(result->parallax_rad);
  *result = std::move(empty);
  result->matches = matches;
  result->inlier.assign(matches, 0);
  result->inverse_depth.assign(matches, 0.0);
  result->parallax_rad.assign(matches, 0.0);
}

}  // namespace

const char* name(TwoViewStatus status) {
  switch (status) {
    case TwoViewStatus::kOk:
      return "ok";
    case TwoViewStatus::kTooFewMatches:
      return "too few matches";
    case TwoViewStatus::kNoParallax:
      return "no parallax";
    case TwoViewStatus::kAmbiguous:
      return "ambiguous";
    case TwoViewStatus::kPoorModel:
      return "poor model";
  }
  return "unknown";
}

void TwoViewWorkspace::reserve(size_t matches) {
  columns.setZero(MatchColumns::padded_rows(matches), MatchColumns::kColumns);
  // Touched, not only reserved.
  mask.resize(matches);
  plane_chi2.resize(matches);
  values.resize(matches);
  geometry.resize(matches);
  motion.reserve(matches);
  result.inlier.resize(matches);
  result.inverse_depth.resize(matches);
  result.parallax_rad.resize(matches);
}

size_t TwoViewWorkspace::bytes() const {
  return static_cast<size_t>(columns.size()) * sizeof(float) + mask.capacity() +
         (plane_chi2.capacity() + values.capacity()) * sizeof(double) +
         geometry.capacity() * sizeof(MatchGeometry) + motion.bytes() + result.inlier.capacity() +
         (result.inverse_depth.capacity() + result.parallax_rad.capacity()) * sizeof(double);
}

TwoViewResult estimate_two_view(std::span<const Eigen::Vector3d> bearings_1,
                                std::span<const Eigen::Vector3d> bearings_2, double sigma_rad,
                                const TwoViewOptions& options) {
  TwoViewWorkspace workspace;
  return estimate_two_view(bearings_1, bearings_2, sigma_rad, options, &workspace);
}

const TwoViewResult& estimate_two_view(std::span<const Eigen::Vector3d> bearings_1,
                                       std::span<const Eigen::Vector3d> bearings_2, double sigma_rad,
                                       const TwoViewOptions& options, TwoViewWorkspace* workspace) {
  TwoViewResult& result = workspace->result;
  begin_result(std::min(bearings_1.size(), bearings_2.size()), &result);
  const size_t n = result.matches;
  if (n < std::max<size_t>(options.min_matches, 6) || !(sigma_rad > 0.0)) return result;
  bearings_1 = bearings_1.first(n);
  bearings_2 = bearings_2.first(n);
  const Problem p{
      bearings_1, bearings_2, sigma_rad, options, MatchColumns(bearings_1, bearings_2, &workspace->columns),
      *workspace};

  const RotationFit rotation = find_rotation(p);
  result.rotation_inliers = rotation.inliers;
  if (static_cast<double>(rotation.inliers) >=
      (1.0 - options.max_unexplained_share) * static_cast<double>(n)) {
    result.unexplained_share = 1.0 - static_cast<double>(rotation.inliers) / static_cast<double>(n);
    set_rotation_only(p, rotation, &result);
    return result;
  }

  const Hypotheses essentials = find_essentials(p);
  const HomographyFit plane = find_homography(p);
  result.homography_inliers = plane.inliers;
  const Candidates on_plane = plane_motions(p, plane);
  Candidates motions = essential_motions(p, essentials);
  for (const Candidate& motion : on_plane) motions.push_back(motion);
  const Candidates candidates = refined_candidates(p, motions);
  result.status = TwoViewStatus::kPoorModel;
  if (candidates.empty()) return result;

  const Candidate& best = candidates.front();
  const std::vector<MatchGeometry>& geometry = all_geometry(p, best.T_2_1);
  result.essential_inliers = static_cast<size_t>(std::count_if(geometry.begin(), geometry.end(), is_inlier));
  result.unexplained_share = unexplained_share(p, rotation, geometry);
  if (result.unexplained_share <= options.max_unexplained_share && enough_inliers(p, rotation.inliers)) {
    set_rotation_only(p, rotation, &result);
    return result;
  }

  result.model = TwoViewModel::kEssential;
  result.T_2_1 = best.T_2_1;
  result.translation_sigma_rad = best.translation_sigma_rad;
  if (plane.found && plane_is_better(plane, geometry)) {
    // A plane's own motion uses both residuals of every match and is the more accurate one.
    if (const Candidate* motion = agreeing(on_plane, best.T_2_1)) {
      result.model = TwoViewModel::kHomography;
      result.T_2_1 = motion->T_2_1;
      (void)all_geometry(p, result.T_2_1);  // the same memory
    }
  }
  fill_matches(geometry, &workspace->values, &result);
  const double variance = observed_variance(geometry, &workspace->values);
  result.rival_sigmas = rival_sigmas(p, candidates);
  if (!enough_inliers(p, result.inliers)) {
    result.status = TwoViewStatus::kPoorModel;
  } else if (result.rival_sigmas < options.ambiguity_sigmas ||
             result.translation_sigma_rad * std::sqrt(variance) > options.max_translation_sigma_rad) {
    result.status = TwoViewStatus::kAmbiguous;
  } else {
    result.status = TwoViewStatus::kOk;
  }
  return result;
}

}  // namespace farpoint::slam
