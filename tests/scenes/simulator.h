// SPDX-License-Identifier: Apache-2.0
// Turns a scene into the features that the image processing would have made, frame by frame, with the
// truth.
#pragma once

#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "slam/estimator.h"
#include "tests/scenes/scene.h"

namespace farpoint::sim {

// Content of a host patch, instead of pixels.
struct PatchPayload {
  std::uint32_t point = 0;     // id of the true point; kNothing and above: an outlier
  std::uint32_t frame = 0;     // in which the patch was cut: where the landmark is anchored
  float du_px = 0, dv_px = 0;  // corner as measured minus true projection
  std::uint32_t group = 0;
};
constexpr std::uint32_t kNothing = 0xE0000000U;

// The pixels of a simulated frame: holds the projection of every visible point, so that alignment measures
// what real alignment would have measured.
class SimImage final : public slam::FrameImage {
 public:
  struct Projection {
    std::uint32_t point = 0, group = 0;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  };
  struct Options {
    NoiseConfig noise;
    double scale_factor = 1.2;
    int levels = 8;
    int width_px = 0, height_px = 0;
    std::uint64_t seed = 0;
  };

  SimImage(const Options& options, std::uint32_t frame, std::vector<Projection> visible,
           std::vector<PatchPayload> features);
  ~SimImage() override;
  SimImage(const SimImage&) = delete;
  SimImage& operator=(const SimImage&) = delete;
  // Images in use.
  [[nodiscard]] static int alive();
  [[nodiscard]] bool extract_patch(const slam::FeatureSet& set, std::size_t index,
                                   slam::Patch* patch) const override;
  // True projection + A * (host corner's offset from its true projection) + noise. Not ok where the point is
  // hidden, out of reach, too much larger or smaller than in the host, or, now and then, for no reason.
  [[nodiscard]] slam::Alignment align(const slam::Patch& host, const Eigen::Matrix2f& A_target_host,
                                      const Eigen::Vector2f& predicted_px, float max_shift_px) const override;

 private:
  [[nodiscard]] const Projection* find(const PatchPayload& host, const Eigen::Vector2f& expected, float reach,
                                       bool alike) const;

  Options options_;
  std::uint32_t frame_;
  std::vector<Projection> visible_;                              // by point
  std::vector<std::pair<std::uint32_t, std::uint32_t>> groups_;  // (group, index in visible_), sorted
  std::vector<PatchPayload> features_;                           // one a feature
};

struct Sighted {
  slam::FeatureInput input;
  std::vector<std::uint32_t> points;  // one a feature: id of the true point; kNothing and above: an outlier
  slam::SE3 T_world_body;
  double travelled_m = 0;
};

// Which true point each feature of the frames so far shows.
class ShownPoints {
 public:
  void note(const Sighted& sighted);
  // Of the feature at this pixel of this frame; kNothing where there is none. A point goes before an outlier
  // at the same pixel.
  [[nodiscard]] std::uint32_t find(std::int64_t utime, const Eigen::Vector2d& pixel) const;

 private:
  struct Feature {
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
    std::uint32_t point = kNothing;
  };
  std::map<std::int64_t, std::vector<Feature>> frames_;
};

class Simulator {
 public:
  Simulator(const Scene& scene, std::uint64_t seed);

  // The next frame; they never end.
  [[nodiscard]] Sighted next();
  // Any frame from a pose of one's own, with the points around arc length s_m.
  [[nodiscard]] Sighted look(std::uint32_t frame, const slam::SE3& T_world_body, double s_m);
  [[nodiscard]] slam::SE3 truth(std::uint32_t frame);
  [[nodiscard]] std::int64_t utime(std::uint32_t frame) const;
  // True place of a point by its id.
  [[nodiscard]] Eigen::Vector3d position(std::uint32_t point);
  [[nodiscard]] std::size_t points_in_memory() const { return world_.points_in_memory(); }
  [[nodiscard]] const Scene& scene() const { return scene_; }

 private:
  struct Candidate {
    const WorldPoint* point = nullptr;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    int level = 0;
    float score = 0;
    int cell = 0;
  };
  [[nodiscard]] bool project(const WorldPoint& p, const slam::SE3& T_camera_world, Eigen::Vector2d* pixel,
                             double* level) const;
  [[nodiscard]] bool hidden(std::uint32_t point, double t_s) const;
  void choose(std::vector<Candidate>* candidates) const;

  Scene scene_;
  std::uint64_t seed_;
  slam::Rig rig_;
  MotionModel motion_;
  World world_;
  SimImage::Options image_;
  std::uint32_t frame_ = 0;
  std::unordered_map<std::uint32_t, Eigen::Vector3d> positions_;  // cache of position()
};

}  // namespace farpoint::sim
