// SPDX-License-Identifier: Apache-2.0
// The container MCAP, as ROS 2 records it: channels and messages in the order of the file. Messages stay in
// the file; the index is not used.
#pragma once

#include <functional>

#include "tools/import/byte_file.h"
#include "tools/import/ros_bag.h"

namespace farpoint::tools {

// As read_ros_bag(): a channel is a connection. Types of other encodings than ROS's have the encoding before
// their name. Throws InputError naming the byte.
void read_mcap(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
               const std::function<void(const BagMessage&)>& on_message);

// Reads either container, chosen by the first bytes. Throws InputError for other files.
void read_bag_file(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
                   const std::function<void(const BagMessage&)>& on_message);

}  // namespace farpoint::tools
