// SPDX-License-Identifier: Apache-2.0
// The DBC file of a layout: what a receiver needs to read the odometry.
#pragma once

#include <string>

#include "ipc/can_layout.h"

namespace farpoint::ipc {

// Text of the DBC file, the same for the same layout. Contains GenMsgCycleTime, GenMsgTimeoutTime (five
// cycles), GenSigStartValue, VFrameFormat, E2E profile and Data ID, and value tables.
[[nodiscard]] std::string dbc_text(const CanLayout& layout);

}  // namespace farpoint::ipc
