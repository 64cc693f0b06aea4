// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/composed_log.h"

#include <algorithm>
#include <array>

#include "ipc/channels.h"
#include "ipc/log.h"

namespace farpoint::fuzz {
namespace {

struct Channel {
  std::string_view name;
  std::int64_t fingerprint;
};

std::span<const Channel> channels() {
  static const std::array all = {
      Channel{"CAMERA_0", image_t::getHash()},
      Channel{"CAMERA_1", image_t::getHash()},
      Channel{ipc::kImuChannel, imu_t::getHash()},
      Channel{ipc::kWheelsChannel, wheels_t::getHash()},
      Channel{ipc::kCalibrationChannel, calibration_t::getHash()},
      Channel{ipc::kGroundTruthChannel, ground_truth_t::getHash()},
      Channel{ipc::kPoseChannel, pose_t::getHash()},
      Channel{ipc::kTimingChannel, timing_t::getHash()},
      Channel{ipc::kStatusChannel, status_t::getHash()},
      Channel{ipc::kMapChannel, map_t::getHash()},
      Channel{ipc::kTrajectoryChannel, trajectory_t::getHash()},
      Channel{ipc::kLandmarksChannel, landmarks_t::getHash()},
      Channel{ipc::kSummaryChannel, summary_t::getHash()},
      Channel{"FOREIGN", 0x123456789abcdefLL},
  };
  return all;
}

constexpr std::size_t kFingerprintBytes = 8, kHeadBytes = 3;

void put(std::uint64_t value, int bytes, Bytes* out) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
    out->push_back(static_cast<std::uint8_t>(value >> shift));
}

void put_event(std::int64_t number, const Channel& channel, ByteView payload, Bytes* log) {
  put(ipc::LogReader::kSyncWord, 4, log);
  put(static_cast<std::uint64_t>(number), 8, log);
  put(0, 8, log);
  put(channel.name.size(), 4, log);
  put(kFingerprintBytes + payload.size(), 4, log);
  log->insert(log->end(), channel.name.begin(), channel.name.end());
  put(static_cast<std::uint64_t>(channel.fingerprint), 8, log);
  log->insert(log->end(), payload.begin(), payload.end());
}

}  // namespace

// An event of a composed input: number of the channel, length of the payload (two bytes), payload.
Bytes log_of(ByteView input) {
  if (input.empty()) return {};
  const ByteView rest = input.subspan(1);
  if (input[0] == 'R') return {rest.begin(), rest.end()};
  Bytes log;
  std::int64_t number = 0;
  for (std::size_t at = 0; at + kHeadBytes <= rest.size();) {
    const Channel& channel = channels()[rest[at] % channels().size()];
    const std::size_t wanted = std::size_t{rest[at + 1]} << 8 | rest[at + 2];
    const std::size_t bytes = std::min(wanted, rest.size() - at - kHeadBytes);
    put_event(number++, channel, rest.subspan(at + kHeadBytes, bytes), &log);
    at += kHeadBytes + bytes;
  }
  return log;
}

void EventList::add_bytes(std::string_view channel, ByteView encoded) {
  const auto found =
      std::find_if(channels().begin(), channels().end(), [&](const Channel& c) { return c.name == channel; });
  require(found != channels().end() && encoded.size() - kFingerprintBytes < 65536, "a seed's event");
  const ByteView payload = encoded.subspan(kFingerprintBytes);
  input_.push_back(static_cast<std::uint8_t>(found - channels().begin()));
  put(payload.size(), 2, &input_);
  input_.insert(input_.end(), payload.begin(), payload.end());
}

}  // namespace farpoint::fuzz
