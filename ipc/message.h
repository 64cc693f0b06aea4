// SPDX-License-Identifier: Apache-2.0
// Decodes and encodes LCM messages.
//
// lcm-gen's decoders trust counts and string lengths: a damaged one makes them allocate gigabytes or read
// beyond the buffer. decode() therefore checks every length along the type's layout before it calls the
// generated code. A test derives the layouts from ipc/types/*.lcm.
#pragma once

#include <cstdint>
#include <new>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "farpoint/calibration_t.hpp"
#include "farpoint/ground_truth_t.hpp"
#include "farpoint/image_t.hpp"
#include "farpoint/imu_t.hpp"
#include "farpoint/landmarks_t.hpp"
#include "farpoint/map_from_odom_t.hpp"
#include "farpoint/map_t.hpp"
#include "farpoint/odometry_t.hpp"
#include "farpoint/pose_t.hpp"
#include "farpoint/schedule_t.hpp"
#include "farpoint/simulation_t.hpp"
#include "farpoint/status_t.hpp"
#include "farpoint/summary_t.hpp"
#include "farpoint/timing_t.hpp"
#include "farpoint/trajectory_t.hpp"
#include "farpoint/wheels_t.hpp"

namespace farpoint::ipc {

// A layout is a sequence of items:
//   <digits>        this number of bytes of numbers
//   s               a string: int32 length with the final NUL, then its bytes
//   #               an int32 that counts a later array; they are numbered from 0 within their struct
//   [n:items]       an array of `items`, its length in count number n
template <typename Message>
inline constexpr std::string_view kLayout = {};  // empty: no type of decode()
template <>
inline constexpr std::string_view kLayout<calibration_t> = "8s#[0:ss8 32 40 56 16]1 24 32 40";
template <>
inline constexpr std::string_view kLayout<ground_truth_t> = "8 24 1 32";
template <>
inline constexpr std::string_view kLayout<image_t> = "16 12 12 4 #[0:1]";
template <>
inline constexpr std::string_view kLayout<imu_t> = "8 24 24 8";
template <>
inline constexpr std::string_view kLayout<landmarks_t> =
    "8 1 #[0: 4 1 8 4 8 24 24 8 4 8 4 4 #[0:8][0:4][0:4]]";
template <>
inline constexpr std::string_view kLayout<map_from_odom_t> = "8 4 24 32 8 1 4";
template <>
inline constexpr std::string_view kLayout<map_t> = "8 4 1#[0:4][0:4][0:4][0:4][0:1][0:1]#[1:8][1:56]";
template <>
inline constexpr std::string_view kLayout<odometry_t> = "24 24 32 24 24 288 288 288 288 8 6 12";
template <>
inline constexpr std::string_view kLayout<pose_t> = "8 8 4 24 32 288 4 4 8 16 1";
template <>
inline constexpr std::string_view kLayout<schedule_t> = "40 16 12 24";
template <>
inline constexpr std::string_view kLayout<simulation_t> = "8 4 sss 8 8 4 4 1";
template <>
inline constexpr std::string_view kLayout<status_t> = "8 2 8 3 8 ss 20 48 120 109 16 8 28 8 56 ssss 4 1 8 8";
template <>
inline constexpr std::string_view kLayout<summary_t> =
    "8 2 8 s 128 12 8 4 40 #[0: 4 8 12 24 #[0:4][0:4][0:1] 8 24 #[1:4]] ssss";
template <>
inline constexpr std::string_view kLayout<timing_t> = "16 128 128 16 1 24";
template <>
inline constexpr std::string_view kLayout<trajectory_t> = "8 8 1 8 #[0: 12 24 32 2]";
template <>
inline constexpr std::string_view kLayout<wheels_t> = "8 32 #[0:8]";

// Returns true if the bytes have exactly the layout's length, every count and string included.
[[nodiscard]] bool fits_layout(std::span<const std::uint8_t> bytes, std::string_view layout);

// Returns true if `data` (with the leading fingerprint) is one whole message of this type. On false the
// message's content is unspecified. Arrays of a reused message may be longer than their count; use the count.
template <typename Message>
[[nodiscard]] bool decode(std::span<const std::uint8_t> data, Message* message) {
  static_assert(!kLayout<Message>.empty(), "give this type a layout");
  constexpr std::size_t kFingerprintBytes = 8;
  if (data.size() < kFingerprintBytes || data.size() > INT32_MAX) return false;
  if (!fits_layout(data.subspan(kFingerprintBytes), kLayout<Message>)) return false;
  try {
    return message->decode(data.data(), 0, static_cast<int>(data.size())) == static_cast<int>(data.size());
  } catch (const std::bad_alloc&) {
    return false;
  }
}

// Encodes into `bytes` and replaces its content. Precondition: vectors have the lengths of their counts.
template <typename Message>
void encode(const Message& message, std::vector<std::uint8_t>* bytes) {
  const int size = message.getEncodedSize();
  bytes->resize(static_cast<std::size_t>(size));
  if (message.encode(bytes->data(), 0, size) != size) {
    throw std::logic_error(std::string("cannot encode ") + Message::getTypeName());
  }
}

}  // namespace farpoint::ipc
