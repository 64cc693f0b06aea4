// SPDX-License-Identifier: Apache-2.0
#include "ipc/lcm_publisher.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <thread>

#include "bot_core/image_t.hpp"
#include "bot_core/pose_t.hpp"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "ipc/message.h"
#include "tests/ipc/allocations.h"
#include "tests/ipc/scratch.h"
#include "tests/support/paths.h"

namespace farpoint::ipc {
namespace {

constexpr int kRounds = 40;
constexpr char kWorkFolderVariable[] = "FARPOINT_TEST_FOLDER";

odometry_t make_odometry(std::int64_t utime, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  odometry_t m{};
  m.utime = utime;
  m.publish_utime = utime + 12'345;
  m.sequence = utime / 100;
  for (auto* array : {m.position, m.velocity, m.angular_velocity}) {
    for (int i = 0; i < 3; ++i) array[i] = normal(rng);
  }
  for (auto& row : m.pose_covariance) {
    for (auto& value : row) value = normal(rng);
  }
  m.quality = -1;
  m.valid = 1;
  m.reset_counter = static_cast<std::int32_t>(rng() % 1000);
  return m;
}

pose_t make_pose(std::int64_t utime, std::mt19937_64& rng) {
  pose_t m{};
  m.utime = utime;
  m.position[2] = std::normal_distribution<double>()(rng);
  m.orientation[0] = 1;
  m.keyframe = 1;
  return m;
}

map_from_odom_t make_map_from_odom(std::int64_t utime) {
  map_from_odom_t m{};
  m.utime = utime;
  m.scale = 1.25;
  return m;
}

status_t make_status(std::int64_t utime) {
  status_t m{};
  m.utime = utime;
  m.state = status_t::STATE_TRACKING;
  m.build = "1.2.3-abcdef";
  m.configuration_hash = std::string(64, 'a');
  m.message = "all is well";
  return m;
}

timing_t make_timing(std::int64_t utime) {
  timing_t m{};
  m.utime = utime;
  m.cpu_ms[timing_t::STAGE_TRACKING] = 12.5;
  return m;
}

map_t make_map(std::int64_t utime, int points, std::mt19937_64& rng) {
  map_t m{};
  m.utime = utime;
  m.npoints = points;
  for (auto* values : {&m.x, &m.y, &m.z, &m.relative_sigma}) {
    for (int i = 0; i < points; ++i)
      values->push_back(static_cast<float>(std::normal_distribution<double>()(rng)));
  }
  m.landmark_state.assign(static_cast<std::size_t>(points), std::int8_t{map_t::LANDMARK_FULL});
  m.through_vmp.assign(static_cast<std::size_t>(points), 1);
  m.nkeyframes = 2;
  m.keyframe_utime = {1, 2};
  m.keyframe_pose.assign(2, {1, 2, 3, 1, 0, 0, 0});
  return m;
}

bot_core::pose_t make_bot_core_pose(std::int64_t utime) {
  bot_core::pose_t m{};
  m.utime = utime;
  m.pos[0] = 4;
  m.orientation[0] = 1;
  return m;
}

// Calls visit(channel, message) for everything that goes out, the same in every process.
template <typename Visit>
void visit_messages(Visit visit) {
  std::mt19937_64 rng(1);
  for (int i = 0; i < kRounds; ++i) {
    const std::int64_t utime = 1'000'000 + 33'333 * i;
    visit(kOdometryChannel, make_odometry(utime, rng));
    visit(kPoseChannel, make_pose(utime, rng));
    visit(kMapFromOdomChannel, make_map_from_odom(utime));
    visit(kStatusChannel, make_status(utime));
    visit(kTimingChannel, make_timing(utime));
    visit(kBotCorePoseChannel, make_bot_core_pose(utime));
    if (i % 10 == 0)
      visit(kMapChannel, make_map(utime, i == 0 ? 5000 : 100, rng));  // 90 kB: several datagrams
  }
}

bool eventually(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

bool log_has(const std::string& path, const std::string& channel) {
  if (!std::filesystem::exists(path)) return false;
  LogReader reader(path);
  LogEvent event;
  while (reader.next(&event)) {
    if (event.channel == channel) return true;
  }
  return false;
}

// Runs within the namespace that tests/ipc/udp/run makes, in a process of its own.
TEST(LcmPublisherInNamespace, DISABLED_PublishesEverything) {
  const std::string work = std::getenv(kWorkFolderVariable);
  LcmPublisher publisher(kDefaultLcmUrl);
  const std::uint8_t byte = 0;
  ASSERT_TRUE(eventually([&] {  // until both listen
    publisher.send("READY", {&byte, 1});
    return log_has(work + "/recorded.lcm", "READY") && !test::read_bytes(work + "/received.txt").empty();
  }));
  visit_messages([&](const char* channel, const auto& message) {
    EXPECT_TRUE(publisher.publish(channel, message)) << channel;
    std::this_thread::sleep_for(
        std::chrono::milliseconds(1));  // LCM gives no promise beyond the receive buffer
  });
  EXPECT_EQ(publisher.counts().failed, 0U);
  ASSERT_TRUE(eventually([&] {
    publisher.send("END", {&byte, 1});
    return log_has(work + "/recorded.lcm", "END");
  }));
}

// And the heap: after a first message of each kind, no more of it.
TEST(LcmPublisherInNamespace, DISABLED_DoesNotTouchTheHeap) {
  LcmPublisher publisher(kDefaultLcmUrl);
  std::mt19937_64 rng(2);
  const odometry_t odometry = make_odometry(1, rng);
  const status_t status = make_status(1);
  const map_t map = make_map(1, 5000, rng);
  const auto publish_all = [&] {
    publisher.publish(kOdometryChannel, odometry);
    publisher.publish(kStatusChannel, status);
    publisher.publish(kMapChannel, map);
  };
  publish_all();
  const std::uint64_t before = test::allocations();
  for (int i = 0; i < 100; ++i) publish_all();
  const std::uint64_t during = test::allocations() - before;
  EXPECT_EQ(publisher.counts().sent, 303U);
  EXPECT_EQ(during, 0U);
}

// Runs one disabled test of this program in the namespace. Status as tests/ipc/udp/run.
int run_in_namespace(const std::string& work, const std::string& filter, const std::string& runner) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string command = std::string(kWorkFolderVariable) + "=" + work + " " + runner + " " + self +
                              " --gtest_also_run_disabled_tests --gtest_filter=" + filter + " > " + work +
                              "/publisher.txt 2>&1";
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string text_of(const std::string& path) {
  const auto bytes = test::read_bytes(path);
  return {bytes.begin(), bytes.end()};
}

std::uint64_t fnv1a(const std::vector<std::uint8_t>& bytes) {
  std::uint64_t hash = 14695981039346656037U;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 1099511628211U;
  return hash;
}

constexpr int kSkipped = 77;
// By which the LCM library of every subscriber tries the network out, at any time after it was started.
constexpr const char* kSelfTest = "LCM_SELF_TEST";

TEST(LcmPublisher, LcmLoggerRecordsAndAStrangerDecodesEveryMessage) {
  const test::Scratch scratch;
  const std::string folder = test::source_dir() + "/tests/ipc/udp";
  const std::string runner = folder + "/run " + test::source_dir() + "/ipc/types " + scratch.path("");
  const int status =
      run_in_namespace(scratch.path(""), "LcmPublisherInNamespace.DISABLED_PublishesEverything", runner);
  if (status == kSkipped) GTEST_SKIP() << "no permission for a network namespace (unshare -n)";
  ASSERT_EQ(status, 0) << text_of(scratch.path("publisher.txt")) << text_of(scratch.path("logger.txt"));

  std::ifstream received(scratch.path("received.txt"));
  LogReader recorded(scratch.path("recorded.lcm"));
  LogEvent event;
  int messages = 0;
  visit_messages([&](const char* channel, const auto& message) {
    std::vector<std::uint8_t> bytes;
    encode(message, &bytes);
    // The subscriber: channel, time, hash of what it decoded.
    std::string line, got_channel, got_hash;
    std::int64_t got_utime = -1;
    do {
      ASSERT_TRUE(std::getline(received, line))
          << "message " << messages << " on " << channel << " was not received";
    } while (line == "READY");
    std::istringstream(line) >> got_channel >> got_utime >> got_hash;
    char hash[17];
    std::snprintf(hash, sizeof hash, "%016lx", static_cast<unsigned long>(fnv1a(bytes)));
    EXPECT_EQ(got_channel, channel);
    EXPECT_EQ(got_utime, message.utime);
    EXPECT_EQ(got_hash, hash) << channel;
    // The logger: the very bytes.
    do {
      ASSERT_TRUE(recorded.next(&event))
          << "message " << messages << " on " << channel << " was not recorded";
    } while (event.channel == "READY" || event.channel == kSelfTest);
    EXPECT_EQ(event.channel, channel);
    EXPECT_TRUE(std::equal(event.data.begin(), event.data.end(), bytes.begin(), bytes.end())) << channel;
    ++messages;
  });
  EXPECT_EQ(messages, 6 * kRounds + 4);
}

TEST(LcmPublisher, MakesNoHeapCall) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  const test::Scratch scratch;
  const std::string runner =
      "unshare -n sh -c 'ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec \"$0\" \"$@\"'";
  if (std::system("unshare -n true 2> /dev/null") != 0)
    GTEST_SKIP() << "no permission for a network namespace";
  const int status =
      run_in_namespace(scratch.path(""), "LcmPublisherInNamespace.DISABLED_DoesNotTouchTheHeap", runner);
  EXPECT_EQ(status, 0) << text_of(scratch.path("publisher.txt"));
}

TEST(LcmPublisher, AnUnusableUrlIsNamed) {
  try {
    LcmPublisher publisher("nonsense://x");
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("nonsense://x"), std::string::npos) << error.what();
  }
}

TEST(LcmPublisher, WhatDoesNotFitIsCountedAndNotSent) {
  LcmPublisher publisher("memq://", 64);
  std::mt19937_64 rng(3);
  EXPECT_FALSE(publisher.publish(kOdometryChannel, make_odometry(1, rng)));
  EXPECT_EQ(publisher.counts().too_large, 1U);
  EXPECT_EQ(publisher.counts().sent, 0U);
}

// A fingerprint without nested types is the hash of the members, turned left by one bit.
std::uint64_t fingerprint(std::uint64_t hash) {
  return hash << 1 | hash >> 63;
}

// The hashes in code that others generated from libbot's own definitions of these types.
TEST(BotCore, FingerprintsAreThoseOfTheOriginalTypes) {
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::pose_t::getHash()), fingerprint(0x170b77d82958082fU));
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::image_metadata_t::getHash()),
            fingerprint(0x4d25b1a682bbfdc7U));
  // image_t nests the metadata; its own part was made here, from the member names and types of libbot's.
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::image_t::getHash()),
            fingerprint(0x6fee6cb20472ff6aU + fingerprint(0x4d25b1a682bbfdc7U)));
}

}  // namespace
}  // namespace farpoint::ipc
