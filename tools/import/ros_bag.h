// SPDX-License-Identifier: Apache-2.0
// The container of ROS 1, bag format 2.0: connections and messages in the order of the file. Messages stay in
// the file. The bag's own index is not used, so a bag without one is read too.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tools/import/byte_file.h"
#include "tools/import/ros_message.h"

namespace farpoint::tools {

struct BagConnection {
  std::uint32_t id = 0;
  std::string topic, type;  // "/camera/image_raw", "sensor_msgs/Image"
  RosPacking packing = RosPacking::kRos1;
};

struct BagMessage {
  std::uint32_t connection = 0;
  std::int64_t received_ns = 0;
  std::uint64_t offset = 0, bytes = 0;  // of its content in the file
};

// Calls back for each connection once and for each message. Throws InputError naming the byte: damage, a cut
// off end, lengths beyond their limits, compressed chunks.
void read_ros_bag(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
                  const std::function<void(const BagMessage&)>& on_message);

}  // namespace farpoint::tools
