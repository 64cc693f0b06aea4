// SPDX-License-Identifier: Apache-2.0
// The renderer's truth against its pictures: a point of one frame, put into space by the true depth and seen
// from the next frame's true pose, must lie on the same texture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "tests/simulate/small_worlds.h"
#include "tools/evaluate/statistics.h"

namespace farpoint::tools::simulate {
namespace {

struct View {
  const Simulation& simulation;
  std::int64_t frame;
  const std::vector<std::uint8_t>& grey;

  [[nodiscard]] const slam::Camera& camera() const { return simulation.camera(0); }
  // Pose of the camera when the row was exposed.
  [[nodiscard]] slam::SE3 pose(double row) const {
    const double offset_s = simulation.row_time_s() * (row - 0.5 * (camera().height_px() - 1));
    return simulation.body().pose_at(simulation.frame_time_s(frame) + offset_s) * simulation.T_body_camera(0);
  }
  [[nodiscard]] double at(int x, int y) const {
    return grey[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera().width_px()) +
                static_cast<std::size_t>(x)];
  }
  [[nodiscard]] double sample(const Eigen::Vector2d& p) const {
    const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
    const double a = p.x() - x, b = p.y() - y;
    return (1 - b) * ((1 - a) * at(x, y) + a * at(x + 1, y)) +
           b * ((1 - a) * at(x, y + 1) + a * at(x + 1, y + 1));
  }
};

// Where a point in the world is seen, with the pose of the row it falls on.
bool project(const View& view, const Eigen::Vector3d& point_w, Eigen::Vector2d* pixel) {
  double row = 0.5 * view.camera().height_px();
  for (int i = 0; i < 4; ++i) {
    if (!view.camera().project(view.pose(row).inverse() * point_w, pixel)) return false;
    row = pixel->y();
  }
  return true;
}

constexpr int kRadius = 5, kSide = 2 * kRadius + 1, kPatchPixels = kSide * kSide;
// Mean square gradient of a patch along its weaker direction, (grey levels a pixel)^2.
constexpr double kWeakestTexture = 25.0;

// A patch around a pixel of `from`, and where in `to` the truth puts each of its pixels.
struct Patch {
  std::vector<Eigen::Vector2d> here, there;
  Eigen::Vector3d middle_w;  // the point that its middle looks at
};

std::vector<Eigen::Vector2d> patch_pixels(int column, int row) {
  std::vector<Eigen::Vector2d> pixels;
  for (int y = -kRadius; y <= kRadius; ++y) {
    for (int x = -kRadius; x <= kRadius; ++x) pixels.emplace_back(column + x, row + y);
  }
  return pixels;
}

// Nothing where there is no plane, or a moving surface, or where `to` does not see it.
std::optional<Patch> carried_over(const View& from, const View& to, const std::vector<Eigen::Vector2d>& here,
                                  std::span<const SeenPoint> seen) {
  Patch patch;
  patch.here = here;
  for (std::size_t i = 0; i < here.size(); ++i) {
    const SeenPoint& s = seen[i];
    if (!std::isfinite(s.distance_m) || s.is_moving || s.farthest_m > 1.1 * s.nearest_m) return std::nullopt;
    Eigen::Vector3d ray;
    Eigen::Vector2d there;
    if (!from.camera().unproject(here[i], &ray)) return std::nullopt;
    const Eigen::Vector3d point = from.pose(here[i].y()) * (s.distance_m * ray);
    if (!project(to, point, &there) || !to.camera().in_image(there, 12.0)) return std::nullopt;
    patch.there.push_back(there);
    if (i == here.size() / 2) patch.middle_w = point;
  }
  return patch;
}

// Hidden by something nearer, moving, or at an outline in `to`.
bool is_hidden(const View& to, const Patch& patch, const SeenPoint& seen) {
  const Eigen::Vector2d& middle = patch.there[patch.there.size() / 2];
  const double distance = (patch.middle_w - to.pose(middle.y()).t).norm();
  return seen.is_moving || std::abs(seen.nearest_m - distance) > 0.05 * distance ||
         seen.farthest_m > 1.1 * seen.nearest_m;
}

// The patches of a grid over the picture that both frames see.
std::vector<Patch> find_patches(Simulation* simulation, const View& from, const View& to) {
  constexpr int kMargin_px = 16, kStep_px = 6;
  std::vector<std::vector<Eigen::Vector2d>> grid;
  std::vector<Eigen::Vector2d> all, middles;
  for (int row = kMargin_px; row < from.camera().height_px() - kMargin_px; row += kStep_px) {
    for (int column = kMargin_px; column < from.camera().width_px() - kMargin_px; column += kStep_px) {
      grid.push_back(patch_pixels(column, row));
      all.insert(all.end(), grid.back().begin(), grid.back().end());
    }
  }
  const std::vector<SeenPoint> seen = simulation->look(from.frame, 0, all);
  std::vector<Patch> patches;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const auto first = seen.begin() + static_cast<std::ptrdiff_t>(i * kPatchPixels);
    if (auto patch = carried_over(from, to, grid[i], {first, first + kPatchPixels})) {
      patches.push_back(std::move(*patch));
      middles.push_back(patches.back().there[kPatchPixels / 2]);
    }
  }
  const std::vector<SeenPoint> there = simulation->look(to.frame, 0, middles);
  std::vector<Patch> visible;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!is_hidden(to, patches[i], there[i])) visible.push_back(std::move(patches[i]));
  }
  return visible;
}

// How far a patch lies, in `to`, from where the truth puts it: least squares over a shift, a gain and an
// offset. Empty where it has too little texture.
std::optional<Eigen::Vector2d> misplacement(const View& from, const View& to, const Patch& patch) {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (int round = 0; round < 8; ++round) {
    Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i < patch.here.size(); ++i) {
      const Eigen::Vector2d p = patch.there[i] + shift;
      const double value = to.sample(p), reference = from.at(static_cast<int>(patch.here[i].x()),
                                                             static_cast<int>(patch.here[i].y()));
      const double dx = 0.5 * (to.sample(p + Eigen::Vector2d(1, 0)) - to.sample(p - Eigen::Vector2d(1, 0)));
      const double dy = 0.5 * (to.sample(p + Eigen::Vector2d(0, 1)) - to.sample(p - Eigen::Vector2d(0, 1)));
      const Eigen::Vector4d j(dx, dy, -reference / 100.0, -1.0);
      H += j * j.transpose();
      g += j * (value - reference);
    }
    // Texture in both directions: an edge alone does not say where along it a patch lies.
    const Eigen::Matrix2d texture = H.topLeftCorner<2, 2>();
    const double weakest =
        0.5 * (texture.trace() - std::hypot(texture(0, 0) - texture(1, 1), 2 * texture(0, 1)));
    if (weakest < kWeakestTexture * kPatchPixels) return std::nullopt;
    const Eigen::Vector4d step = H.ldlt().solve(-g);
    shift += step.head<2>();
    if (shift.norm() > 4.0) return shift;
  }
  return shift;
}

struct Case {
  std::string name, world;
  int width_px, height_px;
  std::int64_t frame;
  std::vector<Change> changes;
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class TruthOf : public testing::TestWithParam<Case> {};

TEST_P(TruthOf, DepthAndPoseLandOnTheSameTexture) {
  const Case& c = GetParam();
  std::vector<Change> changes = c.changes;
  if (c.world != "yard" && c.world != "hover") changes.push_back({"", kCleanSensor});
  Simulation simulation(request_for(c.world, c.width_px, c.height_px, 60.0, changes));
  SimulatedImage first, second;
  simulation.take_image(0, 0, &first);  // sets the exposure
  simulation.take_image(c.frame, 0, &first);
  simulation.take_image(c.frame + 1, 0, &second);
  const View from{simulation, c.frame, first.grey}, to{simulation, c.frame + 1, second.grey};
  std::vector<double> errors_px, x_px, y_px;
  for (const Patch& patch : find_patches(&simulation, from, to)) {
    const std::optional<Eigen::Vector2d> shift = misplacement(from, to, patch);
    if (!shift) continue;
    errors_px.push_back(shift->norm());
    x_px.push_back(shift->x());
    y_px.push_back(shift->y());
  }
  ASSERT_GE(errors_px.size(), 40U);
  const double median = percentile(errors_px, 50.0), high = percentile(errors_px, 90.0);
  const double bias = std::hypot(percentile(x_px, 50.0), percentile(y_px, 50.0));
  RecordProperty("patches", static_cast<int>(errors_px.size()));
  std::printf("[          ] %s: %zu patches, shift median %.3f px, p90 %.3f px, bias %.3f px\n",
              c.name.c_str(), errors_px.size(), median, high, bias);
  EXPECT_LT(median, 0.10);
  EXPECT_LT(high, 0.40);
  EXPECT_LT(bias, 0.03);
}

INSTANTIATE_TEST_SUITE_P(
    Worlds, TruthOf,
    testing::Values(
        Case{"Town", "town", 620, 188, 60, {}}, Case{"TownInABend", "town", 620, 188, 310, {}},
        Case{"Highway", "highway", 1241, 376, 60, {}}, Case{"ValleyRadtan", "valley", 480, 270, 90, {}},
        Case{"HoverRadtan", "hover", 752, 480, 600, {{"sensor: {exposure_s: 0.003}\n", kCleanSensor}}},
        Case{"YardFisheye", "yard", 424, 240, 200, {{"jump_every_s: 12", "jump_every_s: 0"}}},
        Case{"TownRollingShutter",
             "town",
             620,
             188,
             310,
             {{"  rate_hz: 10\n", "  rate_hz: 10\n  row_time_s: 5.0e-5\n"}}}),
    [](const testing::TestParamInfo<Case>& info) { return info.param.name; });

TEST(Truth, IsTheSameAfterReopeningFromTheLogsMessage) {
  Simulation first(request_for("town", 310, 94, 10.0));
  Simulation again(Simulation::request_of(first.message()));
  std::vector<Eigen::Vector2d> pixels;
  for (int x = 5; x < 300; x += 7) pixels.emplace_back(x + 0.3, 60.0);
  const std::vector<SeenPoint> a = first.look(50, 0, pixels), b = again.look(50, 0, pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_EQ(a[i].distance_m, b[i].distance_m);
}

TEST(Truth, OfAnotherSimulatorVersionIsRefused) {
  simulation_t message{};
  message.version = kSimulatorVersion + 1;
  EXPECT_THROW((void)Simulation::request_of(message), std::runtime_error);
}

}  // namespace
}  // namespace farpoint::tools::simulate
