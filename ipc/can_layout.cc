// SPDX-License-Identifier: Apache-2.0
#include "ipc/can_layout.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>
#include <vector>

namespace farpoint::ipc {
namespace {

using M = CanMessage;
using K = CanSignalKind;

struct MessageInfo {
  const char* key;
  const char* name;
  const char* comment;
};

constexpr std::array<MessageInfo, kCanMessages> kMessages{{
    {"status", "FARPOINT_STATUS",
     "State and age of the pose. First frame of every epoch, whatever the state; the others follow when the "
     "bus "
     "has taken it. Use another frame of an epoch only where it came within one cycle after the status "
     "frame."},
    {"position_xy", "FARPOINT_POSITION_XY", "Position of the body, predicted to the time of sending."},
    {"position_z", "FARPOINT_POSITION_Z_YAW_RATE", "Height of the body and its turning."},
    {"attitude", "FARPOINT_ATTITUDE", "Orientation of the body: R = Rz(Heading) Ry(Pitch) Rx(Roll)."},
    {"velocity", "FARPOINT_VELOCITY", "Velocity of the body in its own axes."},
    {"sigmas", "FARPOINT_POSITION_SIGMA",
     "Standard deviations of the position: its noise, and its drift since the reset in frame odom."},
    {"sigmas", "FARPOINT_ATTITUDE_SIGMA",
     "Standard deviations of the orientation: its noise, and its drift since the reset in frame odom."},
    {"sigmas", "FARPOINT_VELOCITY_SIGMA", "Standard deviations of velocity and yaw rate."},
    {"diagnosis", "FARPOINT_DIAGNOSIS", "What the pose rests on. Changes rarely."},
}};

constexpr const char* kNotAvailable24 = "-8388608 \"not available\"";
constexpr const char* kNotAvailable16 = "-32768 \"not available\"";
constexpr const char* kYesNo = "0 \"no\" 1 \"yes\" 3 \"not available\"";
constexpr const char* kSensor =
    "0 \"none\" 1 \"starting\" 2 \"used\" 3 \"contradicts the images\" 4 \"lost\" 7 \"not available\"";

constexpr CanSignalInfo code(M message, const char* name, unsigned start, unsigned length, double max,
                             const char* values, const char* comment, std::int64_t at_start = 0,
                             const char* unit = "") {
  return {message, name, start, length, K::kCode, 1.0, 0.0, max, unit, at_start, values, comment};
}
constexpr CanSignalInfo number(M message, const char* name, unsigned start, unsigned length, double step,
                               double max, const char* unit, const char* comment) {
  const bool wide = length == 24;
  return {message,
          name,
          start,
          length,
          K::kSigned,
          step,
          -max,
          max,
          unit,
          wide ? -8388608 : -32768,
          wide ? kNotAvailable24 : kNotAvailable16,
          comment};
}
constexpr CanSignalInfo magnitude(M message, const char* name, unsigned start, unsigned length, double step,
                                  double max, const char* unit, const char* values,
                                  const char* comment = "") {
  return {message,           name,   start,  length, K::kMagnitude, step, 0.0, max, unit,
          (1 << length) - 1, values, comment};
}
constexpr CanSignalInfo sigma16(M message, const char* name, unsigned start, const char* unit,
                                const char* values) {
  return magnitude(message, name, start, 16, 0.001, 65.533, unit, values);
}

constexpr const char* kSigma_m = "65534 \"more than 65.533 m\" 65535 \"not available\"";
constexpr const char* kSigma_deg = "65534 \"more than 65.533 deg\" 65535 \"not available\"";
constexpr const char* kSigma_m_s = "4094 \"more than 40.93 m/s\" 4095 \"not available\"";
constexpr const char* kSigma_deg_s = "4094 \"more than 40.93 deg/s\" 4095 \"not available\"";

constexpr std::array<CanSignalInfo, kCanSignals> kSignals{{
    magnitude(
        M::kStatus, "Age", 16, 16, 0.0001, 6.5533, "s",
        "65534 \"more than 6.5533 s\" 65535 \"not available\"",
        "Time from mid-exposure of the image that the pose rests on to sending. The pose is predicted to the "
        "time of sending already: do not extrapolate it by this age again."),
    code(M::kStatus, "State", 32, 4, 15,
         "0 \"starting\" 1 \"initialising\" 2 \"settling\" 3 \"tracking\" 4 \"degraded\" 5 \"lost\" "
         "6 \"relocalising\" 7 \"no camera\" 8 \"stopped\"",
         "Only tracking and degraded poses are valid. Stopped: the last epoch before an orderly end."),
    code(M::kStatus, "ScaleState", 36, 2, 3, "0 \"unknown\" 1 \"assumed\" 2 \"metric\"",
         "While it is unknown, position and velocity are not available."),
    code(M::kStatus, "PoseValid", 38, 1, 1, "0 \"invalid\" 1 \"valid\"",
         "Position (with a scale) and angles may be used. 0 from 0.25 s after the image's time on."),
    code(M::kStatus, "VelocityValid", 39, 1, 1, "0 \"invalid\" 1 \"valid\"",
         "Velocity (with a scale) and yaw rate may be used."),
    code(M::kStatus, "ResetCounter", 40, 8, 255, "",
         "Counts, modulo 256, how often position or its unit started anew. A change means another origin."),
    code(M::kStatus, "BootCounter", 48, 8, 255, "0 \"replay\"",
         "Counts starts of the daemon, 1 to 255, then 1 again. A change means another origin."),
    code(M::kStatus, "FromVision", 56, 1, 1, "0 \"dead reckoning\" 1 \"vision\"",
         "1: the image is at most one frame period old. 0: it is older, the pose is carried on without "
         "vision."),
    code(M::kStatus, "Frame", 57, 1, 1, "0 \"odom\" 1 \"map\"",
         "Frame of position and heading: odom never jumps, map may."),
    code(M::kStatus, "Predicted", 58, 1, 1, "0 \"measured\" 1 \"predicted\"",
         "1: the pose was carried from the image's time to the time of sending by its velocity."),
    code(M::kStatus, "Reason", 59, 5, 30,
         "0 \"none\" 1 \"no image yet\" 2 \"no camera\" 3 \"no pose in time\" 4 \"map not started\" "
         "5 \"map settling\" 6 \"tracking lost\" 7 \"place not recognised yet\" 8 \"few landmarks\" "
         "9 \"calibration contradicted\" 10 \"number out of range\" 11 \"stopped\" 12 \"scale lost\" "
         "13 \"motion not observed\" 14 \"no inertial sensor\" 15 \"no wheel speeds\" 16 \"view blocked\" "
         "17 \"too dark\" 18 \"few matches\" 19 \"standing\" 20 \"turning without moving\" "
         "21 \"little parallax\" 22 \"ambiguous start\" 23 \"no common motion\" 24 \"residual field\" "
         "25 \"moving scene\" 26 \"large residuals\" 27 \"unsound before\" 28 \"landmarks disagree\" "
         "29 \"frozen image\" 31 \"not available\"",
         "Why the state is not tracking. 12 to 15 are reserved for later versions; treat others as unknown.",
         31),
    number(M::kPositionXy, "PositionX", 16, 24, 0.01, 83886.07, "m", "Forward at the origin."),
    number(M::kPositionXy, "PositionY", 40, 24, 0.01, 83886.07, "m", "Left at the origin."),
    number(M::kPositionZYawRate, "PositionZ", 16, 24, 0.01, 83886.07, "m", "Up at the origin."),
    number(M::kPositionZYawRate, "YawRate", 40, 16, 0.05, 1638.35, "deg/s",
           "About the body's z axis, left positive."),
    number(M::kAttitude, "Heading", 16, 16, 0.01, 180, "deg", "About z, left positive."),
    number(M::kAttitude, "Roll", 32, 16, 0.01, 180, "deg", "About x, right side down positive."),
    number(M::kAttitude, "Pitch", 48, 16, 0.01, 90, "deg", "About y, nose down positive."),
    number(M::kVelocity, "VelocityX", 16, 16, 0.005, 163.835, "m/s", "Forward."),
    number(M::kVelocity, "VelocityY", 32, 16, 0.005, 163.835, "m/s", "Left."),
    number(M::kVelocity, "VelocityZ", 48, 16, 0.005, 163.835, "m/s", "Up."),
    sigma16(M::kPositionSigma, "SigmaPositionX", 16, "m", kSigma_m),
    sigma16(M::kPositionSigma, "SigmaPositionY", 32, "m", kSigma_m),
    sigma16(M::kPositionSigma, "SigmaPositionZ", 48, "m", kSigma_m),
    sigma16(M::kAttitudeSigma, "SigmaHeading", 16, "deg", kSigma_deg),
    sigma16(M::kAttitudeSigma, "SigmaRoll", 32, "deg", kSigma_deg),
    sigma16(M::kAttitudeSigma, "SigmaPitch", 48, "deg", kSigma_deg),
    magnitude(M::kVelocitySigma, "SigmaVelocityX", 16, 12, 0.01, 40.93, "m/s", kSigma_m_s),
    magnitude(M::kVelocitySigma, "SigmaVelocityY", 28, 12, 0.01, 40.93, "m/s", kSigma_m_s),
    magnitude(M::kVelocitySigma, "SigmaVelocityZ", 40, 12, 0.01, 40.93, "m/s", kSigma_m_s),
    magnitude(M::kVelocitySigma, "SigmaYawRate", 52, 12, 0.01, 40.93, "deg/s", kSigma_deg_s),
    code(M::kDiagnosis, "Quality", 16, 8, 100, "255 \"not available\"", "0 none, 100 best.", 255, "%"),
    code(M::kDiagnosis, "MapId", 24, 8, 255, "",
         "Modulo 256. Every map has its own origin; in frame odom ResetCounter alone tells."),
    code(M::kDiagnosis, "Levelled", 32, 2, 1, kYesNo,
         "Whether z of the frame is up. No: roll and pitch are against the first pose, not against gravity.",
         3),
    code(M::kDiagnosis, "BodyIsCamera", 34, 2, 1, kYesNo,
         "Whether the body stands at the camera: the calibration names no body, or the scale is unknown.", 3),
    code(M::kDiagnosis, "ScaleSource", 36, 4, 14,
         "0 \"none\" 1 \"assumed\" 2 \"second camera\" 3 \"inertial\" 4 \"wheels\" 5 \"several\" "
         "6 \"loaded map\" 15 \"not available\"",
         "Where metres come from. 3, 5 and 6 are reserved for later versions.", 15),
    magnitude(M::kDiagnosis, "ScaleSigma", 40, 12, 0.001, 4.093, "",
              "4094 \"more than 4.093\" 4095 \"not available\"",
              "Standard deviation of the scale, relative. It comes on top of that of the position."),
    code(M::kDiagnosis, "Imu", 52, 3, 6, kSensor, "Inertial sensor. Reserved: none in this version.", 7),
    code(M::kDiagnosis, "Wheels", 55, 3, 6, kSensor,
         "Wheel speeds in the pose. 1: there are samples, which the images have not judged yet.", 7),
    code(M::kDiagnosis, "Layout", 58, 6, 63, "", "Number of this layout: 2.", 2),
    code(M::kFdOnly, "SendTime", 16, 16, 65535, "",
         "Time of sending on the daemon's clock, ms modulo 65536. A frame that comes late by the receiver's "
         "clock "
         "was held up on the bus: do not use it.",
         0, "ms"),
}};

std::vector<std::size_t> messages_named(const std::string& key) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < kMessages.size(); ++i)
    if (key == kMessages.at(i).key) found.push_back(i);
  return found;
}

std::string all_keys() {
  std::string keys;
  for (std::size_t i = 0; i < kMessages.size(); ++i) {
    if (messages_named(kMessages.at(i).key).front() == i)
      keys += (keys.empty() ? "" : ", ") + std::string(kMessages.at(i).key);
  }
  return keys;
}

// Of "NAME/N"; 1 without a slash.
std::optional<int> divider_of(const std::string& word) {
  constexpr int kMost = 100;
  const std::size_t slash = word.find('/');
  if (slash == std::string::npos) return 1;
  int divider = 0;
  const char* last = word.data() + word.size();
  const auto [end, error] = std::from_chars(word.data() + slash + 1, last, divider);
  if (error != std::errc() || end != last || divider < 1 || divider > kMost) return std::nullopt;
  return divider;
}

}  // namespace

const char* name_of(CanMessage message) {
  return kMessages.at(static_cast<std::size_t>(message)).name;
}
const char* comment_of(CanMessage message) {
  return kMessages.at(static_cast<std::size_t>(message)).comment;
}

std::span<const CanSignalInfo, kCanSignals> can_signals() {
  return kSignals;
}
const CanSignalInfo& info_of(CanSignal signal) {
  return kSignals[static_cast<std::size_t>(signal)];
}

std::uint32_t CanLayout::id(CanMessage message) const {
  return base_id + static_cast<std::uint32_t>(message);
}
std::uint16_t CanLayout::data_id(CanMessage message) const {
  return static_cast<std::uint16_t>(base_data_id + static_cast<std::uint16_t>(message));
}

bool CanLayout::is_due(CanMessage message, std::uint64_t epoch) const {
  const int divider = period_of(message);
  return divider > 0 &&
         (epoch + static_cast<std::uint64_t>(message)) % static_cast<std::uint64_t>(divider) == 0;
}

std::size_t CanLayout::most_frames() const {
  if (fd) return 1;
  return static_cast<std::size_t>(std::count_if(every.begin(), every.end(), [](int n) { return n > 0; }));
}

double CanLayout::worst_load(double bits_per_s) const {
  // Bits of a frame of 8 bytes with most stuffing and the gap behind it.
  constexpr double kStandardBits = 135.0, kExtendedBits = 160.0;
  double frames_per_s = 0.0;
  for (const int divider : every) frames_per_s += divider > 0 ? rate_hz / divider : 0.0;
  return frames_per_s * (extended ? kExtendedBits : kStandardBits) / bits_per_s;
}

std::string parse_can_messages(const std::string& text, std::array<int, kCanMessages>* every) {
  std::array<int, kCanMessages> found{};
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::string key = word.substr(0, word.find('/'));
    const std::vector<std::size_t> named = messages_named(key);
    if (named.empty()) return "'" + key + "' is no message, expected some of " + all_keys();
    const std::optional<int> divider = divider_of(word);
    if (!divider) return "'" + word + "', expected a divider of 1 to 100 behind the slash";
    for (const std::size_t i : named) {
      if (found.at(i) != 0) return "'" + key + "' comes twice, expected it once";
      found.at(i) = *divider;
    }
  }
  if (found[0] != 1) return "status is missing or has a divider, expected it with every epoch";
  *every = found;
  return {};
}

}  // namespace farpoint::ipc
