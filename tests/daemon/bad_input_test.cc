// SPDX-License-Identifier: Apache-2.0
// Damaged input: what is intact is still delivered and counted, and what is then called
// valid is right. The camera of the synthetic log moves evenly along a line and does not turn, so that a pose
// is right when it lies where the others of its map say.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "daemon/config/config.h"
#include "tests/daemon/run_daemon.h"
#include "tests/daemon/synthetic_log.h"

namespace farpoint::daemon {
namespace {

using test::messages_of;
using test::Outcome;
using test::run_daemon;
using test::SyntheticLog;

using Bytes = std::vector<std::uint8_t>;
using Times = std::set<std::int64_t>;

constexpr double kDegree = std::numbers::pi / 180.0;

// What one replay gave.
struct Replayed {
  Outcome outcome;
  std::vector<pose_t> poses;
  std::vector<status_t> status;
  std::vector<summary_t> summaries;

  [[nodiscard]] Times delivered() const {
    Times times;
    for (const pose_t& p : poses) times.insert(p.utime);
    return times;
  }
  [[nodiscard]] const pose_t& at(std::int64_t utime) const {
    const auto p =
        std::find_if(poses.begin(), poses.end(), [&](const pose_t& q) { return q.utime == utime; });
    if (p == poses.end()) throw std::out_of_range("no pose at " + std::to_string(utime));
    return *p;
  }
  [[nodiscard]] long valid_from(std::int64_t utime) const {
    return std::count_if(poses.begin(), poses.end(),
                         [&](const pose_t& p) { return p.utime >= utime && p.valid != 0; });
  }
};

Replayed replay(const std::string& log, const std::string& output, std::vector<std::string> more = {}) {
  Replayed r;
  std::filesystem::remove(output);
  std::vector<std::string> arguments{
      "--replay", log, "--lockstep", "--output", output, "--set", "lcm.status_rate_hz=1000"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  r.outcome = run_daemon(arguments);
  if (!std::filesystem::exists(output)) return r;
  r.poses = messages_of<pose_t>(output, "FARPOINT_POSE");
  r.status = messages_of<status_t>(output, "FARPOINT_STATUS");
  r.summaries = messages_of<summary_t>(output, "FARPOINT_SUMMARY");
  return r;
}

// The valid poses of a map, but those at times that were damaged themselves, lie evenly on one line, and none
// is turned. Returns how many were judged.
int expect_right(const std::vector<pose_t>& poses, const Times& damaged_times = {}) {
  std::map<std::int32_t, std::vector<const pose_t*>> maps;
  for (const pose_t& p : poses)
    if (p.valid != 0 && !damaged_times.contains(p.utime)) maps[p.map_id].push_back(&p);
  int judged = 0;
  for (const auto& [id, of_map] : maps) {
    if (of_map.size() < 3) continue;
    // Least squares of position = a + b t, about the middle.
    double t_mean = 0.0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), slope = Eigen::Vector3d::Zero();
    for (const pose_t* p : of_map)
      t_mean += 1e-6 * static_cast<double>(p->utime) / static_cast<double>(of_map.size());
    for (const pose_t* p : of_map)
      mean += Eigen::Map<const Eigen::Vector3d>(p->position) / static_cast<double>(of_map.size());
    double spread = 0.0;
    for (const pose_t* p : of_map) {
      const double t = 1e-6 * static_cast<double>(p->utime) - t_mean;
      slope += t * (Eigen::Map<const Eigen::Vector3d>(p->position) - mean);
      spread += t * t;
    }
    slope /= spread;
    // A step is what the camera moves in one of its periods. Undamaged, the farthest lie 0.2 steps off.
    const double step = 0.1 * slope.norm();
    for (const pose_t* p : of_map) {
      const Eigen::Vector3d line = mean + (1e-6 * static_cast<double>(p->utime) - t_mean) * slope;
      const double off = (Eigen::Map<const Eigen::Vector3d>(p->position) - line).norm() / step;
      const double turned_deg = 2.0 * std::acos(std::min(1.0, std::abs(p->orientation[0]))) / kDegree;
      EXPECT_LE(off, 0.5) << "steps, map " << id << " at " << p->utime;
      EXPECT_LE(turned_deg, 0.3) << "map " << id << " at " << p->utime;
      ++judged;
    }
  }
  return judged;
}

void expect_finite(const std::vector<pose_t>& poses) {
  for (const pose_t& p : poses) {
    if (p.valid == 0) continue;
    for (const double v : p.position) EXPECT_TRUE(std::isfinite(v)) << p.utime;
    for (const double v : p.orientation) EXPECT_TRUE(std::isfinite(v)) << p.utime;
  }
}

// ---- one case after the other ----

class BadInput : public testing::Test {
 protected:
  static constexpr int kFrames = 60;
  static constexpr std::int64_t kStart_us = 1'000'000, kPeriod_us = 100'000;
  static std::int64_t time_of(int frame) { return kStart_us + frame * kPeriod_us; }

  std::string path(const std::string& name) const { return scratch_.path(name); }

  // A log of the synthetic images, each through `change`: it may spoil the image, and says how often it is
  // written (0: dropped).
  Replayed replay_changed(const std::function<int(int frame, image_t* image)>& change,
                          const std::function<void(calibration_t*)>& spoil = {}) {
    ipc::LogWriter writer(path("run.lcm"));
    calibration_t calibration = test::synthetic_calibration();
    if (spoil) spoil(&calibration);
    writer.write_message("CALIBRATION", 0, calibration);
    for (int i = 0; i < kFrames; ++i) {
      image_t image = test::synthetic_image({}, i);
      for (int copies = change(i, &image); copies > 0; --copies) writer.write_message("CAMERA_0", 0, image);
    }
    writer.close();
    return replay(path("run.lcm"), path("out.lcm"));
  }
  static void fill(image_t* image, std::uint8_t grey) {
    std::fill(image->data.begin(), image->data.end(), grey);
  }
  // Frames that are what they should be are valid soon after the damage, in the first map.
  static void expect_back(const Replayed& r, int first_intact, int frames) {
    ASSERT_EQ(r.outcome.status, 0) << r.outcome.err;
    EXPECT_GE(expect_right(r.poses), 35);
    for (int i = first_intact + frames; i < kFrames; ++i) {
      EXPECT_NE(r.at(time_of(i)).valid, 0) << i;
      EXPECT_EQ(r.at(time_of(i)).map_id, 1) << i;
    }
  }

  const test::Scratch scratch_;
};

TEST_F(BadInput, UndamagedItIsRight) {
  const Replayed r = replay_changed([](int, image_t*) { return 1; });
  ASSERT_EQ(r.outcome.status, 0);
  EXPECT_GE(expect_right(r.poses), 40);
}

TEST_F(BadInput, BlackFramesAreNotValidAndTheWayBackIsFound) {
  const auto r = replay_changed([](int i, image_t* image) {
    if (i >= 30 && i < 40) fill(image, 0);
    return 1;
  });
  EXPECT_EQ(r.poses.size(), std::size_t{kFrames});
  for (int i = 30; i < 40; ++i) {
    EXPECT_EQ(r.at(time_of(i)).valid, 0) << i;
    EXPECT_EQ(static_cast<int>(r.at(time_of(i)).state), static_cast<int>(status_t::STATE_LOST)) << i;
  }
  expect_back(r, 40, 2);
}

TEST_F(BadInput, WhiteFramesToo) {
  const auto r = replay_changed([](int i, image_t* image) {
    if (i >= 30 && i < 40) fill(image, 255);
    return 1;
  });
  for (int i = 30; i < 40; ++i) EXPECT_EQ(r.at(time_of(i)).valid, 0) << i;
  expect_back(r, 40, 2);
}

TEST_F(BadInput, OneBlackFrameCostsItselfOnly) {
  const auto r = replay_changed([](int i, image_t* image) {
    if (i == 30) fill(image, 0);
    return 1;
  });
  EXPECT_EQ(r.at(time_of(30)).valid, 0);
  expect_back(r, 31, 0);
}

TEST_F(BadInput, NoiseIsNotValid) {
  std::mt19937 random(5);
  const auto r = replay_changed([&](int i, image_t* image) {
    if (i >= 30 && i < 40)
      for (std::uint8_t& p : image->data) p = static_cast<std::uint8_t>(random());
    return 1;
  });
  for (int i = 30; i < 40; ++i) EXPECT_EQ(r.at(time_of(i)).valid, 0) << i;
  expect_back(r, 40, 2);
}

TEST_F(BadInput, AFrozenCameraIsNotAStandingVehicle) {
  const image_t frozen = test::synthetic_image({}, 29);
  const auto r = replay_changed([&](int i, image_t* image) {
    if (i >= 30 && i < 40) image->data = frozen.data;
    return 1;
  });
  for (int i = 30; i < 40; ++i) EXPECT_EQ(r.at(time_of(i)).valid, 0) << i;
  expect_back(r, 40, 2);
}

TEST_F(BadInput, DoubledFramesAreDroppedAndCounted) {
  const auto r = replay_changed([](int i, image_t*) { return i % 3 == 0 ? 2 : 1; });
  EXPECT_EQ(r.poses.size(), std::size_t{kFrames});
  EXPECT_EQ(r.status.back().times_backwards, kFrames / 3);
  expect_back(r, 20, 0);
}

TEST_F(BadInput, DoubledFramesWithTimesOfTheirOwnAreNotValid) {
  const image_t before = test::synthetic_image({}, 29);
  const auto r = replay_changed([&](int i, image_t* image) {
    if (i == 30) image->data = before.data;
    return 1;
  });
  EXPECT_EQ(r.at(time_of(30)).valid, 0);
  expect_back(r, 31, 0);
}

TEST_F(BadInput, DroppedFramesCostNothingElse) {
  // One, two and then five in a row.
  const auto dropped = [](int i) { return i == 25 || i == 30 || i == 31 || (i >= 40 && i < 45); };
  const auto r = replay_changed([&](int i, image_t*) { return dropped(i) ? 0 : 1; });
  ASSERT_EQ(r.outcome.status, 0) << r.outcome.err;
  EXPECT_EQ(r.poses.size(), std::size_t{kFrames - 8});
  EXPECT_GE(expect_right(r.poses), 35);
  for (int i = 20; i < kFrames; ++i) {
    if (dropped(i) || i == 45) continue;  // after five the way back waits for one frame more
    EXPECT_NE(r.at(time_of(i)).valid, 0) << i;
  }
}

TEST_F(BadInput, TimesThatRunBackwardsCostTheirFrames) {
  const auto r = replay_changed([](int i, image_t* image) {
    if (i % 10 == 5) image->utime -= 350'000;
    return 1;
  });
  EXPECT_EQ(r.poses.size(), std::size_t{kFrames - 6});
  EXPECT_EQ(r.status.back().times_backwards, 6);
  for (int i = 20; i < kFrames; ++i) EXPECT_TRUE(i % 10 == 5 || r.at(time_of(i)).valid != 0) << i;
  EXPECT_GE(expect_right(r.poses), 35);
}

TEST_F(BadInput, TimesThatLeapAheadCostTheirFrames) {
  for (const std::int64_t leap_us : {250'000LL, 1'500'000LL, 1LL << 40, 1LL << 62}) {
    const auto r = replay_changed([&](int i, image_t* image) {
      if (i % 10 == 5) image->utime += leap_us;
      return 1;
    });
    EXPECT_EQ(r.poses.size(), std::size_t{kFrames - 6}) << leap_us;
    EXPECT_EQ(r.status.back().times_backwards, 6) << leap_us;
    for (int i = 20; i < kFrames; ++i)
      EXPECT_TRUE(i % 10 == 5 || r.at(time_of(i)).valid != 0) << i << ", leap " << leap_us;
    EXPECT_GE(expect_right(r.poses), 35);
  }
}

TEST_F(BadInput, AHugeGapEndsNothing) {
  // An hour goes by, and the camera stands where it would have been without it.
  constexpr std::int64_t kHour_us = 3'600'000'000;
  const auto r = replay_changed([&](int i, image_t* image) {
    if (i >= 30) image->utime += kHour_us;
    return 1;
  });
  ASSERT_EQ(r.outcome.status, 0);
  EXPECT_EQ(r.poses.size(), std::size_t{kFrames});
  EXPECT_EQ(r.status.back().times_backwards, 0);
  EXPECT_EQ(r.at(time_of(30) + kHour_us).valid, 0);
  std::vector<pose_t> poses = r.poses;
  for (pose_t& p : poses) p.utime -= p.utime >= kHour_us ? kHour_us : 0;
  EXPECT_GE(expect_right(poses), 35);
  EXPECT_GE(r.valid_from(time_of(32) + kHour_us), 28);
}

TEST_F(BadInput, ImagesOfTheWrongSizeAreDroppedAndCounted) {
  const auto r = replay_changed([](int i, image_t* image) {
    if (i >= 30 && i < 32) image->width /= 2;                   // another size than the calibration's
    if (i == 33) image->size = 1000, image->data.resize(1000);  // too few bytes
    if (i == 35) image->width = image->height = 0;
    if (i == 37) image->width = -image->width;
    return 1;
  });
  ASSERT_EQ(r.outcome.status, 0) << r.outcome.err;
  EXPECT_EQ(r.poses.size(), std::size_t{kFrames - 5});
  EXPECT_EQ(r.status.back().images_wrong_size, 5);
  EXPECT_GE(expect_right(r.poses), 35);
  for (int i = 38; i < kFrames; ++i) EXPECT_NE(r.at(time_of(i)).valid, 0) << i;
}

TEST_F(BadInput, NumbersThatAreNoneReachNobody) {
  // In measurements beside the images; in the calibration they stop the start (ReplayInput).
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto undamaged = replay_changed([](int, image_t*) { return 1; });
  {
    ipc::LogWriter writer(path("nan.lcm"));
    writer.write_message("CALIBRATION", 0, test::synthetic_calibration());
    for (int i = 0; i < kFrames; ++i) {
      imu_t imu{};
      imu.utime = time_of(i) - 1;
      std::fill(std::begin(imu.angular_velocity), std::end(imu.angular_velocity), kNan);
      writer.write_message("IMU", 0, imu);
      wheels_t wheels{};
      wheels.utime = imu.utime;
      wheels.speed = std::numeric_limits<double>::infinity();
      writer.write_message("WHEELS", 0, wheels);
      ground_truth_t truth{};
      truth.utime = imu.utime;
      truth.position[0] = kNan;
      writer.write_message("GROUND_TRUTH", 0, truth);
      writer.write_message("CAMERA_0", 0, test::synthetic_image({}, i));
    }
    writer.close();
  }
  const Replayed r = replay(path("nan.lcm"), path("nan_out.lcm"));
  ASSERT_EQ(r.outcome.status, 0) << r.outcome.err;
  ASSERT_EQ(r.poses.size(), undamaged.poses.size());
  for (std::size_t i = 0; i < r.poses.size(); ++i) {
    EXPECT_EQ(r.poses[i].valid, undamaged.poses[i].valid) << i;
    EXPECT_TRUE(r.poses[i].valid == 0 || r.poses[i].position[0] == undamaged.poses[i].position[0]) << i;
  }
  expect_finite(r.poses);
}

TEST_F(BadInput, ACalibrationThatIsWrongByAFactorEndsTheRunOrderly) {
  // A camera that only moves straight ahead cannot tell its focal length; nothing here is held against truth.
  const auto intact = [](int, image_t*) { return 1; };
  const std::vector<std::function<void(camera_calibration_t&)>> mistakes{
      [](camera_calibration_t& c) { c.fx *= 2.0, c.fy *= 2.0; },
      [](camera_calibration_t& c) { c.fx *= 0.5, c.fy *= 0.5; },
      [](camera_calibration_t& c) { c.fx *= 10.0, c.fy *= 10.0; },
      [](camera_calibration_t& c) { c.fx *= 0.1; },
      [](camera_calibration_t& c) { c.distortion[0] = -0.5; },
      [](camera_calibration_t& c) { c.distortion[0] = 5.0; },
      [](camera_calibration_t& c) { c.cx = 1.0, c.cy = 1.0; },
  };
  for (std::size_t m = 0; m < mistakes.size(); ++m) {
    const auto r = replay_changed(intact, [&](calibration_t* c) { mistakes[m](c->cameras[0]); });
    EXPECT_EQ(r.outcome.status, 0) << m << ": " << r.outcome.err;
    EXPECT_EQ(r.poses.size(), std::size_t{kFrames}) << m;
    expect_finite(r.poses);
  }
}

// ---- random damage ----

// A log in memory, and where its images lie in it.
class DamagedLog {
 public:
  explicit DamagedLog(const std::string& path) : bytes_(test::read_bytes(path)) {
    ipc::LogReader reader(path);
    ipc::LogEvent event;
    while (reader.next(&event)) {
      const std::size_t end =
          event.offset + ipc::LogReader::kHeaderBytes + event.channel.size() + event.data.size();
      image_t image;
      const bool is_image = event.channel == "CAMERA_0" && ipc::decode(event.data, &image);
      events_.push_back({event.offset, end, is_image ? image.utime : -1});
    }
  }
  void cut_off(std::size_t at) {
    bytes_.resize(at);
    for (Event& e : events_) e.intact = e.intact && e.end <= at;
  }
  void flip(std::size_t bit) {
    bytes_[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    for (Event& e : events_)
      if (bit / 8 >= e.begin && bit / 8 < e.end) e.intact = false;
  }
  // A bit anywhere, or (where nearly nothing of an image log lies) in some event's head.
  void flip_at_random(bool in_head, std::mt19937_64* random) {
    constexpr std::size_t kHeadBytes = 100;  // header, channel, and the message up to its pixels
    const Event& e = events_[(*random)() % events_.size()];
    const std::size_t head = std::min(kHeadBytes, e.end - e.begin);
    flip(in_head ? 8 * e.begin + (*random)() % (8 * head) : (*random)() % (8 * bytes_.size()));
  }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }
  [[nodiscard]] bool calibration_intact() const { return events_.front().intact; }
  [[nodiscard]] Times images(bool intact) const {
    Times times;
    for (const Event& e : events_)
      if (e.utime >= 0 && e.intact == intact) times.insert(e.utime);
    return times;
  }

 private:
  struct Event {
    std::size_t begin = 0, end = 0;
    std::int64_t utime = -1;  // of an image
    bool intact = true;
  };
  Bytes bytes_;
  std::vector<Event> events_;
};

class RandomDamage : public testing::Test {
 protected:
  static constexpr int kFrames = 42;  // the map has settled after half of them

  void damage_and_replay(int first_seed, int seeds) {
    SyntheticLog log;
    log.frames = kFrames;
    test::write_synthetic_log(scratch_.path("run.lcm"), log);
    const DamagedLog whole(scratch_.path("run.lcm"));
    for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      replay_with_damage(whole, static_cast<std::uint64_t>(seed));
    }
    EXPECT_GE(judged_, 3 * seeds);  // the damage leaves most of most logs
  }

 private:
  void replay_with_damage(DamagedLog log, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const bool cut = seed % 4 == 0;
    if (cut) log.cut_off(random() % log.size());
    if (!cut || seed % 8 == 0)
      for (std::uint64_t flips = 1 + random() % 20; flips > 0 && log.size() > 0; --flips)
        log.flip_at_random(random() % 2 == 0, &random);
    test::write_bytes(scratch_.path("damaged.lcm"), log.bytes());
    // Fewer features: half of the time, and the images are small.
    const Replayed r =
        replay(scratch_.path("damaged.lcm"), scratch_.path("out.lcm"), {"--set", "extractor.features=800"});

    const Times intact = log.images(true);
    EXPECT_TRUE(r.outcome.status == 0 || r.outcome.status == 2) << r.outcome.status;
    EXPECT_EQ(r.outcome.error_lines(), r.outcome.status == 0 ? 0 : 1) << r.outcome.err;
    // A calibration that is not what it was may know no such camera or another size.
    if (!log.calibration_intact()) return;
    if (!intact.empty()) {
      const Times delivered = r.delivered();
      for (const std::int64_t utime : intact) EXPECT_TRUE(delivered.contains(utime)) << utime;
      ASSERT_EQ(r.summaries.size(), 1U);
      EXPECT_EQ(r.summaries[0].frames, static_cast<std::int64_t>(r.poses.size()));
      EXPECT_EQ(r.summaries[0].frames_valid, r.valid_from(INT64_MIN));
    }
    expect_finite(r.poses);
    // Of an image with a damaged time it is not known when it was taken.
    Times doubtful;
    for (const pose_t& p : r.poses)
      if (!intact.contains(p.utime)) doubtful.insert(p.utime);
    judged_ += expect_right(r.poses, doubtful);
  }

  const test::Scratch scratch_;
  int judged_ = 0;
};

TEST_F(RandomDamage, CostsOnlyWhatItTouches) {
  damage_and_replay(1, 8);
}

using RandomDamageLong = RandomDamage;

TEST_F(RandomDamageLong, CostsOnlyWhatItTouches) {
  damage_and_replay(1, 200);
}

}  // namespace
}  // namespace farpoint::daemon
