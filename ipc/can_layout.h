// SPDX-License-Identifier: Apache-2.0
// Layout 2 of the odometry on the bus: messages, signals, identifiers, cycles. The encoder and the DBC writer
// read the same table, so that both always agree.
//
// Classic CAN: up to nine frames of 8 bytes an epoch, each under E2E profile 1. Bits 0..15 hold CRC, counter
// and coarse age, bits 16..63 the signals.
// CAN FD: one frame of 64 bytes an epoch under E2E profile 5. Bytes 0..2 hold CRC and counter. The signal
// bytes of message i follow at byte 3 + 6 i, in the same order as in its classic frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace farpoint::ipc {

// In the order of sending within an epoch.
enum class CanMessage : std::uint8_t {
  kStatus = 0,
  kPositionXy,
  kPositionZYawRate,
  kAttitude,
  kVelocity,
  kPositionSigma,
  kAttitudeSigma,
  kVelocitySigma,
  kDiagnosis,
  kFdOnly,  // no classic frame: what only CAN FD has room for
};
inline constexpr std::size_t kCanMessages = 9;  // classic frames
inline constexpr std::size_t kCanFdBytes = 64;
inline constexpr unsigned kCanHeadBits = 16;    // of a classic frame
inline constexpr unsigned kCanFdHeadBits = 24;  // of the CAN FD frame
inline constexpr unsigned kCanPartBits = 48;    // signals of one message
inline constexpr int kCanLayoutNumber = 2;      // in VERSION of the DBC and signal Layout

// Name in the DBC: "FARPOINT_STATUS", ...
[[nodiscard]] const char* name_of(CanMessage message);
[[nodiscard]] const char* comment_of(CanMessage message);

// What a configuration chooses. Defaults are those of config/farpoint.yaml.
struct CanLayout {
  std::uint32_t base_id = 0x680;  // a frame's identifier: base + message; CAN FD: base
  bool extended = false;          // identifiers of 29 bits
  // A frame's E2E Data ID: base + message; CAN FD: base + kCanMessages.
  std::uint16_t base_data_id = 0x4660;
  bool fd = false;
  double rate_hz = 50.0;  // epochs a second
  // Classic: the message goes out with every Nth epoch, 0: never.
  std::array<int, kCanMessages> every{1, 1, 1, 1, 1, 5, 5, 5, 5};

  [[nodiscard]] std::uint32_t id(CanMessage message) const;
  [[nodiscard]] std::uint16_t data_id(CanMessage message) const;
  [[nodiscard]] std::uint16_t fd_data_id() const {
    return static_cast<std::uint16_t>(base_data_id + kCanMessages);
  }
  [[nodiscard]] int period_of(CanMessage message) const { return every[static_cast<std::size_t>(message)]; }
  // Whether the message goes out with this epoch. Messages of the same divider take turns.
  [[nodiscard]] bool is_due(CanMessage message, std::uint64_t epoch) const;
  // Most frames in one epoch.
  [[nodiscard]] std::size_t most_frames() const;
  // Longest share of a classic bus that the frames take, worst stuffing included. Precondition: !fd.
  [[nodiscard]] double worst_load(double bits_per_s) const;
};

// Reads "status position_xy attitude/5": the messages, each with its divider (1 to 100, default 1); those
// that are missing never go out. Empty on success, else what was expected. *every is unchanged on failure.
[[nodiscard]] std::string parse_can_messages(const std::string& text, std::array<int, kCanMessages>* every);

enum class CanSignal : std::uint8_t {
  kAge,
  kState,
  kScaleState,
  kPoseValid,
  kVelocityValid,
  kResetCounter,
  kBootCounter,
  kFromVision,
  kFrame,
  kPredicted,
  kReason,
  kPositionX,
  kPositionY,
  kPositionZ,
  kYawRate,
  kHeading,
  kRoll,
  kPitch,
  kVelocityX,
  kVelocityY,
  kVelocityZ,
  kSigmaPositionX,
  kSigmaPositionY,
  kSigmaPositionZ,
  kSigmaHeading,
  kSigmaRoll,
  kSigmaPitch,
  kSigmaVelocityX,
  kSigmaVelocityY,
  kSigmaVelocityZ,
  kSigmaYawRate,
  kQuality,
  kMapId,
  kLevelled,
  kBodyIsCamera,
  kScaleSource,
  kScaleSigma,
  kImu,
  kWheels,
  kLayout,
  kSendTime,
};
inline constexpr std::size_t kCanSignals = static_cast<std::size_t>(CanSignal::kSendTime) + 1;

enum class CanSignalKind : std::uint8_t {
  kCode,       // a whole number as it is
  kSigned,     // the most negative number says 'not available'
  kMagnitude,  // all ones say 'not available', one less 'more than can be said'
};

struct CanSignalInfo {
  CanMessage message = CanMessage::kStatus;
  const char* name = "";
  unsigned start = 0;  // bit in the classic frame, Intel order
  unsigned length = 1;
  CanSignalKind kind = CanSignalKind::kCode;
  double step = 1.0;  // physical value of one raw unit
  double min = 0.0, max = 0.0;
  const char* unit = "";
  std::int64_t at_start = 0;  // raw value before the first frame came
  const char* values = "";    // value table in DBC syntax, may be empty
  const char* comment = "";   // may be empty

  [[nodiscard]] unsigned fd_start() const {
    return start - kCanHeadBits + kCanFdHeadBits + kCanPartBits * static_cast<unsigned>(message);
  }
};

// By CanSignal.
[[nodiscard]] std::span<const CanSignalInfo, kCanSignals> can_signals();
[[nodiscard]] const CanSignalInfo& info_of(CanSignal signal);

}  // namespace farpoint::ipc
