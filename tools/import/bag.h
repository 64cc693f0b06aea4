// SPDX-License-Identifier: Apache-2.0
// ROS 1 bags and MCAP recordings of ROS 1 or 2: one camera's images, and where there are any an IMU and wheel
// speeds. Pixels stay in the bag until they are copied into the log.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/import/recording.h"

namespace farpoint::tools {

struct BagTopic {
  std::string name, type;  // the type without "/msg": "sensor_msgs/Image"
  std::uint64_t messages = 0;
};

// Which topics to take. An empty name takes the only topic of its type; "none" takes none.
struct BagChoice {
  std::string image, imu;
  std::string wheels;                 // nav_msgs/Odometry or geometry_msgs/TwistStamped; empty: none
  std::filesystem::path camera_file;  // empty: the camera_info beside the images
};

// Topics in the order of their names.
[[nodiscard]] std::vector<BagTopic> list_bag(const std::filesystem::path& file);

// Messages that cannot be decoded are counted in the notices. A message's time is its header's, or that of
// its reception where the header has none. Throws InputError naming the file, and the byte where it is
// damaged.
[[nodiscard]] Recording read_bag(const std::filesystem::path& file, const BagChoice& choice);

}  // namespace farpoint::tools
