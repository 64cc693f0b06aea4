// SPDX-License-Identifier: Apache-2.0
// Recordings of ROS: bags of ROS 1, MCAP, and ROS 2's SQLite bags (a file, or the folder with its
// metadata.yaml). One camera's images or two cameras', and where there are any an IMU, wheel speeds and
// truth. Pixels stay in the bag until they are copied into the log.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/import/bag_topics.h"
#include "tools/import/recording.h"

namespace farpoint::tools {

// Which topics to take.
struct BagChoice {
  std::string image;         // empty: the only one
  std::string second_image;  // becomes CAMERA_1; empty: none
  std::string imu;           // empty: the only one; "none"
  std::string wheels;        // nav_msgs/Odometry or a twist with a time; empty: none
  std::string truth;         // nav_msgs/Odometry or a pose, transform or point with a time; empty: none
  std::filesystem::path camera_file;         // empty: the camera_info beside the images
  std::filesystem::path second_camera_file;  // with camera_file, both with T_body_camera
};

// Topics in the order of their names.
[[nodiscard]] std::vector<BagTopic> list_bag(const std::filesystem::path& path);

// Messages that cannot be decoded are counted in the notices. A message's time is its header's, or that of
// its reception where the header has none. Images of two cameras up to 5 ms apart are a pair; their cameras'
// relative pose is that of the files, or of the rectification in camera_info. Throws InputError naming the
// file, and the place where it is damaged.
[[nodiscard]] Recording read_bag(const std::filesystem::path& path, const BagChoice& choice);

}  // namespace farpoint::tools
