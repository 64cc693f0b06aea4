// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "tests/support/tracking_scene.h"

namespace farpoint::slam {
namespace {

using test::SceneFrame;
using test::ScenePoint;
using test::TrackingScene;

class MatcherTest : public testing::Test {
 protected:
  // Shows the scene from a pose and projects a subset from there.
  void look(const SE3& T_world_body, LandmarkSubset subset = LandmarkSubset::kAll) {
    shown = scene.look(T_world_body, 0);
    matcher.set_view(scene.view());
    mark_seen();
    matcher.begin(*shown.frame);
    matcher.project(*shown.frame, T_world_body, subset);
  }
  void mark_seen() {
    std::vector<LandmarkHandle> handles;
    for (const std::size_t i : seen) handles.push_back(scene.points[i].handle);
    matcher.mark_seen(handles);
  }
  [[nodiscard]] std::set<std::size_t> candidates() const {
    std::set<std::size_t> out;
    for (const MatchCandidate& c : matcher.candidates()) out.insert(c.view_index);
    return out;
  }
  [[nodiscard]] const Match* match_of(std::size_t point) const {
    const auto m = std::find_if(matcher.matches().begin(), matcher.matches().end(),
                                [&](const Match& match) { return match.view_index == point; });
    return m != matcher.matches().end() ? &*m : nullptr;
  }
  // A second landmark that looks like `point` and stands at its place.
  std::size_t add_twin(std::size_t point) {
    ScenePoint twin = scene.points[point];
    twin.handle.index = 3001;
    twin.visible = false;
    scene.points.push_back(twin);
    return scene.points.size() - 1;
  }

  TrackingScene scene{200};
  Matcher matcher{scene.config};
  SceneFrame shown;
  std::vector<std::size_t> seen;
  const SE3 ahead = TrackingScene::pose({0.5, -0.1, 0.05}, {0.01, -0.01, 0.02});
};

// --- project
// -------------------------------------------------------------------------------------------------------

TEST_F(MatcherTest, ProjectsTheSubsetAskedFor) {
  seen = {3, 50, 120};
  scene.points[50].in_reference = scene.points[77].in_reference = true;
  look(SE3{}, LandmarkSubset::kSeen);
  EXPECT_EQ(candidates(), (std::set<std::size_t>{3, 50, 120}));
  matcher.project(*shown.frame, SE3{}, LandmarkSubset::kRecent);
  EXPECT_EQ(candidates(), (std::set<std::size_t>{3, 50, 77, 120}));
  matcher.project(*shown.frame, SE3{}, LandmarkSubset::kAll);
  EXPECT_EQ(candidates().size(), scene.points.size());
}

TEST_F(MatcherTest, SeenLandmarksAreFoundByTheirHandleInAnotherView) {
  seen = {3, 50};
  look(SE3{}, LandmarkSubset::kSeen);
  // Fewer landmarks in another order; the slot of one of them holds another landmark now.
  std::reverse(scene.points.begin(), scene.points.end());
  std::vector<LandmarkHandle> handles{scene.points[196].handle, scene.points[149].handle};
  scene.points[149].handle.generation += 1;
  scene.points.resize(197);
  matcher.set_view(scene.view());
  handles.push_back({4, 1});  // in no view
  matcher.mark_seen(handles);
  matcher.project(*shown.frame, SE3{}, LandmarkSubset::kSeen);
  EXPECT_EQ(candidates(), (std::set<std::size_t>{196}));
}

TEST_F(MatcherTest, ANewViewHasNothingSeen) {
  seen = {3, 50};
  look(SE3{}, LandmarkSubset::kSeen);
  matcher.set_view(scene.view());
  matcher.project(*shown.frame, SE3{}, LandmarkSubset::kSeen);
  EXPECT_TRUE(matcher.candidates().empty());
}

TEST_F(MatcherTest, LeavesOutWhatIsPredictedIntoTheMask) {
  std::vector<std::uint8_t> pixels(640 * 480, 255);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (i % 640 < 300) pixels[i] = 0;
  scene.rig.cameras[0].mask = std::make_shared<const ImageMask>(640, 480, pixels);
  look(SE3{});
  std::set<std::size_t> expected;
  const SE3 T_camera_world = scene.rig.cameras[0].T_body_camera.inverse();
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    Eigen::Vector2d pixel;
    ASSERT_TRUE(scene.rig.cameras[0].camera.project(T_camera_world * scene.points[i].position_w, &pixel));
    if (pixel.x() > 304.0) expected.insert(i);
  }
  EXPECT_EQ(candidates(), expected);
  EXPECT_GT(expected.size(), 50U);
  EXPECT_LT(expected.size(), 150U);
}

TEST_F(MatcherTest, LeavesOutWhatCannotBeMatchedThere) {
  const std::size_t beside = scene.points.size();
  scene.add_point({330, 225}, 8.0);
  look(SE3{});
  EXPECT_EQ(candidates().count(beside), 1U);
  // The camera goes round the point by 70 degrees and looks at it from the same distance.
  const double angle_rad = 70 * M_PI / 180;
  const Eigen::Vector3d point = scene.points[beside].position_w;
  const SE3 turn{so3_exp({0, 0, angle_rad}), point - so3_exp({0, 0, angle_rad}) * point};
  matcher.project(*shown.frame, turn, LandmarkSubset::kAll);
  EXPECT_EQ(candidates().count(beside), 0U);
  // Four times as near it has four times the size.
  matcher.project(*shown.frame, TrackingScene::pose({6.0, 0, 0}), LandmarkSubset::kAll);
  EXPECT_EQ(candidates().count(beside), 0U);
}

TEST_F(MatcherTest, ExpectsCornersOnTheLevelOfTheirSize) {
  scene.add_point({330, 225}, 8.0).host_level = 2;
  look(TrackingScene::pose({8.0 * (1 - 1 / 1.44), 0, 0}));  // 1.2^2 times as large
  ASSERT_EQ(candidates().count(200), 1U);
  for (const MatchCandidate& c : matcher.candidates())
    if (c.view_index == 200) {
      EXPECT_EQ(c.level, 4);
    }
}

// --- match
// ---------------------------------------------------------------------------------------------------------

TEST_F(MatcherTest, MatchesEachLandmarkWithTheFeatureThatShowsIt) {
  look(ahead);
  const int found = matcher.match(*shown.frame, 4.0, 0.9F);
  EXPECT_EQ(found, static_cast<int>(matcher.matches().size()));
  EXPECT_EQ(found, static_cast<int>(matcher.candidates().size()));
  EXPECT_GT(found, 170);
  for (const Match& m : matcher.matches()) {
    const auto f = static_cast<std::size_t>(m.feature);
    ASSERT_EQ(shown.point_of_feature[f], static_cast<int>(m.view_index));
    const Feature& feature = shown.frame->views[0].set.features[f];
    EXPECT_EQ(m.pixel, Eigen::Vector2f(feature.u_px, feature.v_px));
    EXPECT_FLOAT_EQ(m.sigma_px, std::pow(1.2F, static_cast<float>(feature.level)));
    EXPECT_TRUE(m.inlier);
    EXPECT_FALSE(m.aligned);
  }
}

TEST_F(MatcherTest, TheWindowGrowsWithTheLevel) {
  // 6 px: beyond 4 px of level 2 (5.8 px), within those of level 3 (6.9 px).
  for (ScenePoint& p : scene.points) p.corner_offset_px = {-6.0, 0.0};
  look(SE3{});
  matcher.match(*shown.frame, 4.0, 0.9F);
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    if (shown.feature_of_point[i] >= 0) {
      EXPECT_EQ(match_of(i) != nullptr, scene.points[i].host_level >= 3) << i;
    }
}

TEST_F(MatcherTest, TheWindowGrowsWithTheSigmaOfTheDepthUpToTwentyPixels) {
  // Half a unit to the side a point 5 units away moves by 420 px * 0.5 * sigma with its inverse depth.
  const SE3 side = TrackingScene::pose({0, 0.5, 0});
  for (ScenePoint& p : scene.points) p.host_level = 0;
  for (const double sigma : {0.0, 0.02, 10.0}) scene.add_point({330, 225}, 5.0).inverse_depth_sigma = sigma;
  const auto matched = [&](double offset_px) {
    for (ScenePoint& p : scene.points) p.corner_offset_px = {offset_px, 0.0}, p.host_level = 0;
    look(side);
    matcher.match(*shown.frame, 4.0, 1.0F);
    return std::vector<bool>{match_of(200) != nullptr, match_of(201) != nullptr, match_of(202) != nullptr};
  };
  EXPECT_EQ(matched(3.0), (std::vector<bool>{true, true, true}));
  EXPECT_EQ(matched(11.0), (std::vector<bool>{false, true, true}));  // 4 + 2 * 4.2
  EXPECT_EQ(matched(23.0), (std::vector<bool>{false, false, true}));
  EXPECT_EQ(matched(25.0), (std::vector<bool>{false, false, false}));
}

TEST_F(MatcherTest, AFeatureBelongsToOneLandmark) {
  const std::size_t twin = add_twin(60);
  look(SE3{});
  matcher.match(*shown.frame, 4.0, 0.9F);
  EXPECT_NE(match_of(60), nullptr);
  EXPECT_EQ(match_of(twin), nullptr);
}

TEST_F(MatcherTest, ALandmarkHasOneFeatureAndASecondSearchKeepsIt) {
  look(SE3{});
  const int first = matcher.match(*shown.frame, 4.0, 0.9F);
  EXPECT_EQ(matcher.match(*shown.frame, 8.0, 0.9F), 0);
  EXPECT_EQ(static_cast<int>(matcher.matches().size()), first);
}

TEST_F(MatcherTest, AFeatureIsAddedOnce) {
  look(SE3{});
  matcher.add(*shown.frame, 5, 0, shown.feature_of_point[5]);
  matcher.add(*shown.frame, 6, 0, shown.feature_of_point[5]);
  ASSERT_EQ(matcher.matches().size(), 1U);
  EXPECT_EQ(matcher.matches()[0].view_index, 5U);
  matcher.match(*shown.frame, 4.0, 0.9F);
  EXPECT_EQ(std::count_if(matcher.matches().begin(), matcher.matches().end(),
                          [](const Match& m) { return m.view_index == 5; }),
            1);
}

TEST_F(MatcherTest, BeginFreesAllFeatures) {
  look(SE3{});
  const int first = matcher.match(*shown.frame, 4.0, 0.9F);
  matcher.begin(*shown.frame);
  EXPECT_TRUE(matcher.matches().empty());
  EXPECT_EQ(matcher.match(*shown.frame, 4.0, 0.9F), first);
}

// --- align
// ---------------------------------------------------------------------------------------------------------

TEST_F(MatcherTest, AlignmentReplacesTheCornerByTheMeasurement) {
  for (ScenePoint& p : scene.points) p.corner_offset_px = {1.0, -0.5};
  look(ahead);
  matcher.match(*shown.frame, 4.0, 0.9F);
  const std::vector<Match> before = matcher.matches();
  matcher.align(*shown.frame);
  ASSERT_EQ(matcher.matches().size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Match& m = matcher.matches()[i];
    EXPECT_TRUE(m.aligned);
    EXPECT_EQ(m.view_index, before[i].view_index);
    EXPECT_LT((m.pixel - (before[i].pixel - Eigen::Vector2f(1.0F, -0.5F))).norm(), 1e-3F);
    EXPECT_FLOAT_EQ(m.sigma_px, std::hypot(0.1F, 0.5F));
  }
}

TEST_F(MatcherTest, AlignmentMovesTwoPixelsOfTheCornersLevelAtMost) {
  for (ScenePoint& p : scene.points) p.corner_offset_px = {3.0, 0.0};  // level 3: 3.46 px
  look(SE3{});
  matcher.match(*shown.frame, 4.0, 0.9F);
  matcher.align(*shown.frame);
  EXPECT_GT(matcher.matches().size(), 30U);
  for (const Match& m : matcher.matches()) EXPECT_EQ(scene.points[m.view_index].host_level, 3);
}

TEST_F(MatcherTest, AFailedAlignmentFreesItsFeatureAndNoOther) {
  scene.points[60].aligns = false;
  const std::size_t twin_of_lost = add_twin(60), twin_of_kept = add_twin(61);
  scene.points[twin_of_kept].handle.index = 3003;
  seen = {twin_of_lost, twin_of_kept};
  look(SE3{});
  matcher.match(*shown.frame, 4.0, 0.9F);
  const std::size_t matches = matcher.matches().size();
  matcher.align(*shown.frame);
  EXPECT_EQ(matcher.matches().size(), matches - 1);
  EXPECT_EQ(match_of(60), nullptr);
  matcher.project(*shown.frame, SE3{}, LandmarkSubset::kSeen);
  matcher.match(*shown.frame, 4.0, 0.9F);
  ASSERT_NE(match_of(twin_of_lost), nullptr);
  EXPECT_EQ(match_of(twin_of_lost)->feature, shown.feature_of_point[60]);
  EXPECT_EQ(match_of(twin_of_kept), nullptr);
}

TEST_F(MatcherTest, AMatchThatIsNoCandidateIsNotKept) {
  look(SE3{});
  matcher.match(*shown.frame, 4.0, 0.9F);
  seen = {10, 11};
  mark_seen();
  matcher.project(*shown.frame, SE3{}, LandmarkSubset::kSeen);
  matcher.align(*shown.frame);
  EXPECT_EQ(matcher.matches().size(), 2U);
}

TEST_F(MatcherTest, WithoutPixelsTheCornersStay) {
  look(SE3{});
  matcher.match(*shown.frame, 4.0, 0.9F);
  const std::size_t matches = matcher.matches().size();
  shown.frame->drop_pixels();
  matcher.align(*shown.frame);
  EXPECT_EQ(matcher.matches().size(), matches);
  EXPECT_FALSE(matcher.matches()[0].aligned);
}

// --- outliers
// ------------------------------------------------------------------------------------------------------

TEST_F(MatcherTest, DroppedOutliersFreeTheirFeaturesAndInliersDoNot) {
  const std::size_t twin_of_outlier = add_twin(60), twin_of_inlier = add_twin(61);
  scene.points[twin_of_inlier].handle.index = 3003;
  seen = {twin_of_outlier, twin_of_inlier};
  look(SE3{});
  matcher.match(*shown.frame, 4.0, 0.9F);
  const std::size_t matches = matcher.matches().size();
  for (std::size_t i = 0; i < matches; ++i) matcher.set_inlier(i, matcher.matches()[i].view_index != 60);
  matcher.drop_outliers();
  EXPECT_EQ(matcher.matches().size(), matches - 1);
  EXPECT_EQ(match_of(60), nullptr);
  matcher.project(*shown.frame, SE3{}, LandmarkSubset::kSeen);
  matcher.match(*shown.frame, 4.0, 0.9F);
  EXPECT_NE(match_of(twin_of_outlier), nullptr);
  EXPECT_EQ(match_of(twin_of_inlier), nullptr);
}

}  // namespace
}  // namespace farpoint::slam
