// SPDX-License-Identifier: Apache-2.0
// ROS messages of a few types, from their bytes. Lengths are checked before anything is read or allocated; a
// damaged message gives nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "slam/config.h"
#include "tools/import/rectified_pair.h"

namespace farpoint::tools {

// How fields are packed: without gaps and with `seq` in headers (ROS 1), or aligned as CDR (ROS 2).
enum class RosPacking : std::uint8_t { kRos1, kCdr };

// Reads fields one after another. After the first field that is not there, ok() is false and all are zero.
class RosFields {
 public:
  RosFields(std::span<const std::uint8_t> message, RosPacking packing);

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t position() const { return at_; }
  std::uint8_t u8();
  std::uint32_t u32();
  double f64();
  std::string_view text();
  // Length of a list of elements of `element_bytes`, which must be in the message; `most` elements at most.
  std::size_t list(std::size_t element_bytes, std::size_t most);
  // Length of a list of bytes that may lie beyond what was loaded of the message: `message_bytes` is its
  // size.
  std::size_t long_list(std::uint64_t message_bytes);
  // std_msgs/Header; returns its time, 0 where it has none.
  std::int64_t header_utime();

 private:
  bool take(std::size_t bytes, std::size_t alignment);
  template <typename Number>
  Number number();

  std::span<const std::uint8_t> message_;
  RosPacking packing_;
  std::size_t begin_ = 0;  // alignment counts from here
  std::size_t at_ = 0;
  bool ok_ = true;
};

// sensor_msgs/Image and sensor_msgs/CompressedImage without their pixels.
struct RosImage {
  std::int64_t utime = 0;
  std::string encoding;  // "mono8", ...; of a compressed image its format
  int width_px = 0, height_px = 0;
  std::size_t row_bytes = 0;
  std::uint64_t data_offset = 0, data_bytes = 0;  // within the message
};
struct RosImu {
  std::int64_t utime = 0;
  Eigen::Vector3d angular_velocity_radps, acceleration_mps2;
};
// Forward speed and yaw rate of nav_msgs/Odometry, geometry_msgs/TwistStamped or TwistWithCovarianceStamped.
struct RosTwist {
  std::int64_t utime = 0;
  double speed_mps = 0.0, yaw_rate_radps = 0.0;
};
// Pose of nav_msgs/Odometry and of geometry_msgs' types with a time; a point has no orientation.
struct RosPose {
  std::int64_t utime = 0;
  slam::SE3 T_world_body;
};
enum class RosPoseLayout : std::uint8_t {
  kPose,     // PoseStamped, PoseWithCovarianceStamped
  kOfChild,  // Odometry, TransformStamped: the child's frame stands before the pose
  kPoint,    // PointStamped
};
// sensor_msgs/CameraInfo.
struct RosCameraInfo {
  std::string calibration;  // of the raw image, as a file's text, which daemon::parse_camera_file takes
  Rectification rectification;
};

// `head` is the beginning of a message of `message_bytes`: kImageHeadBytes of it, or all.
inline constexpr std::size_t kImageHeadBytes = 4096;
[[nodiscard]] std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head,
                                                     std::uint64_t message_bytes, RosPacking packing);
[[nodiscard]] std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                                std::uint64_t message_bytes,
                                                                RosPacking packing);
[[nodiscard]] std::optional<RosImu> read_ros_imu(std::span<const std::uint8_t> message, RosPacking packing);
[[nodiscard]] std::optional<RosTwist> read_ros_odometry(std::span<const std::uint8_t> message,
                                                        RosPacking packing);
[[nodiscard]] std::optional<RosTwist> read_ros_twist(std::span<const std::uint8_t> message,
                                                     RosPacking packing);
// Empty also for a quaternion of another length than 1.
[[nodiscard]] std::optional<RosPose> read_ros_pose(std::span<const std::uint8_t> message, RosPacking packing,
                                                   RosPoseLayout layout);
[[nodiscard]] std::optional<RosCameraInfo> read_ros_camera_info(std::span<const std::uint8_t> message,
                                                                RosPacking packing);

}  // namespace farpoint::tools
