// SPDX-License-Identifier: Apache-2.0
// Finds the wheel speed signals of a vehicle's DBC file.
#pragma once

#include <string>
#include <vector>

#include "ipc/dbc.h"

namespace farpoint::drivers {

struct WheelSignal {
  ipc::DbcSignal dbc;
  double to_m_s = 1.0;  // its unit
};

// `names`: "MESSAGE.SIGNAL, ..." one to four, in the order front left, front right, rear left, rear right.
// Their unit must be m/s or km/h. Throws std::runtime_error with what was expected.
[[nodiscard]] std::vector<WheelSignal> read_wheel_signals(const std::string& dbc_path,
                                                          const std::string& names);

}  // namespace farpoint::drivers
