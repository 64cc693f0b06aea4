// SPDX-License-Identifier: Apache-2.0
// Algorithm 1 step by step: a map filled by hand, keyframes with known poses, simulated pixels.
#include "slam/mapping/landmark_maker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>

#include "slam/mapping/mapper.h"
#include "tests/scenes/simulator.h"

namespace farpoint::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using slam::KeyframeHandle;
using slam::Landmark;
using slam::LandmarkHandle;
using slam::LandmarkState;
using slam::SE3;

constexpr double kFocal_px = 500.0;
constexpr std::uint32_t kScaffold = 1000;  // ids of the scaffold's points begin here

slam::Rig plain_rig() {
  slam::Camera::Parameters p;
  p.width_px = 640, p.height_px = 480;
  p.fx_px = p.fy_px = kFocal_px, p.cx_px = 320, p.cy_px = 240;
  slam::Rig rig;
  rig.cameras.push_back({"camera", slam::Camera(p), SE3{}});
  return rig;
}

// A point that keyframes see. Each sighting may choose another of several that look alike, and its level.
struct Corner {
  std::uint32_t id = 0;
  Vector3d position = Vector3d::Zero();
  int level = 0;
  std::uint32_t group = 0;
  std::uint32_t look = 0;  // what the descriptor is made from; 0: the id
};

slam::Descriptor descriptor_of(const Corner& c) {
  SightingDraw draw(combine({0xde5cULL, c.look != 0 ? c.look : c.id}));
  slam::Descriptor d;
  for (auto& word : d.words) word = draw.bits();
  return d;
}

class LandmarkMakerTest : public ::testing::Test {
 protected:
  LandmarkMakerTest() { use(slam::LandmarkMode::kVmp); }

  void use(slam::LandmarkMode mode, int max_bearing = 4000, double align_sigma_px = 0.0) {
    config_ = {};
    config_.landmarks.mode = mode;
    config_.landmarks.max_bearing = max_bearing;
    config_.capacity.keyframes = 40;
    config_.capacity.landmarks = 2000;
    image_.noise = NoiseConfig{};
    image_.noise.align_sigma_px = align_sigma_px;
    image_.noise.align_failure = 0.0;
    image_.noise.alike_alignment = 1.0;
    image_.width_px = 640, image_.height_px = 480;
    counts_ = {};
    map_ = std::make_unique<slam::Map>(
        config_.capacity, rig_,
        slam::MapOptions{.wide_parallax_rad = config_.landmarks.promote_parallax_rad});
    maker_ = std::make_unique<slam::LandmarkMaker>(config_, map_.get(), &counts_);
    features_.clear();
    scaffold_.clear();
    scaffold_landmarks_.clear();
    frames_ = 0;
    // A dozen points 20 m away give the maker the depth of the scene.
    for (std::uint32_t i = 0; i < 12; ++i) {
      const std::uint32_t column = i % 4, row = i / 4;
      scaffold_.push_back({kScaffold + i, {-6.0 + 4.0 * column, -4.0 + 4.0 * row, 20.0}});
    }
  }

  // A keyframe at the pose that sees these corners, exactly, and the scaffold.
  KeyframeHandle look(const SE3& T_world_body, std::vector<Corner> corners) {
    corners.insert(corners.end(), scaffold_.begin(), scaffold_.end());
    slam::Keyframe k;
    k.T_world_body = T_world_body;
    k.map_id = 1;
    slam::KeyframeView& view = k.views[0];
    std::vector<SimImage::Projection> visible;
    std::vector<PatchPayload> payloads;
    std::map<std::uint32_t, std::size_t> features;
    for (const Corner& c : corners) {
      Vector2d pixel;
      if (!rig_.cameras[0].camera.project(T_world_body.inverse() * c.position, &pixel)) continue;
      if (!rig_.cameras[0].camera.in_image(pixel, 20.0)) continue;
      slam::Feature f;
      f.u_px = static_cast<float>(pixel.x()), f.v_px = static_cast<float>(pixel.y());
      f.level = static_cast<std::uint8_t>(c.level);
      features[c.id] = view.set.features.size();
      view.set.features.push_back(f);
      view.set.descriptors.push_back(descriptor_of(c));
      Vector3d bearing;
      EXPECT_TRUE(rig_.cameras[0].camera.unproject(pixel, &bearing));
      view.bearings.emplace_back(bearing.cast<float>());
      visible.push_back({c.id, c.group, pixel.cast<float>()});
      payloads.push_back({c.id, frames_, 0.0F, 0.0F, c.group});
    }
    view.grid = slam::FeatureGrid(640, 480, 24, view.set.features.size());
    view.grid.build(view.set.features);
    view.image = std::make_shared<SimImage>(image_, frames_++, std::move(visible), std::move(payloads));
    const KeyframeHandle handle = map_->add_keyframe(std::move(k));
    EXPECT_FALSE(handle.is_null());
    features_[handle.index] = features;
    attach_scaffold(handle);
    return handle;
  }
  KeyframeHandle look(double x_m, const std::vector<Corner>& corners) {
    return look(SE3{Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0}}, corners);
  }

  void attach_scaffold(KeyframeHandle keyframe) {
    for (const Corner& c : scaffold_) {
      const auto it = features_[keyframe.index].find(c.id);
      if (it == features_[keyframe.index].end()) continue;
      if (!scaffold_landmarks_.contains(c.id)) {
        const LandmarkHandle h = map_->add_landmark(keyframe, 0, it->second);
        ASSERT_FALSE(h.is_null());
        Landmark& l = map_->landmarks()[h];
        l.inverse_depth = 1.0 / (c.position - map_->keyframes()[keyframe].T_world_body.t).norm();
        l.state = LandmarkState::kFull;
        scaffold_landmarks_[c.id] = h;
      } else {
        const slam::Feature& f = map_->keyframes()[keyframe].views[0].set.features[it->second];
        ASSERT_TRUE(
            map_->add_observation(scaffold_landmarks_[c.id],
                                  {keyframe, static_cast<std::int32_t>(it->second), {f.u_px, f.v_px}, 0.5F}));
      }
    }
  }

  [[nodiscard]] LandmarkHandle at(KeyframeHandle keyframe, std::uint32_t id) const {
    const auto it = features_.at(keyframe.index).find(id);
    return it == features_.at(keyframe.index).end()
               ? LandmarkHandle{}
               : map_->keyframes()[keyframe].views[0].landmarks[it->second];
  }
  [[nodiscard]] const Landmark* landmark(KeyframeHandle keyframe, std::uint32_t id) const {
    return map_->landmarks().get(at(keyframe, id));
  }
  [[nodiscard]] std::size_t bearings() const {
    std::size_t n = 0;
    map_->landmarks().for_each(
        [&](LandmarkHandle, const Landmark& l) { n += l.state == LandmarkState::kBearing ? 1U : 0U; });
    return n;
  }

  // Every VMP ever made is still one, was merged, promoted, rejected or evicted.
  void expect_balance() const {
    EXPECT_EQ(counts_.vmp_made, bearings() + counts_.vmp_merged + counts_.vmp_promoted +
                                    counts_.vmp_rejected + counts_.vmp_evicted);
  }

  slam::Rig rig_ = plain_rig();
  slam::EstimatorConfig config_;
  SimImage::Options image_;
  slam::MappingCounts counts_;
  std::unique_ptr<slam::Map> map_;
  std::unique_ptr<slam::LandmarkMaker> maker_;
  std::vector<Corner> scaffold_;
  std::map<std::uint32_t, LandmarkHandle> scaffold_landmarks_;
  std::map<std::uint32_t, std::map<std::uint32_t, std::size_t>>
      features_;  // of a keyframe slot: point -> feature
  std::uint32_t frames_ = 0;
};

const Corner kFar{1, {30.0, -20.0, 400.0}};
const Corner kVeryFar{2, {-200.0, -100.0, 2000.0}};
const Corner kNear{3, {2.0, 1.0, 22.0}};

TEST_F(LandmarkMakerTest, NearPairBecomesALandmarkAtOnce) {
  const KeyframeHandle a = look(0.0, {kNear}), b = look(1.0, {kNear});
  maker_->process(b, {a});
  const Landmark* l = landmark(b, kNear.id);
  ASSERT_NE(l, nullptr);
  EXPECT_NE(l->state, LandmarkState::kBearing);
  EXPECT_FALSE(l->through_vmp);
  EXPECT_EQ(l->host, a);
  EXPECT_NEAR(l->inverse_depth, 1.0 / kNear.position.norm(), 1e-5);
  EXPECT_NEAR(l->creation_depth, (kNear.position - Vector3d(1, 0, 0)).norm(), 0.01);
  EXPECT_EQ(counts_.landmarks_made, 1U);
  EXPECT_EQ(counts_.vmp_made, 0U);
}

TEST_F(LandmarkMakerTest, FarPairBecomesAVirtualPoint) {
  const KeyframeHandle a = look(0.0, {kFar}), b = look(1.0, {kFar});
  maker_->process(b, {a});
  const Landmark* l = landmark(b, kFar.id);
  ASSERT_NE(l, nullptr);
  EXPECT_EQ(l->state, LandmarkState::kBearing);
  EXPECT_EQ(at(a, kFar.id), at(b, kFar.id));
  EXPECT_EQ(l->observations.size(), 2U);
  // Efficient parallax inspection: the structure knows its largest angle and who gives it.
  const Vector3d to_b = (kFar.position - Vector3d(1, 0, 0)).normalized();
  EXPECT_NEAR(l->max_parallax_rad, std::acos(kFar.position.normalized().dot(to_b)), 1e-5);
  EXPECT_EQ(l->parallax_keyframe, b);
  EXPECT_EQ(counts_.vmp_made, 1U);
  EXPECT_EQ(counts_.landmarks_made, 0U);
  expect_balance();
}

TEST_F(LandmarkMakerTest, BaselineMakesNoVirtualPoints) {
  use(slam::LandmarkMode::kBaseline);
  const std::size_t slots = scaffold_.size();
  const KeyframeHandle a = look(0.0, {kFar, kNear}), b = look(1.0, {kFar, kNear});
  maker_->process(b, {a});
  EXPECT_EQ(landmark(b, kFar.id), nullptr);
  ASSERT_NE(landmark(b, kNear.id), nullptr);  // 2.6 degrees of parallax
  EXPECT_EQ(map_->landmarks().size(), slots + 1);
  // 10 m of base give the far point 1.43 degrees, enough for two views.
  const KeyframeHandle c = look(10.0, {kFar});
  maker_->process(c, {a});
  ASSERT_NE(landmark(c, kFar.id), nullptr);
  EXPECT_NEAR(landmark(c, kFar.id)->inverse_depth * kFar.position.norm(), 1.0, 1e-3);
  EXPECT_EQ(counts_.vmp_made + counts_.vmp_attached + counts_.vmp_promoted, 0U);
}

// Two corners that happen to lie on each other's epipolar line: the keyframes between them, which look the
// same way, show nothing where the point would be.
TEST_F(LandmarkMakerTest, APairThatOtherKeyframesDoNotBearOutWaitsAsAVirtualPoint) {
  const KeyframeHandle a = look(0.0, {kNear}), c = look(0.3, {}), d = look(0.6, {}), b = look(1.0, {kNear});
  maker_->process(b, {a, c, d});
  ASSERT_NE(landmark(b, kNear.id), nullptr);
  EXPECT_EQ(landmark(b, kNear.id)->state, LandmarkState::kBearing);
  EXPECT_EQ(counts_.landmarks_made, 0U);
  EXPECT_EQ(counts_.vmp_made, 1U);
  // A third sighting that agrees confirms as much as a keyframe.
  const KeyframeHandle e = look(1.3, {kNear});
  maker_->process(e, {b, a, c, d});
  ASSERT_NE(landmark(e, kNear.id), nullptr);
  EXPECT_EQ(landmark(e, kNear.id)->state, LandmarkState::kFull);
  EXPECT_TRUE(landmark(e, kNear.id)->through_vmp);
  expect_balance();
}

TEST_F(LandmarkMakerTest, TheBaselineDropsAPairThatOtherKeyframesDoNotBearOut) {
  use(slam::LandmarkMode::kBaseline);
  const KeyframeHandle a = look(0.0, {kNear}), c = look(0.3, {}), d = look(0.6, {}), b = look(1.0, {kNear});
  maker_->process(b, {a, c, d});
  EXPECT_EQ(landmark(b, kNear.id), nullptr);
  EXPECT_EQ(counts_.landmarks_made, 0U);
}

// Hidden in two of three: still a point. So it is where no other keyframe looks.
TEST_F(LandmarkMakerTest, OneKeyframeInThreeBearsAPairOut) {
  const KeyframeHandle a = look(0.0, {kNear}), c = look(0.3, {}), d = look(0.6, {}), e = look(0.8, {kNear}),
                       b = look(1.0, {kNear});
  maker_->process(b, {a, c, d, e});
  ASSERT_NE(landmark(b, kNear.id), nullptr);
  EXPECT_NE(landmark(b, kNear.id)->state, LandmarkState::kBearing);
  EXPECT_FALSE(landmark(b, kNear.id)->through_vmp);
}

TEST_F(LandmarkMakerTest, KeyframesThatLookElsewhereAreNotAsked) {
  const SE3 backwards{Eigen::Quaterniond(0, 0, 1, 0), {0.5, 0.0, 0.0}};
  const KeyframeHandle a = look(0.0, {kNear}), c = look(backwards, {}), b = look(1.0, {kNear});
  maker_->process(b, {a, c});
  ASSERT_NE(landmark(b, kNear.id), nullptr);
  EXPECT_NE(landmark(b, kNear.id)->state, LandmarkState::kBearing);
}

// The same as APairThatOtherKeyframesDoNotBearOut..., except that a bonnet hides the place in both of them.
TEST_F(LandmarkMakerTest, KeyframesThatHaveTheirMaskThereAreNotAsked) {
  std::vector<std::uint8_t> pixels(640 * 480, 255);
  for (const double x_m : {0.3, 0.6}) {
    Vector2d pixel;
    ASSERT_TRUE(rig_.cameras[0].camera.project(kNear.position - Vector3d(x_m, 0, 0), &pixel));
    pixels[static_cast<std::size_t>(std::lround(pixel.y()) * 640 + std::lround(pixel.x()))] = 0;
  }
  rig_.cameras[0].mask = std::make_shared<const slam::ImageMask>(640, 480, pixels);
  use(slam::LandmarkMode::kVmp);
  const KeyframeHandle a = look(0.0, {kNear}), c = look(0.3, {}), d = look(0.6, {}), b = look(1.0, {kNear});
  maker_->process(b, {a, c, d});
  ASSERT_NE(landmark(b, kNear.id), nullptr);
  EXPECT_NE(landmark(b, kNear.id)->state, LandmarkState::kBearing);
}

TEST_F(LandmarkMakerTest, SightingsAttachUntilTheDepthIsKnown) {
  const KeyframeHandle a = look(0.0, {kFar}), b = look(1.0, {kFar});
  maker_->process(b, {a});
  const LandmarkHandle h = at(b, kFar.id);
  const KeyframeHandle c = look(2.0, {kFar});
  maker_->process(c, {b});
  EXPECT_EQ(at(c, kFar.id), h);
  EXPECT_EQ(counts_.vmp_attached, 1U);
  EXPECT_EQ(map_->landmarks()[h].state, LandmarkState::kBearing);

  const KeyframeHandle d = look(12.0, {kFar});
  maker_->process(d, {c});
  const Landmark* l = map_->landmarks().get(h);
  ASSERT_NE(l, nullptr);
  EXPECT_EQ(l->state, LandmarkState::kFull);
  EXPECT_TRUE(l->through_vmp);
  // It inherits every observation, and the depth comes from all of them.
  EXPECT_EQ(l->observations.size(), 4U);
  EXPECT_EQ(l->host, a);
  EXPECT_NEAR(l->inverse_depth * kFar.position.norm(), 1.0, 1e-3);
  EXPECT_LT(l->inverse_depth_sigma, 0.1 * l->inverse_depth);
  EXPECT_GT(l->inverse_depth_sigma, 0.0);
  EXPECT_EQ(counts_.vmp_promoted, 1U);
  EXPECT_EQ(counts_.landmarks_made, 1U);
  expect_balance();
  // Covisibility grows with what it inherited: a and d share it.
  map_->update_covisibility(d);
  int shared = 0, scaffold = 0;
  for (const slam::Covisible& v : map_->keyframes()[d].covisible)
    if (v.keyframe == a) shared = v.shared;
  for (const Corner& corner : scaffold_) scaffold += at(d, corner.id).is_null() ? 0 : 1;
  EXPECT_EQ(shared, scaffold + 1);
}

TEST_F(LandmarkMakerTest, TwoVirtualPointsOfOneLandmarkMerge) {
  const KeyframeHandle a = look(0.0, {kVeryFar}), b = look(1.0, {kVeryFar});
  maker_->process(b, {a});
  const KeyframeHandle c = look(2.0, {kVeryFar}), d = look(3.0, {kVeryFar});
  maker_->process(d, {c});
  const LandmarkHandle first = at(a, kVeryFar.id), second = at(c, kVeryFar.id);
  ASSERT_FALSE(first == second);
  EXPECT_EQ(counts_.vmp_made, 2U);
  maker_->process(d, {b});
  EXPECT_EQ(counts_.vmp_merged, 1U);
  EXPECT_EQ(at(d, kVeryFar.id), first);
  EXPECT_EQ(at(c, kVeryFar.id), first);
  EXPECT_FALSE(map_->landmarks().contains(second));
  EXPECT_EQ(map_->landmarks()[first].observations.size(), 4U);
  expect_balance();
}

TEST_F(LandmarkMakerTest, OnesThatOnlyLookAlikeDoNotMerge) {
  // The same descriptor 3 px apart; the patches differ.
  image_.noise.alike_alignment = 0.0;
  Corner twin = kVeryFar;
  twin.id = 9, twin.look = kVeryFar.id, twin.group = 7;
  twin.position.x() += 12.0;
  Corner one = kVeryFar;
  one.group = 7;
  const KeyframeHandle a = look(0.0, {one}), b = look(1.0, {one});
  maker_->process(b, {a});
  const KeyframeHandle c = look(2.0, {twin}), d = look(3.0, {twin});
  maker_->process(d, {c});
  ASSERT_EQ(counts_.vmp_made, 2U);
  maker_->process(d, {b});
  EXPECT_EQ(counts_.vmp_merged, 0U);
  EXPECT_EQ(bearings(), 2U);
}

TEST_F(LandmarkMakerTest, ASightingOfSomethingElseIsDroppedAgain) {
  std::vector<KeyframeHandle> seen;
  seen.reserve(4);
  Corner one = kFar;
  one.group = 7;
  for (int i = 0; i < 4; ++i) seen.push_back(look(0.5 * i, {one}));
  for (std::size_t i = 1; i < seen.size(); ++i) maker_->process(seen[i], {seen[i - 1]});
  const LandmarkHandle h = at(seen.back(), one.id);
  ASSERT_EQ(map_->landmarks()[h].observations.size(), 4U);
  // 10 px along the epipolar line where the true one should have moved 2.5: a twin at a quarter of the depth.
  Corner twin = one;
  twin.id = 9, twin.look = one.id, twin.position *= 0.25;
  const KeyframeHandle odd = look(2.0, {twin});
  maker_->process(odd, {seen.back()});
  ASSERT_TRUE(map_->landmarks().contains(h));
  EXPECT_EQ(map_->landmarks()[h].observations.size(), 4U);
  EXPECT_EQ(at(odd, twin.id), LandmarkHandle{});
  EXPECT_EQ(map_->landmarks()[h].state, LandmarkState::kBearing);
  EXPECT_EQ(counts_.vmp_rejected, 0U);
}

TEST_F(LandmarkMakerTest, OneThatFailsAgainAndAgainIsRejected) {
  std::vector<KeyframeHandle> seen;
  seen.reserve(4);
  Corner one = kFar;
  one.group = 7;
  for (int i = 0; i < 4; ++i) seen.push_back(look(0.5 * i, {one}));
  for (std::size_t i = 1; i < seen.size(); ++i) maker_->process(seen[i], {seen[i - 1]});
  const LandmarkHandle h = at(seen.back(), one.id);
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(counts_.vmp_rejected, 0U);
    Corner twin = one;
    twin.id = 9 + i, twin.look = one.id, twin.position *= 0.3 - 0.05 * i;
    const KeyframeHandle odd = look(2.0, {twin});
    maker_->process(odd, {seen.back()});
  }
  EXPECT_FALSE(map_->landmarks().contains(h));
  EXPECT_EQ(counts_.vmp_rejected, 1U);
  for (const KeyframeHandle& k : seen) EXPECT_EQ(at(k, one.id), LandmarkHandle{});
  expect_balance();
}

TEST_F(LandmarkMakerTest, SizeAgainstDepthRejects) {
  // Three metres nearer it should look larger; it looks 1.7 times smaller.
  Corner coarse = kNear, fine = kNear;
  coarse.level = 3, fine.level = 0;
  const KeyframeHandle a = look(SE3{}, {fine});
  const KeyframeHandle b = look(SE3{Eigen::Quaterniond::Identity(), {2.0, 0.0, 4.0}}, {coarse});
  maker_->process(b, {a});
  const Landmark* right = landmark(b, kNear.id);
  ASSERT_NE(right, nullptr);  // larger where it is nearer
  EXPECT_NE(right->state, LandmarkState::kBearing);

  use(slam::LandmarkMode::kVmp);
  const KeyframeHandle c = look(SE3{}, {coarse});
  const KeyframeHandle d = look(SE3{Eigen::Quaterniond::Identity(), {2.0, 0.0, 4.0}}, {fine});
  maker_->process(d, {c});
  EXPECT_EQ(landmark(d, kNear.id), nullptr);
  EXPECT_EQ(counts_.landmarks_made, 0U);
  EXPECT_EQ(map_->landmarks().size(), scaffold_landmarks_.size());
}

TEST_F(LandmarkMakerTest, VirtualPointsNotSeenForLongGiveTheirSlotsBack) {
  const KeyframeHandle a = look(0.0, {kFar, kVeryFar}), b = look(1.0, {kFar, kVeryFar});
  maker_->process(b, {a});
  ASSERT_EQ(counts_.vmp_made, 2U);
  const LandmarkHandle old = at(b, kFar.id);
  const std::size_t size = map_->landmarks().size();
  KeyframeHandle newest = b;
  // Seen again in between: that one stays.
  const KeyframeHandle c = look(1.5, {kVeryFar});
  for (int i = 0; i < 12; ++i) {
    newest = look(2.0 + 0.1 * i, {});
    if (i == 5) {
      newest = look(1.5, {kVeryFar});
      maker_->process(newest, {b});
    }
    maker_->evict_bearings(newest);
    expect_balance();
  }
  EXPECT_EQ(counts_.vmp_evicted, 1U);
  EXPECT_FALSE(map_->landmarks().contains(old));
  EXPECT_NE(landmark(b, kVeryFar.id), nullptr);
  EXPECT_EQ(map_->landmarks().size(), size - 1);
  EXPECT_EQ(at(a, kFar.id), LandmarkHandle{});
  (void)c;

  // The slot serves again, under another generation.
  const KeyframeHandle d = look(4.0, {kFar}), e = look(5.0, {kFar});
  maker_->process(e, {d});
  const LandmarkHandle fresh = at(e, kFar.id);
  ASSERT_FALSE(fresh.is_null());
  EXPECT_EQ(fresh.index, old.index);
  EXPECT_NE(fresh.generation, old.generation);
}

TEST_F(LandmarkMakerTest, TooManyVirtualPointsLoseTheLeastUseful) {
  use(slam::LandmarkMode::kVmp, 5);
  std::vector<Corner> corners;
  for (std::uint32_t i = 0; i < 12; ++i)
    corners.push_back({100 + i, {-220.0 + 40.0 * i, -60.0, 400.0 + 50.0 * i}});
  const KeyframeHandle a = look(0.0, corners), b = look(1.0, corners);
  maker_->process(b, {a});
  ASSERT_EQ(counts_.vmp_made, 12U);
  maker_->evict_bearings(b);
  EXPECT_EQ(counts_.vmp_evicted, 7U);
  EXPECT_EQ(bearings(), 5U);
  // Seen equally lately, those with the most parallax stay: the nearest.
  for (std::uint32_t i = 0; i < 12; ++i) EXPECT_EQ(landmark(b, 100 + i) != nullptr, i < 5) << i;
  expect_balance();
}

TEST_F(LandmarkMakerTest, DepthsAreRightForTheirSigmaOverManyPoints) {
  std::vector<double> z;
  slam::MappingCounts sum;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    use(slam::LandmarkMode::kVmp, 4000, 0.5);
    image_.seed = seed;
    WorldDraw draw(seed);
    std::vector<Corner> corners;
    for (std::uint32_t i = 0; i < 300; ++i) {
      const double depth_m = draw.log_uniform(10.0, 3000.0);
      corners.push_back(
          {10000 + i, depth_m * Vector3d(draw.uniform(-0.5, 0.5), draw.uniform(-0.4, 0.4), 1.0)});
    }
    std::vector<KeyframeHandle> keyframes;
    for (int i = 0; i < 10; ++i) {
      keyframes.push_back(look(1.0 * i, corners));
      std::vector<KeyframeHandle> before(keyframes.rbegin() + 1, keyframes.rend());
      maker_->process(keyframes.back(), before);
      maker_->evict_bearings(keyframes.back());
      expect_balance();
    }
    map_->landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
      PatchPayload payload;
      std::memcpy(&payload, l.patch.pixels.data(), sizeof(payload));
      if (l.state == LandmarkState::kBearing || payload.point < 10000) return;
      const Vector3d point = corners[payload.point - 10000].position;
      const double truth = 1.0 / (point - Vector3d(1.0 * payload.frame, 0, 0)).norm();
      z.push_back((l.inverse_depth - truth) / l.inverse_depth_sigma);
    });
    sum.vmp_made += counts_.vmp_made;
    sum.vmp_promoted += counts_.vmp_promoted;
    sum.vmp_rejected += counts_.vmp_rejected;
    sum.landmarks_made += counts_.landmarks_made;
  }
  EXPECT_GT(sum.landmarks_made, 1000U);
  EXPECT_GT(sum.vmp_promoted, 300U);
  double outside = 0, square = 0;
  for (const double v : z) outside += std::fabs(v) > 1.96 ? 1.0 : 0.0, square += std::min(v * v, 25.0);
  outside /= static_cast<double>(z.size()), square /= static_cast<double>(z.size());
  std::printf("normalised depth error: mean square %.3f, %.1f %% beyond 1.96 sigma, %zu points\n", square,
              100 * outside, z.size());
  // Never overconfident; nor so large that the sigma is of no use.
  EXPECT_LT(outside, 0.06);
  EXPECT_LT(square, 1.1);
  EXPECT_GT(square, 0.15);
}

}  // namespace
}  // namespace farpoint::sim
