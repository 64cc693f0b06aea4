// SPDX-License-Identifier: Apache-2.0
#include "ipc/mavlink/messages.h"

#include <bit>
#include <cassert>
#include <cstring>

namespace farpoint::ipc::mavlink {
namespace {

static_assert(std::endian::native == std::endian::little, "the wire is little-endian");

// Fields in the order of the wire: the largest types first, extensions behind them as they are declared.
template <std::size_t Bytes>
class Payload {
 public:
  template <typename T>
  Payload& add(const T& value) {
    assert(size_ + sizeof(T) <= Bytes);
    std::memcpy(bytes_.data() + size_, &value, sizeof(T));
    size_ += sizeof(T);
    return *this;
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const {
    assert(size_ == Bytes);
    return bytes_;
  }

 private:
  std::array<std::uint8_t, Bytes> bytes_{};
  std::size_t size_ = 0;
};

template <typename T>
T read(const Received& received, std::size_t offset) {
  T value;
  std::memcpy(&value, received.payload.data() + offset, sizeof(T));
  return value;
}

}  // namespace

Frame encode(const Odometry& o, const Sender& sender, std::uint8_t sequence) {
  Payload<kOdometry.payload_bytes> payload;
  payload.add(o.time_us).add(o.position_m).add(o.orientation_wxyz).add(o.velocity_m_s).add(o.rates_rad_s);
  payload.add(o.pose_covariance).add(o.velocity_covariance).add(o.frame).add(o.child_frame);
  payload.add(o.reset_counter).add(o.estimator).add(o.quality);
  return {kOdometry, sender, sequence, payload.bytes()};
}

Frame encode(const Heartbeat& heartbeat, const Sender& sender, std::uint8_t sequence) {
  constexpr std::uint32_t kCustomMode = 0;
  constexpr std::uint8_t kBaseMode = 0, kVersion = 3;
  Payload<kHeartbeat.payload_bytes> payload;
  payload.add(kCustomMode).add(kTypeOnboardController).add(kAutopilotInvalid).add(kBaseMode);
  payload.add(heartbeat.state).add(kVersion);
  return {kHeartbeat, sender, sequence, payload.bytes()};
}

Frame encode(const Timesync& timesync, const Sender& sender, std::uint8_t sequence) {
  Payload<kTimesync.payload_bytes> payload;
  payload.add(timesync.tc1_ns)
      .add(timesync.ts1_ns)
      .add(timesync.target_system)
      .add(timesync.target_component);
  return {kTimesync, sender, sequence, payload.bytes()};
}

Timesync decode_timesync(const Received& received) {
  return {read<std::int64_t>(received, 0), read<std::int64_t>(received, 8), received.payload[16],
          received.payload[17]};
}

}  // namespace farpoint::ipc::mavlink
