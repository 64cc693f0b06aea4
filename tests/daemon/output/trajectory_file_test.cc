// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/trajectory_file.h"

#include "daemon/output/sound_frames.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace farpoint::daemon {
namespace {

namespace fs = std::filesystem;

class TrajectoryFile : public testing::Test {
 public:
  ~TrajectoryFile() override { fs::remove_all(folder_); }

 protected:
  TrajectoryFile()
      : folder_(fs::temp_directory_path() / ("farpoint_trajectory_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream in(path(name));
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  fs::path folder_;
};

TEST(TumLine, TimeIsExactAndOrderIsTheFormats) {
  const slam::SE3 T{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1.0, -2.0, 3.25}};
  EXPECT_EQ(tum_line(1'403'636'579'763'555, T),
            "1403636579.763555 1.000000000 -2.000000000 3.250000000 0.500000000 -0.500000000 0.500000000 "
            "0.500000000\n");
  EXPECT_TRUE(tum_line(0, T).starts_with("0.000000 "));
  EXPECT_TRUE(tum_line(-1'500'000, T).starts_with("-1.500000 "));
  EXPECT_TRUE(tum_line(-5, T).starts_with("-0.000005 "));
}

TEST(TrajectoryPath, FurtherMapsStandBesideTheFirst) {
  EXPECT_EQ(trajectory_path("/a/b.c/final.tum", 2), "/a/b.c/final.map2.tum");
  EXPECT_EQ(trajectory_path("final", 3), "final.map3");
}

TEST_F(TrajectoryFile, MapWithMostFramesFirstAndStaleFilesGo) {
  std::ofstream(path("t.map3.tum")) << "stale\n";
  std::ofstream(path("t.map4.tum")) << "stale\n";
  const slam::SE3 T{Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0}};
  const auto written =
      write_final_trajectories(path("t.tum"), {{5, {{1'000'000, T}, {2'000'000, T}}}, {6, {{3'000'000, T}}}},
                               std::vector<std::int64_t>{1'000'000, 3'000'000}, 2.0);
  EXPECT_EQ(written, (std::vector<std::string>{path("t.tum"), path("t.map2.tum")}));
  EXPECT_NE(content("t.tum").find("\n2.000000 2.000000000 4.000000000 6.000000000 "), std::string::npos);
  EXPECT_NE(content("t.map2.tum").find("\n3.000000 "), std::string::npos);
  EXPECT_FALSE(fs::exists(path("t.map3.tum")));
  EXPECT_FALSE(fs::exists(path("t.map4.tum")));
}

TEST_F(TrajectoryFile, FramesThatWereNeverSoundStandBeside) {
  std::ofstream(path("t.map2.unsound.tum")) << "stale\n";
  slam::MapTrajectory trajectory{5, {}};
  for (int i = 0; i < 20; ++i) trajectory.frames.push_back({i * 1'000'000, {}});
  const std::vector<std::int64_t> live{3'000'000, 4'000'000};
  EXPECT_EQ(write_final_trajectories(path("t.tum"), {trajectory}, live, 1.0),
            (std::vector<std::string>{path("t.tum"), path("t.unsound.tum")}));
  EXPECT_NE(content("t.tum").find("\n0.000000 "), std::string::npos);
  EXPECT_NE(content("t.tum").find("\n9.000000 "), std::string::npos);
  EXPECT_EQ(content("t.tum").find("\n10.000000 "), std::string::npos);
  EXPECT_EQ(content("t.unsound.tum").find("\n9.000000 "), std::string::npos);
  EXPECT_NE(content("t.unsound.tum").find("\n10.000000 "), std::string::npos);
  EXPECT_FALSE(fs::exists(path("t.map2.unsound.tum")));

  EXPECT_EQ(write_final_trajectories(path("t.tum"), {trajectory}, {}, 1.0).size(), 2U);
  EXPECT_NE(content("t.tum").find("no frame has a sound pose"), std::string::npos);
  trajectory.frames.resize(9);
  EXPECT_EQ(write_final_trajectories(path("t.tum"), {trajectory}, live, 1.0).size(), 1U);
  EXPECT_FALSE(fs::exists(path("t.unsound.tum")));
}

TEST(SoundFrames, WaitWithTheCameraAndLastForATime) {
  slam::MapTrajectory trajectory;
  for (int i = 0; i < 100; ++i) trajectory.frames.push_back({i * 1'000'000, {}});
  const std::vector<std::int64_t> live{80'000'000, 90'000'000};
  const std::vector<std::uint8_t> sound = sound_frames(trajectory, live);
  for (std::size_t i = 0; i < sound.size(); ++i) EXPECT_EQ(sound[i], i >= 20 && i <= 95 ? 1 : 0) << i;
}

TEST_F(TrajectoryFile, NoMapLeavesAFileThatSaysSo) {
  write_final_trajectories(path("t.tum"), {}, {}, 1.0);
  EXPECT_NE(content("t.tum").find("no frame has a pose"), std::string::npos);
}

TEST_F(TrajectoryFile, LiveHoldsValidFramesOnlyAndAppearsWhole) {
  LiveTrajectory live(path("live.tum"));
  FrameOutput frame;
  for (int i = 0; i < 4; ++i) {
    frame.result.utime = i * 1'000'000;
    frame.valid = i >= 2;
    live.on_frame(frame);
  }
  EXPECT_FALSE(fs::exists(path("live.tum")));
  live.close();
  EXPECT_EQ(content("live.tum"),
            "# seconds tx ty tz qx qy qz qw (T_map_body)\n"
            "2.000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n"
            "3.000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n");
}

TEST_F(TrajectoryFile, AFolderThatDoesNotExistIsRefused) {
  EXPECT_THROW(LiveTrajectory(path("nowhere/live.tum")), std::runtime_error);
}

}  // namespace
}  // namespace farpoint::daemon
