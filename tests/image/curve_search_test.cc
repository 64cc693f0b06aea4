// SPDX-License-Identifier: Apache-2.0
// Search along epipolar curves against exact truth: two cameras of other lenses, turned against each other,
// look at textured walls. And against a plain search of every pixel of the row, by OpenCV, where there is
// one.
#include "slam/image/curve_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "slam/image/extractor.h"
#include "slam/image/pyramid.h"
#include "tests/image/test_images.h"
#include "tests/support/walls.h"

namespace farpoint::slam {
namespace {

using testing::CameraPair;
using testing::crooked_pair;
using testing::OwnedImage;
using testing::photograph;
using testing::rectified_pair;
using testing::Walls;

// Both images of a pair, and the corners of the first with what the second shows of each.
class Scene {
 public:
  Scene(const CameraPair& pair, double shortest_wave)
      : pair_(pair),
        walls_(shortest_wave),
        host_image_(photograph(walls_, pair.host, SE3{}, 1)),
        target_image_(photograph(walls_, pair.target, pair.T_target_host.inverse(), 2)),
        host_(host_image_.width, host_image_.height, {}),
        target_(target_image_.width, target_image_.height, {}) {
    host_.build(host_image_.view());
    target_.build(target_image_.view());
    Extractor extractor(host_image_.width, host_image_.height, {}, {.features = 400});
    extractor.extract(host_, {}, &corners_);
  }

  [[nodiscard]] const FeatureSet& corners() const { return corners_; }
  [[nodiscard]] const OwnedImage& host_image() const { return host_image_; }
  [[nodiscard]] const OwnedImage& target_image() const { return target_image_; }
  [[nodiscard]] float scale(std::size_t corner) const { return host_.scale(corners_.features[corner].level); }

  // Where the target shows the corner; false where the other wall hides it or it is too near to an edge.
  [[nodiscard]] bool truth(std::size_t corner, Eigen::Vector2d* pixel) const {
    const Feature& f = corners_.features[corner];
    Eigen::Vector3d bearing;
    if (!pair_.host.unproject({f.u_px, f.v_px}, &bearing)) return false;
    const Walls::Hit hit = walls_.look(Eigen::Vector3d::Zero(), bearing);
    const Eigen::Vector3d in_target = pair_.T_target_host * hit.point;
    const SE3 T_host_target = pair_.T_target_host.inverse();
    const Walls::Hit back = walls_.look(T_host_target.t, hit.point - T_host_target.t);
    if (hit.wall == 0 || (back.point - hit.point).norm() > 1e-6) return false;
    return pair_.target.project(in_target, pixel) && pair_.target.in_image(*pixel, 12.0 * scale(corner));
  }

  // Search down to the depth of one metre.
  [[nodiscard]] CurveMatch find(std::size_t corner) const {
    const Feature& f = corners_.features[corner];
    Patch patch;
    CurveQuery query;
    if (!PyramidImage(&host_).extract_patch(corners_, corner, &patch)) return {};
    query.patch = &patch;
    if (!pair_.host.unproject({f.u_px, f.v_px}, &query.bearing, &query.d_bearing_d_pixel)) return {};
    query.level_scale = scale(corner);
    query.max_inverse_depth = 1.0;
    const PyramidImage image(&target_);
    return CurveSearch(pair_.target, pair_.T_target_host, image).find(query);
  }

 private:
  const CameraPair pair_;
  const Walls walls_;
  const OwnedImage host_image_, target_image_;
  Pyramid host_, target_;
  FeatureSet corners_;
};

struct Tally {
  int visible = 0, found = 0, wrong = 0, found_of_hidden = 0;
  double square_sigmas = 0, square_level_px = 0;

  [[nodiscard]] double rms_level_px() const { return std::sqrt(square_level_px / (2 * (found - wrong))); }
  [[nodiscard]] double rms_sigmas() const { return std::sqrt(square_sigmas / (2 * (found - wrong))); }
  void print() const {
    std::printf(
        "  %d of %d visible corners found, %d wrong, rms %.3f level px, %.2f sigmas; %d of hidden ones\n",
        found, visible, wrong, rms_level_px(), rms_sigmas(), found_of_hidden);
  }
};

Tally search_all(const Scene& scene) {
  Tally tally;
  for (std::size_t i = 0; i < scene.corners().features.size(); ++i) {
    Eigen::Vector2d truth;
    const CurveMatch match = scene.find(i);
    if (!scene.truth(i, &truth)) {
      tally.found_of_hidden += match.ok ? 1 : 0;
      continue;
    }
    ++tally.visible;
    if (!match.ok) continue;
    ++tally.found;
    const double error_px = (match.pixel.cast<double>() - truth).norm();
    if (error_px > 1.5 * double{scene.scale(i)}) {
      ++tally.wrong;
      continue;
    }
    tally.square_level_px += std::pow(error_px / double{scene.scale(i)}, 2);
    tally.square_sigmas += std::pow(error_px / double{match.sigma_px}, 2);
  }
  tally.print();
  return tally;
}

TEST(CurveSearch, MeasuresToATenthOfAPixelBetweenTurnedCamerasOfOtherLenses) {
  const Tally tally = search_all(Scene(crooked_pair(), 5.0));
  ASSERT_GT(tally.visible, 150);
  EXPECT_GT(tally.found, 0.85 * tally.visible);
  EXPECT_LE(tally.wrong, 0.01 * tally.found);
  EXPECT_LT(tally.rms_level_px(), 0.12);
  EXPECT_LT(tally.rms_sigmas(), 1.5);
}

TEST(CurveSearch, MeasuresAsWellInARectifiedPair) {
  const Tally tally = search_all(Scene(rectified_pair(), 5.0));
  ASSERT_GT(tally.visible, 150);
  EXPECT_GT(tally.found, 0.85 * tally.visible);
  EXPECT_LE(tally.wrong, 0.01 * tally.found);
  EXPECT_LT(tally.rms_level_px(), 0.12);
}

// Every pixel of the row and of its neighbours, at the corner's own level-0 pixels.
TEST(CurveSearch, AgreesWithOpenCvsSearchOfTheWholeRow) {
  const Scene scene(rectified_pair(), 5.0);
  const auto as_mat = [](const OwnedImage& image) {
    cv::Mat mat(image.height, image.width, CV_8U);
    std::copy(image.pixels.begin(), image.pixels.end(), mat.data);
    return mat;
  };
  const cv::Mat host = as_mat(scene.host_image()), target = as_mat(scene.target_image());
  constexpr int kHalf = 7, kMostDisparity = 160;
  int compared = 0, agree = 0;
  for (std::size_t i = 0; i < scene.corners().features.size(); ++i) {
    const Feature& f = scene.corners().features[i];
    const int x = static_cast<int>(f.u_px), y = static_cast<int>(f.v_px);
    Eigen::Vector2d truth;
    const CurveMatch match = scene.find(i);
    if (f.level != 0 || !match.ok || !scene.truth(i, &truth) || x < kMostDisparity + kHalf + 1 ||
        y < kHalf + 1 || x + kHalf + 2 > host.cols || y + kHalf + 2 > host.rows)
      continue;
    const cv::Rect patch(x - kHalf, y - kHalf, 2 * kHalf + 1, 2 * kHalf + 1);
    const cv::Rect row(patch.x - kMostDisparity, patch.y - 1, patch.width + kMostDisparity, patch.height + 2);
    cv::Mat correlation;
    cv::matchTemplate(target(row), host(patch), correlation, cv::TM_CCOEFF_NORMED);
    cv::Point best;
    cv::minMaxLoc(correlation, nullptr, nullptr, nullptr, &best);
    const Eigen::Vector2d of_opencv(row.x + best.x + kHalf, row.y + best.y + kHalf);
    ++compared;
    agree += (match.pixel.cast<double>() - of_opencv).norm() < 1.0 ? 1 : 0;
  }
  std::printf("  %d of %d agree\n", agree, compared);
  ASSERT_GT(compared, 50);
  EXPECT_GE(agree, 0.97 * compared);
}

// Posts one like the other: every place along the curve looks the same.
class Fence {
 public:
  explicit Fence(double period_px) : period_px_(period_px) {}
  [[nodiscard]] OwnedImage image(double shift_px, std::uint64_t seed) const {
    constexpr double kTwoPi = 6.283185307179586;
    return testing::render(
        480, 120,
        [&](double x, double y) {
          return 128 + 50 * std::sin(kTwoPi * (x + shift_px) / period_px_) +
                 40 * std::sin(kTwoPi * y / (1.3 * period_px_));
        },
        1.5, seed);
  }

 private:
  double period_px_;
};

// Two rectified cameras before a fence, and a place of it that the first shows at (300, 60), the second at
// (270, 60) and, to the eye, every 24 pixels.
class BesideAFence {
 public:
  BesideAFence() : host_(480, 120, {}), target_(480, 120, {}) {
    const Fence fence(24);
    host_.build(fence.image(0, 1).view());
    target_.build(fence.image(30, 2).view());
    FeatureSet set;
    set.features.push_back({.u_px = 300, .v_px = 60});
    set.descriptors.emplace_back();
    EXPECT_TRUE(PyramidImage(&host_).extract_patch(set, 0, &patch_));
    query_.patch = &patch_;
    EXPECT_TRUE(camera_.unproject({300, 60}, &query_.bearing, &query_.d_bearing_d_pixel));
  }
  [[nodiscard]] CurveMatch find(double min_inverse_depth, double max_inverse_depth,
                                const ImageMask* mask = nullptr) const {
    CurveQuery query = query_;
    query.min_inverse_depth = min_inverse_depth;
    query.max_inverse_depth = max_inverse_depth;
    const PyramidImage image(&target_, mask);
    return CurveSearch(camera_, SE3{Eigen::Quaterniond::Identity(), {-0.4, 0, 0}}, image).find(query);
  }

 private:
  const Camera camera_{[] {
    Camera::Parameters p;
    p.width_px = 480, p.height_px = 120;
    p.fx_px = p.fy_px = 400, p.cx_px = 240, p.cy_px = 60;
    return p;
  }()};
  Pyramid host_, target_;
  Patch patch_;
  CurveQuery query_;
};

TEST(CurveSearch, RefusesAPatchThatTwoPlacesLookLike) {
  const BesideAFence beside;
  EXPECT_FALSE(beside.find(0.0, 0.9).ok);
  // One post alone within reach: disparity 30 of 160 is at 0.1875.
  const CurveMatch match = beside.find(0.17, 0.20);
  ASSERT_TRUE(match.ok);
  EXPECT_NEAR(match.pixel.x(), 270.0F, 0.15F);
}

// Any one of the places that look alike, where a mask leaves it alone.
TEST(CurveSearch, PlacesUnderTheMaskAreNoRivals) {
  const BesideAFence beside;
  for (int place = 174; place <= 294; place += 24) {
    OwnedImage around_place(480, 120, 0);
    for (int y = 0; y < 120; ++y)
      for (int x = place - 12; x <= place + 12; ++x) around_place.at(x, y) = 255;
    const ImageMask mask(480, 120, around_place.pixels);
    const CurveMatch match = beside.find(0.0, 0.9, &mask);
    ASSERT_TRUE(match.ok) << place;
    EXPECT_NEAR(match.pixel.x(), static_cast<float>(place), 0.5F);
  }
}

TEST(CurveSearch, FindsNothingWhereTheOtherImageShowsSomethingElse) {
  const CameraPair pair = rectified_pair();
  const Walls walls(5.0);
  const OwnedImage host_image = photograph(walls, pair.host, SE3{}, 1);
  const OwnedImage other = testing::render(480, 360, testing::Texture(77, 5.0, 40), 1.5, 3);
  Pyramid host(480, 360, {}), target(480, 360, {});
  host.build(host_image.view());
  target.build(other.view());
  Extractor extractor(480, 360, {}, {.features = 400});
  FeatureSet corners;
  extractor.extract(host, {}, &corners);
  const PyramidImage image(&target);
  const CurveSearch search(pair.target, pair.T_target_host, image);
  int found = 0;
  for (std::size_t i = 0; i < corners.features.size(); ++i) {
    const Feature& f = corners.features[i];
    Patch patch;
    CurveQuery query;
    query.patch = &patch;
    query.max_inverse_depth = 1.0;
    query.level_scale = host.scale(f.level);
    if (!PyramidImage(&host).extract_patch(corners, i, &patch) ||
        !pair.host.unproject({f.u_px, f.v_px}, &query.bearing, &query.d_bearing_d_pixel))
      continue;
    found += search.find(query).ok ? 1 : 0;
  }
  std::printf("  %d of %zu found\n", found, corners.features.size());
  EXPECT_LE(found, 0.05 * static_cast<double>(corners.features.size()));
}

}  // namespace
}  // namespace farpoint::slam
