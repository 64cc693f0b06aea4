// SPDX-License-Identifier: Apache-2.0
#include "ipc/can_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <sstream>

#include "farpoint/status_t.hpp"
#include "ipc/can_dbc.h"
#include "ipc/candump.h"
#include "tests/ipc/dbc.h"
#include "tests/ipc/scratch.h"
#include "tests/support/paths.h"

namespace farpoint::ipc {
namespace {

using test::DbcMessage;
using test::DbcSignal;

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const std::string kDbcPath = test::source_dir() + "/config/farpoint.dbc";

const std::map<std::uint32_t, DbcMessage>& dbc() {
  static const auto messages = test::read_dbc(kDbcPath);
  return messages;
}

using Messages = std::map<std::uint32_t, DbcMessage>;

// All signals of an epoch by name, decoded with the DBC alone. NaN: not available.
std::map<std::string, double> decoded(const CanEpoch& epoch, const Messages& messages = dbc()) {
  std::map<std::string, double> out;
  for (const CanFrame& frame : epoch.frames()) {
    for (const auto& [name, signal] : messages.at(test::dbc_id(frame)).signals)
      out[name] = signal.value(frame);
  }
  return out;
}

// Every message with every epoch.
CanLayout whole() {
  CanLayout layout;
  layout.every.fill(1);
  return layout;
}
CanEncoder whole_encoder() {
  return CanEncoder(whole());
}

// The DBC file that is written for a layout, read back.
Messages dbc_of(const CanLayout& layout) {
  const test::Scratch scratch;
  const std::string path = scratch.path("a.dbc");
  std::ofstream(path) << dbc_text(layout);
  return test::read_dbc(path);
}

std::uint32_t default_id(CanMessage message) {
  return CanLayout{}.id(message);
}

OdometryEpoch random_epoch(std::mt19937_64& rng) {
  const auto uniform = [&rng](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(rng);
  };
  OdometryEpoch e;
  e.state = static_cast<std::uint8_t>(rng() % 9);
  e.scale_state = static_cast<std::uint8_t>(1 + rng() % 2);
  e.pose_valid = e.velocity_valid = true;
  e.from_vision = rng() % 2 == 0;
  e.map_frame = rng() % 2 == 0;
  e.reset_counter = static_cast<std::uint32_t>(rng() % 256);
  e.predicted = rng() % 2 == 0;
  e.boot_counter = static_cast<std::uint8_t>(rng() % 256);
  e.reason = static_cast<Reason>(rng() % 12);
  e.map_id = static_cast<std::int32_t>(rng() % 256);
  e.levelled = rng() % 2 == 0 ? CanYesNo::kYes : CanYesNo::kNo;
  e.body_is_camera = rng() % 2 == 0 ? CanYesNo::kYes : CanYesNo::kNo;
  constexpr std::array kSources{CanScaleSource::kNone, CanScaleSource::kAssumed,
                                CanScaleSource::kSecondCamera, CanScaleSource::kWheels};
  e.scale_source = kSources[rng() % kSources.size()];
  e.wheels = static_cast<CanSensorUse>(rng() % 4);
  e.scale_sigma = uniform(0, 4);
  e.quality = static_cast<int>(rng() % 101);
  e.age_s = uniform(0, 0.13);
  for (auto& p : e.position_m) p = uniform(-83886, 83886);
  e.heading_rad = uniform(-std::numbers::pi, std::numbers::pi);
  e.roll_rad = uniform(-std::numbers::pi, std::numbers::pi);
  e.pitch_rad = uniform(-std::numbers::pi / 2, std::numbers::pi / 2);
  for (auto& v : e.velocity_m_s) v = uniform(-163, 163);
  e.yaw_rate_rad_s = uniform(-28, 28);
  for (auto& s : e.sigma_position_m) s = uniform(0, 65);
  e.sigma_heading_rad = uniform(0, 1.1);
  e.sigma_roll_rad = uniform(0, 1.1);
  e.sigma_pitch_rad = uniform(0, 1.1);
  for (auto& s : e.sigma_velocity_m_s) s = uniform(0, 40);
  e.sigma_yaw_rate_rad_s = uniform(0, 0.7);
  return e;
}

// What each signal must show, and how coarse it may be: half a step, or one step up for ages and deviations.
struct Expected {
  double value, below, above;
};

std::map<std::string, Expected> expected(const OdometryEpoch& e) {
  std::map<std::string, Expected> out;
  const auto exact = [&](const std::string& name, double value) { out[name] = {value, 0, 0}; };
  const auto nearest = [&](const std::string& name, double value, double step) {
    out[name] = {value, step / 2 * 1.0001, step / 2 * 1.0001};
  };
  const auto upward = [&](const std::string& name, double value, double step) {
    out[name] = {value, 1e-6 * step + 1e-12, step};
  };
  exact("State", e.state);
  exact("ScaleState", e.scale_state);
  exact("PoseValid", e.pose_valid ? 1 : 0);
  exact("VelocityValid", e.velocity_valid ? 1 : 0);
  exact("ResetCounter", e.reset_counter);
  exact("Quality", e.quality);
  exact("FromVision", e.from_vision ? 1 : 0);
  exact("Frame", e.map_frame ? 1 : 0);
  exact("MapId", e.map_id);
  exact("Predicted", e.predicted ? 1 : 0);
  exact("BootCounter", e.boot_counter);
  exact("Reason", static_cast<double>(e.reason));
  exact("Levelled", static_cast<double>(e.levelled));
  exact("BodyIsCamera", static_cast<double>(e.body_is_camera));
  exact("ScaleSource", static_cast<double>(e.scale_source));
  exact("Layout", 2);
  upward("ScaleSigma", e.scale_sigma, 0.001);
  upward("Age", e.age_s, 0.0001);
  upward("AgeCoarse", e.age_s, 0.01);
  const std::string axes = "XYZ";
  for (std::size_t i = 0; i < 3; ++i) {
    nearest(std::string("Position") + axes[i], e.position_m[i], 0.01);
    nearest(std::string("Velocity") + axes[i], e.velocity_m_s[i], 0.005);
    upward(std::string("SigmaPosition") + axes[i], e.sigma_position_m[i], 0.001);
    upward(std::string("SigmaVelocity") + axes[i], e.sigma_velocity_m_s[i], 0.01);
  }
  nearest("Heading", e.heading_rad / kRadians, 0.01);
  nearest("Roll", e.roll_rad / kRadians, 0.01);
  nearest("Pitch", e.pitch_rad / kRadians, 0.01);
  nearest("YawRate", e.yaw_rate_rad_s / kRadians, 0.05);
  upward("SigmaHeading", e.sigma_heading_rad / kRadians, 0.001);
  upward("SigmaRoll", e.sigma_roll_rad / kRadians, 0.001);
  upward("SigmaPitch", e.sigma_pitch_rad / kRadians, 0.001);
  upward("SigmaYawRate", e.sigma_yaw_rate_rad_s / kRadians, 0.01);
  return out;
}

void expect_all(const std::map<std::string, double>& got, const OdometryEpoch& epoch) {
  for (const auto& [name, want] : expected(epoch)) {
    ASSERT_TRUE(got.contains(name)) << name;
    EXPECT_GE(got.at(name), want.value - want.below) << name;
    EXPECT_LE(got.at(name), want.value + want.above) << name;
  }
}

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(Dbc, TheShippedFileIsThatOfTheDefaults) {
  EXPECT_EQ(text_of(kDbcPath), dbc_text({})) << "farpoint dbc -o config/farpoint.dbc";
}

TEST(Dbc, EveryFrameIsDescribedAndNothingElse) {
  ASSERT_EQ(dbc().size(), kCanMessages);
  const CanLayout layout;
  std::set<int> data_ids;
  for (std::size_t i = 0; i < kCanMessages; ++i) {
    const auto message = static_cast<CanMessage>(i);
    ASSERT_TRUE(dbc().contains(layout.id(message)));
    const DbcMessage& described = dbc().at(layout.id(message));
    EXPECT_EQ(described.size, 8U);
    EXPECT_EQ(described.data_id, layout.data_id(message));
    EXPECT_EQ(described.e2e_profile, 1);
    EXPECT_EQ(described.frame_format, 0);
    EXPECT_EQ(described.cycle_ms, 20 * layout.period_of(message));
    EXPECT_EQ(described.timeout_ms, 5 * described.cycle_ms);
    data_ids.insert(described.data_id);
  }
  EXPECT_EQ(data_ids.size(), kCanMessages);  // one Data ID a frame
  // A receiver of layout 1 had 0x4650 to 0x4657: it must reject every frame of this one.
  EXPECT_GT(*data_ids.begin(), 0x4657);
}

TEST(Dbc, BeforeTheFirstFrameNoNumberIsAvailable) {
  for (const auto& [id, message] : dbc()) {
    for (const auto& [name, signal] : message.signals) {
      for (const auto& [raw, text] : signal.values)
        if (text == "not available") {
          EXPECT_EQ(signal.at_start, raw) << name;
        }
    }
  }
}

TEST(Dbc, IdentifiersAndCyclesFollowTheLayout) {
  CanLayout layout;
  layout.base_id = 0x18ff1000;
  layout.extended = true;
  layout.base_data_id = 0x100;
  layout.rate_hz = 100;
  ASSERT_EQ(parse_can_messages("status attitude/2", &layout.every), "");
  const Messages messages = dbc_of(layout);
  ASSERT_EQ(messages.size(), 2U);
  const DbcMessage& attitude = messages.at(0x98ff1003);
  EXPECT_EQ(attitude.name, "FARPOINT_ATTITUDE");
  EXPECT_EQ(attitude.data_id, 0x103);
  EXPECT_EQ(attitude.cycle_ms, 20);
  EXPECT_EQ(attitude.frame_format, 1);
  std::mt19937_64 rng(7);
  const OdometryEpoch epoch = random_epoch(rng);
  CanEncoder encoder(layout);
  EXPECT_EQ(encoder.encode(epoch).size(), 1U);  // the first epoch has no attitude yet
  const CanEpoch second = encoder.encode(epoch);
  ASSERT_EQ(second.size(), 2U);
  EXPECT_TRUE(second.frames()[1].extended);
  EXPECT_NEAR(decoded(second, messages).at("Heading"), epoch.heading_rad / kRadians, 0.0051);
}

TEST(CanLayout, MessagesThatCannotBeReadAreSaid) {
  std::array<int, kCanMessages> every{};
  for (const auto& [text, complaint] : std::map<std::string, std::string>{
           {"", "status is missing"},
           {"attitude", "status is missing"},
           {"status/2", "status is missing or has a divider"},
           {"status speed",
            "'speed' is no message, expected some of status, position_xy, position_z, attitude, "
            "velocity, sigmas, diagnosis"},
           {"status attitude attitude", "'attitude' comes twice"},
           {"status attitude/0", "'attitude/0', expected a divider"},
           {"status attitude/x", "'attitude/x', expected a divider"},
           {"status attitude/", "'attitude/', expected a divider"}}) {
    EXPECT_EQ(parse_can_messages(text, &every).substr(0, complaint.size()), complaint) << text;
  }
  EXPECT_EQ(every, (std::array<int, kCanMessages>{}));
}

TEST(CanLayout, TheDefaultTakesUnder8PercentOf500Kbit) {
  const double load = CanLayout{}.worst_load(500e3);
  EXPECT_NEAR(load, (5 * 50 + 4 * 10) * 135 / 500e3, 1e-12);
  EXPECT_LT(load, 0.08);
}

// The manual's table: a row holds the identifier and the name of each frame.
TEST(Dbc, TheManualHasEveryFrameWithItsIdentifier) {
  std::ifstream manual(test::source_dir() + "/ipc/README.md");
  std::vector<std::string> rows;
  for (std::string line; std::getline(manual, line);) rows.push_back(line);
  for (const auto& [id, message] : dbc()) {
    std::ostringstream hex;
    hex << "0x" << std::hex << id;
    const auto is_row = [identifier = hex.str(), name = message.name](const std::string& row) {
      return row.find(identifier) != std::string::npos && row.find(name) != std::string::npos;
    };
    EXPECT_EQ(std::count_if(rows.begin(), rows.end(), is_row), 1) << hex.str() << " " << message.name;
  }
}

TEST(Dbc, SignalsDoNotOverlapAndStayWithinTheFrame) {
  for (const auto& [id, message] : dbc()) {
    std::set<unsigned> used;
    for (const auto& [name, signal] : message.signals) {
      for (unsigned bit = signal.start; bit < signal.start + signal.length; ++bit) {
        EXPECT_LT(bit, 64U) << message.name << " " << name;
        EXPECT_TRUE(used.insert(bit).second) << message.name << " " << name << " bit " << bit;
      }
    }
    EXPECT_TRUE(message.signals.contains("CRC") && message.signals.contains("Counter") &&
                message.signals.contains("AgeCoarse"))
        << message.name;
  }
}

TEST(Dbc, TheRangeOfEverySignalIsWhatItsBitsCanSay) {
  for (const auto& [id, message] : dbc()) {
    for (const auto& [name, signal] : message.signals) {
      const double most = std::ldexp(1.0, static_cast<int>(signal.length) - (signal.is_signed ? 1 : 0)) - 1;
      EXPECT_LE(signal.max, most * signal.factor + 1e-9) << name;
      EXPECT_GE(signal.min, signal.is_signed ? -most * signal.factor - 1e-9 : 0) << name;
      for (const auto& [raw, text] : signal.values) {  // no special value lies in the range
        if (text != "not available" && !text.starts_with("more than")) continue;
        const double value = static_cast<double>(raw) * signal.factor;
        EXPECT_TRUE(value > signal.max + 1e-9 || value < signal.min - 1e-9) << name << " " << raw;
      }
    }
  }
}

TEST(Dbc, NamesOfStatesAreThoseOfTheStatusMessage) {
  const auto& state = dbc().at(default_id(CanMessage::kStatus)).signals.at("State").values;
  EXPECT_EQ(state.at(status_t::STATE_STARTING), "starting");
  EXPECT_EQ(state.at(status_t::STATE_INITIALISING), "initialising");
  EXPECT_EQ(state.at(status_t::STATE_SETTLING), "settling");
  EXPECT_EQ(state.at(status_t::STATE_TRACKING), "tracking");
  EXPECT_EQ(state.at(status_t::STATE_DEGRADED), "degraded");
  EXPECT_EQ(state.at(status_t::STATE_LOST), "lost");
  EXPECT_EQ(state.at(status_t::STATE_RELOCALISING), "relocalising");
  EXPECT_EQ(state.at(status_t::STATE_NO_CAMERA), "no camera");
  EXPECT_EQ(state.at(status_t::STATE_STOPPED), "stopped");
  EXPECT_EQ(static_cast<int>(status_t::STATE_STOPPED), kCanStateStopped);
  const auto& scale = dbc().at(default_id(CanMessage::kStatus)).signals.at("ScaleState").values;
  EXPECT_EQ(scale.at(status_t::SCALE_UNKNOWN), "unknown");
  EXPECT_EQ(scale.at(status_t::SCALE_ASSUMED), "assumed");
  EXPECT_EQ(scale.at(status_t::SCALE_METRIC), "metric");
}

TEST(CanCodec, TheDbcGivesEverySignalBack) {
  std::mt19937_64 rng(1);
  CanEncoder encoder = whole_encoder();
  for (int i = 0; i < 3000; ++i) {
    const OdometryEpoch epoch = random_epoch(rng);
    expect_all(decoded(encoder.encode(epoch)), epoch);
    if (testing::Test::HasFailure()) break;
  }
}

TEST(CanCodec, EachFrameCountsAndThoseOfEveryEpochShareTheCounter) {
  std::mt19937_64 rng(2);
  CanEncoder encoder;
  const CanLayout layout;
  std::vector<E2eChecker> checkers;
  std::map<std::uint32_t, int> sent;
  for (std::size_t i = 0; i < kCanMessages; ++i)
    checkers.emplace_back(layout.data_id(static_cast<CanMessage>(i)));
  for (int n = 0; n < 40; ++n) {
    const CanEpoch epoch = encoder.encode(random_epoch(rng));
    EXPECT_EQ(epoch.frames()[0].id, layout.id(CanMessage::kStatus));
    EXPECT_LE(epoch.size(), 6U);  // those of every fifth epoch take turns
    for (const CanFrame& frame : epoch.frames()) {
      EXPECT_EQ(frame.size, 8);
      const std::size_t i = frame.id - layout.base_id;
      EXPECT_EQ(frame.data[1] & 0x0f, sent[frame.id] % 15);
      if (layout.every.at(i) == 1) {
        EXPECT_EQ(frame.data[1] & 0x0f, n % 15);
      }
      EXPECT_EQ(checkers.at(i).check(frame), E2eStatus::kOk);
      ++sent[frame.id];
    }
  }
  for (std::size_t i = 0; i < kCanMessages; ++i)
    EXPECT_EQ(sent[layout.id(static_cast<CanMessage>(i))], 40 / layout.every.at(i)) << i;
}

TEST(CanCodec, CanFdSendsTheSameInOneFrame) {
  CanLayout layout;
  layout.fd = true;
  const Messages messages = dbc_of(layout);
  ASSERT_EQ(messages.size(), 1U);
  const DbcMessage& message = messages.at(layout.base_id);
  EXPECT_EQ(message.size, 64U);
  EXPECT_EQ(message.e2e_profile, 5);
  EXPECT_EQ(message.frame_format, 14);
  EXPECT_EQ(message.data_id, 0x4669);
  std::set<unsigned> used;
  for (const auto& [name, signal] : message.signals) {
    for (unsigned bit = signal.start; bit < signal.start + signal.length; ++bit) {
      EXPECT_LT(bit, 512U) << name;
      EXPECT_TRUE(used.insert(bit).second) << name;
    }
  }
  std::mt19937_64 rng(8);
  CanEncoder encoder(layout);
  for (int n = 0; n < 600; ++n) {
    OdometryEpoch epoch = random_epoch(rng);
    epoch.send_time_us = 123'456'789'000 + 20'000 * n;
    const CanEpoch frames = encoder.encode(epoch);
    ASSERT_EQ(frames.size(), 1U);
    const CanFrame& frame = frames.frames()[0];
    ASSERT_EQ(frame.size, 64);
    EXPECT_EQ(frame.data[2], n % 256);
    EXPECT_EQ(frame.data[0] | frame.data[1] << 8, e2e5_crc(frame, 0x4669));
    auto got = decoded(frames, messages);
    EXPECT_EQ(got.at("SendTime"), static_cast<double>((epoch.send_time_us / 1000) % 65536));
    got["AgeCoarse"] = epoch.age_s;  // classic frames alone have it
    expect_all(got, epoch);
    if (HasFailure()) break;
  }
}

void expect_available(const std::map<std::string, double>& got, const std::vector<std::string>& names,
                      bool want) {
  for (const std::string& name : names) EXPECT_EQ(!std::isnan(got.at(name)), want) << name;
}

const std::vector<std::string> kPositionSignals = {"PositionX",      "PositionY",      "PositionZ",
                                                   "SigmaPositionX", "SigmaPositionY", "SigmaPositionZ"};
const std::vector<std::string> kAngleSignals = {"Heading",      "Roll",      "Pitch",
                                                "SigmaHeading", "SigmaRoll", "SigmaPitch"};
const std::vector<std::string> kVelocitySignals = {"VelocityX",      "VelocityY",      "VelocityZ",
                                                   "SigmaVelocityX", "SigmaVelocityY", "SigmaVelocityZ"};
const std::vector<std::string> kYawRateSignals = {"YawRate", "SigmaYawRate"};

TEST(CanCodec, WithoutScaleNoPositionAndNoVelocity) {
  std::mt19937_64 rng(3);
  OdometryEpoch epoch = random_epoch(rng);
  for (const std::uint8_t scale :
       {std::uint8_t{0}, std::uint8_t{3}}) {  // unknown, and one that does not exist
    epoch.scale_state = scale;
    const auto got = decoded(whole_encoder().encode(epoch));
    expect_available(got, kPositionSignals, false);
    expect_available(got, kVelocitySignals, false);
    expect_available(got, kAngleSignals, true);
    expect_available(got, kYawRateSignals, true);
    EXPECT_EQ(got.at("ScaleState"), scale);
    EXPECT_FALSE(std::isnan(got.at("Age")));
  }
}

TEST(CanCodec, AnInvalidPoseSendsNoPoseButItsAgeAndState) {
  std::mt19937_64 rng(4);
  OdometryEpoch epoch = random_epoch(rng);
  epoch.pose_valid = false;
  epoch.state = status_t::STATE_LOST;
  const auto got = decoded(whole_encoder().encode(epoch));
  expect_available(got, kPositionSignals, false);
  expect_available(got, kAngleSignals, false);
  expect_available(got, kVelocitySignals, true);
  EXPECT_EQ(got.at("PoseValid"), 0);
  EXPECT_EQ(got.at("State"), 5);
  EXPECT_NEAR(got.at("Age"), epoch.age_s, 1e-4);
  epoch.velocity_valid = false;
  const auto nothing = decoded(whole_encoder().encode(epoch));
  expect_available(nothing, kVelocitySignals, false);
  expect_available(nothing, kYawRateSignals, false);
}

TEST(CanCodec, BeyondItsRangeAValueIsNotAvailableAndNeverWraps) {
  OdometryEpoch epoch;
  epoch.pose_valid = epoch.velocity_valid = true;
  epoch.scale_state = status_t::SCALE_METRIC;
  epoch.position_m = {83886.07, -83886.07, 83886.08};
  auto got = decoded(whole_encoder().encode(epoch));
  EXPECT_NEAR(got.at("PositionX"), 83886.07, 1e-6);
  EXPECT_NEAR(got.at("PositionY"), -83886.07, 1e-6);
  EXPECT_TRUE(std::isnan(got.at("PositionZ")));
  for (const double wild : {-83886.08, 167772.16, 1e9, -1e30, 1e300, kInfinity, -kInfinity, kNan}) {
    epoch.position_m = {wild, 1, 2};
    epoch.velocity_m_s = {1, wild, 2};
    epoch.yaw_rate_rad_s = wild;
    got = decoded(whole_encoder().encode(epoch));
    EXPECT_TRUE(std::isnan(got.at("PositionX"))) << wild;
    EXPECT_EQ(got.at("PositionY"), 1) << wild;
    EXPECT_TRUE(std::isnan(got.at("VelocityY"))) << wild;
    EXPECT_TRUE(std::isnan(got.at("YawRate"))) << wild;
  }
}

TEST(CanCodec, AnglesAreWrapped) {
  OdometryEpoch epoch;
  epoch.pose_valid = true;
  for (const double turns : {-3.0, -1.0, 0.0, 1.0, 20.0}) {
    epoch.heading_rad = (170 + 360 * turns) * kRadians;
    epoch.roll_rad = (-179.996 + 360 * turns) * kRadians;
    const auto got = decoded(whole_encoder().encode(epoch));
    EXPECT_NEAR(got.at("Heading"), 170, 0.0051);
    EXPECT_NEAR(got.at("Roll"), -180, 0.0051);
  }
  epoch.heading_rad = kNan;
  EXPECT_TRUE(std::isnan(decoded(whole_encoder().encode(epoch)).at("Heading")));
}

TEST(CanCodec, AgesAndDeviationsSaturateAndTellWhatTheyDoNotKnow) {
  OdometryEpoch epoch;
  epoch.pose_valid = epoch.velocity_valid = true;
  epoch.scale_state = status_t::SCALE_METRIC;
  const DbcMessage& status = dbc().at(default_id(CanMessage::kStatus));
  const DbcMessage& sigma = dbc().at(default_id(CanMessage::kPositionSigma));
  const auto text = [](const DbcSignal& signal, const CanFrame& frame) {
    const auto it = signal.values.find(signal.raw(frame));
    return it == signal.values.end() ? std::string() : it->second;
  };
  epoch.age_s = 100;
  epoch.sigma_position_m = {1e9, -1, kNan};
  const CanEpoch late = whole_encoder().encode(epoch);
  EXPECT_EQ(text(status.signals.at("Age"), late.frames()[0]), "more than 6.5533 s");
  EXPECT_EQ(text(status.signals.at("AgeCoarse"), late.frames()[0]), "more than 0.13 s");
  EXPECT_EQ(text(sigma.signals.at("SigmaPositionX"), late.frames()[5]), "more than 65.533 m");
  EXPECT_EQ(text(sigma.signals.at("SigmaPositionY"), late.frames()[5]), "not available");
  EXPECT_EQ(text(sigma.signals.at("SigmaPositionZ"), late.frames()[5]), "not available");
  for (const double unknown : {-0.001, kNan, kInfinity}) {
    epoch.age_s = unknown;
    const auto got = decoded(whole_encoder().encode(epoch));
    EXPECT_TRUE(std::isnan(got.at("Age")) && std::isnan(got.at("AgeCoarse"))) << unknown;
  }
}

TEST(CanCodec, EulerAnglesOfKnownRotations) {
  const double h = std::sqrt(0.5);
  EXPECT_NEAR(euler_angles({h, 0, 0, h}).heading_rad, std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(euler_angles({h, h, 0, 0}).roll_rad, std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(euler_angles({h, 0, h, 0}).pitch_rad, std::numbers::pi / 2, 1e-7);
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);
  for (int i = 0; i < 200; ++i) {
    const double a = uniform(rng), b = uniform(rng), c = uniform(rng);
    // Rz(a) Ry(b) Rx(c) as a product of quaternions.
    const double ca = std::cos(a / 2), sa = std::sin(a / 2), cb = std::cos(b / 2), sb = std::sin(b / 2),
                 cc = std::cos(c / 2), sc = std::sin(c / 2);
    const EulerAngles got = euler_angles({ca * cb * cc + sa * sb * sc, ca * cb * sc - sa * sb * cc,
                                          ca * sb * cc + sa * cb * sc, sa * cb * cc - ca * sb * sc});
    EXPECT_NEAR(got.heading_rad, a, 1e-9);
    EXPECT_NEAR(got.pitch_rad, b, 1e-9);
    EXPECT_NEAR(got.roll_rad, c, 1e-9);
  }
}

// The independent decoder: npm's candied, which gets the DBC file and the log and nothing else.
TEST(CanCodec, AnIndependentDecoderGivesEverySignalBack) {
  const test::Scratch scratch;
  std::mt19937_64 rng(6);
  std::vector<OdometryEpoch> epochs;
  CanEncoder encoder = whole_encoder();
  CandumpWriter writer(scratch.path("a.candump"), "can0");
  for (int i = 0; i < 200; ++i) {
    epochs.push_back(random_epoch(rng));
    epochs.back().scale_state = i % 4 == 0 ? 0 : 1;
    writer.write(1000 * i, encoder.encode(epochs.back()).frames());
  }
  writer.close();
  const std::string command = test::source_dir() + "/tests/ipc/candied/decode " + kDbcPath + " " +
                              scratch.path("a.candump") + " > " + scratch.path("a.csv");
  const int status = std::system(command.c_str());
  if (WIFEXITED(status) && WEXITSTATUS(status) == 77) GTEST_SKIP() << "no node or npm on this machine";
  ASSERT_EQ(status, 0) << command;

  std::vector<std::map<std::string, double>> got(epochs.size());
  std::ifstream csv(scratch.path("a.csv"));
  std::string line;
  ASSERT_TRUE(std::getline(csv, line));
  while (std::getline(csv, line)) {
    std::istringstream fields(line);
    std::string utime, message, signal, value;
    std::getline(fields, utime, ',');
    std::getline(fields, message, ',');
    std::getline(fields, signal, ',');
    std::getline(fields, value, ',');
    got.at(std::stoul(utime) / 1000)[signal] = value.empty() ? kNan : std::stod(value);
  }
  for (std::size_t i = 0; i < epochs.size(); ++i) {
    if (epochs[i].scale_state != 0) {
      expect_all(got[i], epochs[i]);
    } else {
      expect_available(got[i], kPositionSignals, false);
      expect_available(got[i], kVelocitySignals, false);
      expect_available(got[i], kAngleSignals, true);
    }
    EXPECT_EQ(got[i].at("Counter"), static_cast<double>(i % 15));
    if (testing::Test::HasFailure()) break;
  }
}

}  // namespace
}  // namespace farpoint::ipc
