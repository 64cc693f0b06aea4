// SPDX-License-Identifier: Apache-2.0
// MAVLink frames, against an implementation that is not this project's: npm's node-mavlink.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "ipc/mavlink/messages.h"
#include "tests/ipc/scratch.h"
#include "tests/support/mavlink_stream.h"
#include "tests/support/paths.h"

namespace farpoint::ipc::mavlink {
namespace {

using test::parsed;

constexpr int kSkipped = 77;

int run_codec(const std::string& arguments) {
  const int status = std::system((test::source_dir() + "/tests/ipc/node-mavlink/codec " + arguments).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void write(const std::string& path, const std::vector<Frame>& frames) {
  std::ofstream out(path, std::ios::binary);
  for (const Frame& frame : frames)
    out.write(reinterpret_cast<const char*>(frame.bytes().data()),
              static_cast<std::streamsize>(frame.bytes().size()));
}

// The lines that the other implementation makes of the frames; nothing where there is no Node.
std::optional<std::vector<std::string>> decoded(const std::vector<Frame>& frames) {
  const test::Scratch scratch;
  write(scratch.path("frames"), frames);
  const int status = run_codec("decode " + scratch.path("frames") + " > " + scratch.path("lines"));
  if (status == kSkipped) return std::nullopt;
  EXPECT_EQ(status, 0);
  std::ifstream in(scratch.path("lines"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// What follows "name": in a line of JSON, up to the next name.
std::string field(const std::string& line, const std::string& name) {
  const std::string key = "\"" + name + "\":";
  const std::size_t at = line.find(key);
  if (at == std::string::npos) return "missing";
  std::size_t end = line.find(",\"", at + key.size());
  while (end != std::string::npos && line[end - 1] != ']' && line.find('[', at) < end &&
         line.find(']', at) > end)
    end = line.find(",\"", end + 1);
  std::string value = line.substr(at + key.size(), end == std::string::npos ? end : end - at - key.size());
  while (!value.empty() && value.back() == '}') value.pop_back();
  return value;
}

Odometry numbered() {
  Odometry o;
  o.time_us = 1234567890123ULL;
  o.position_m = {1.5F, -2.5F, 3.25F};
  o.orientation_wxyz = {0.5F, -0.5F, 0.5F, -0.5F};
  o.velocity_m_s = {4, 5, 6};
  o.rates_rad_s = {0.125F, 0.25F, 0.375F};
  for (std::size_t i = 0; i < 21; ++i) {
    o.pose_covariance[i] = static_cast<float>(1 + i);
    o.velocity_covariance[i] = static_cast<float>(101 + i);
  }
  o.reset_counter = 200;
  o.quality = -1;
  return o;
}

TEST(Mavlink, OdometryIsReadFieldByFieldByAnotherImplementation) {
  const auto decoded_lines = decoded({encode(numbered(), {1, 197}, 42)});
  if (!decoded_lines) GTEST_SKIP() << "no node or npm";
  const std::vector<std::string>& lines = *decoded_lines;
  ASSERT_EQ(lines.size(), 1U);
  const std::map<std::string, std::string> expected{
      {"id", "331"},
      {"name", "\"ODOMETRY\""},
      {"magic", "253"},
      {"system", "1"},
      {"component", "197"},
      {"sequence", "42"},
      {"timeUsec", "\"1234567890123\""},
      {"frameId", "20"},
      {"childFrameId", "12"},
      {"x", "1.5"},
      {"y", "-2.5"},
      {"z", "3.25"},
      {"q", "[0.5,-0.5,0.5,-0.5]"},
      {"vx", "4"},
      {"vy", "5"},
      {"vz", "6"},
      {"rollspeed", "0.125"},
      {"pitchspeed", "0.25"},
      {"yawspeed", "0.375"},
      {"poseCovariance", "[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21]"},
      {"velocityCovariance",
       "[101,102,103,104,105,106,107,108,109,110,111,112,113,114,115,116,117,118,119,120,121]"},
      {"resetCounter", "200"},
      {"estimatorType", "2"},
      {"quality", "-1"}};
  for (const auto& [name, value] : expected) EXPECT_EQ(field(lines[0], name), value) << name;
}

TEST(Mavlink, UnknownCovariancesAndZerosAtTheEndAreReadRightly) {
  Odometry o = numbered();
  o.pose_covariance = o.velocity_covariance = kUnknownTriangle;
  o.reset_counter = o.estimator = 0;
  o.quality = 0;
  const Frame frame = encode(o, {255, 1}, 255);
  EXPECT_EQ(frame.bytes()[1], 230);  // without the three extensions
  const auto decoded_lines = decoded({frame});
  if (!decoded_lines) GTEST_SKIP() << "no node or npm";
  const std::vector<std::string>& lines = *decoded_lines;
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(field(lines[0], "poseCovariance").substr(0, 9), "[\"NaN\",0,");
  EXPECT_EQ(field(lines[0], "velocityCovariance").substr(0, 9), "[\"NaN\",0,");
  EXPECT_EQ(field(lines[0], "system"), "255");
  EXPECT_EQ(field(lines[0], "quality"), "0");
}

TEST(Mavlink, HeartbeatAndTimesyncAreReadByAnotherImplementation) {
  const auto decoded_lines =
      decoded({encode(Heartbeat{}, {1, 197}, 0), encode(Timesync{0, 5'000'000'001, 0, 0}, {1, 197}, 1),
               encode(Timesync{123'456'789'012'345, 42, 7, 9}, {1, 197}, 2)});
  if (!decoded_lines) GTEST_SKIP() << "no node or npm";
  const std::vector<std::string>& lines = *decoded_lines;
  ASSERT_EQ(lines.size(), 3U);
  for (const auto& [name, value] : std::map<std::string, std::string>{{"name", "\"HEARTBEAT\""},
                                                                      {"type", "18"},
                                                                      {"autopilot", "8"},
                                                                      {"baseMode", "0"},
                                                                      {"customMode", "0"},
                                                                      {"systemStatus", "4"},
                                                                      {"mavlinkVersion", "3"}})
    EXPECT_EQ(field(lines[0], name), value) << name;
  EXPECT_EQ(field(lines[1], "tc1"), "\"0\"");
  EXPECT_EQ(field(lines[1], "ts1"), "\"5000000001\"");
  EXPECT_EQ(field(lines[2], "tc1"), "\"123456789012345\"");
  EXPECT_EQ(field(lines[2], "ts1"), "\"42\"");
  EXPECT_EQ(field(lines[2], "targetSystem"), "7");
  EXPECT_EQ(field(lines[2], "targetComponent"), "9");
}

TEST(Mavlink, FramesOfAnotherImplementationAreReadInAnyPieces) {
  const test::Scratch scratch;
  const int status = run_codec("encode " + scratch.path("frames"));
  if (status == kSkipped) GTEST_SKIP() << "no node or npm";
  ASSERT_EQ(status, 0);
  const std::vector<std::uint8_t> bytes = test::read_bytes(scratch.path("frames"));
  for (const std::size_t piece : {1U, 7U, 64U, 1000U}) {
    Parser parser;
    const std::vector<Received> received = parsed(&parser, bytes, piece);
    ASSERT_EQ(received.size(), 4U) << piece;
    EXPECT_EQ(received[0].id, kHeartbeat.id);
    EXPECT_EQ(received[0].sender.system, 1);
    EXPECT_EQ(received[0].sender.component, 1);
    EXPECT_EQ(decode_timesync(received[1]).ts1_ns, 5'000'000'001);
    EXPECT_EQ(decode_timesync(received[2]).ts1_ns, 5'000'000'002);
    EXPECT_EQ(decode_timesync(received[3]).tc1_ns, 123'456'789'012'345);
    EXPECT_EQ(decode_timesync(received[3]).ts1_ns, 987'654'321);
  }
}

TEST(Mavlink, ADamagedFrameIsCountedAndTheNextOneRead) {
  const Frame good = encode(Timesync{1, 2, 0, 0}, {1, 1}, 0);
  for (std::size_t i = 0; i < good.bytes().size(); ++i) {
    std::vector<std::uint8_t> bytes(good.bytes().begin(), good.bytes().end());
    bytes[i] ^= 0x10;
    for (int more = 0; more < 20; ++more) bytes.insert(bytes.end(), good.bytes().begin(), good.bytes().end());
    Parser parser;
    const std::vector<Received> received = parsed(&parser, bytes, 11);
    EXPECT_EQ(received.size(), 20U) << i;
    for (const Received& r : received) EXPECT_EQ(decode_timesync(r).ts1_ns, 2) << i;
  }
}

TEST(Mavlink, AnyBytesAreSafe) {
  std::uint64_t random = 1;
  std::vector<std::uint8_t> bytes(200'000);
  for (std::uint8_t& byte : bytes) {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    byte = (random >> 60) == 0 ? 0xFD : static_cast<std::uint8_t>(random >> 40);
  }
  Parser parser;
  EXPECT_LT(parsed(&parser, bytes, 97).size(), 10U);
}

}  // namespace
}  // namespace farpoint::ipc::mavlink
