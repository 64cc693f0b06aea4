// The renderer's truth against its pictures: a point of one frame, put into space by the true depth and seen
// from the next frame's true pose, must lie on the same texture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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

constexpr int kRadius = 5;

// How far the patch around a pixel of `from` lies, in `to`, from where the truth puts it: least squares over
// a shift, a gain and an offset. Empty where there is no plane, moving or hidden surface, or too little
// texture.
std::optional<Eigen::Vector2d> misplacement(Simulation* simulation, const View& from, const View& to,
                                            int column, int row) {
  std::vector<Eigen::Vector2d> pixels;
  for (int y = -kRadius; y <= kRadius; ++y) {
    for (int x = -kRadius; x <= kRadius; ++x) pixels.emplace_back(column + x, row + y);
  }
  const std::vector<SeenPoint> seen = simulation->look(from.frame, 0, pixels);
  std::vector<Eigen::Vector2d> expected;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const SeenPoint& s = seen[i];
    if (!std::isfinite(s.distance_m) || s.is_moving || s.farthest_m > 1.1 * s.nearest_m) return std::nullopt;
    Eigen::Vector3d ray;
    Eigen::Vector2d there;
    if (!from.camera().unproject(pixels[i], &ray)) return std::nullopt;
    const Eigen::Vector3d point = from.pose(pixels[i].y()) * (s.distance_m * ray);
    if (!project(to, point, &there) || !to.camera().in_image(there, 12.0)) return std::nullopt;
    expected.push_back(there);
  }
  // Seen there too, and not hidden by something nearer.
  const SeenPoint there = simulation->look(to.frame, 0, {expected[expected.size() / 2]})[0];
  const Eigen::Vector2d& middle = pixels[pixels.size() / 2];
  Eigen::Vector3d ray;
  (void)from.camera().unproject(middle, &ray);
  const Eigen::Vector3d point = from.pose(middle.y()) * (seen[seen.size() / 2].distance_m * ray);
  const double distance = (point - to.pose(expected[expected.size() / 2].y()).t).norm();
  if (there.is_moving || std::abs(there.nearest_m - distance) > 0.05 * distance ||
      there.farthest_m > 1.1 * there.nearest_m)
    return std::nullopt;

  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (int round = 0; round < 8; ++round) {
    Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Eigen::Vector2d p = expected[i] + shift;
      const double value = to.sample(p),
                   reference = from.at(static_cast<int>(pixels[i].x()), static_cast<int>(pixels[i].y()));
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
    if (weakest < 40.0 * static_cast<double>(pixels.size())) return std::nullopt;
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
  for (int row = 16; row < c.height_px - 16; row += 9) {
    for (int column = 16; column < c.width_px - 16; column += 9) {
      const std::optional<Eigen::Vector2d> shift = misplacement(&simulation, from, to, column, row);
      if (!shift) continue;
      errors_px.push_back(shift->norm());
      x_px.push_back(shift->x());
      y_px.push_back(shift->y());
    }
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
    testing::Values(Case{"Town", "town", 620, 188, 60, {}}, Case{"TownInABend", "town", 620, 188, 310, {}},
                    Case{"Highway", "highway", 620, 188, 120, {}},
                    Case{"ValleyRadtan", "valley", 480, 270, 90, {}},
                    Case{"HoverRadtan", "hover", 376, 240, 600, {}},
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
