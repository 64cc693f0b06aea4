// SPDX-License-Identifier: Apache-2.0
// Counts the starts of the daemon, so that a receiver can tell a restart from none.
#pragma once

#include <cstdint>
#include <string>

namespace farpoint::daemon {

// The folder that key state.folder names: "auto" is the service's ($STATE_DIRECTORY), "none" is none. Empty:
// none.
[[nodiscard]] std::string state_folder(const std::string& key);

struct BootCounter {
  std::int32_t value = 0;  // 1 and up
  std::string problem;     // why it is a random number; empty where it was counted
};
// Returns the number after the one kept in `folder`, and keeps it there. A damaged file gets a random number,
// from which later starts count. Random at each start where no folder can be written; then two starts may
// have the same number, one time in 255 on CAN.
[[nodiscard]] BootCounter next_boot_counter(const std::string& folder);

// As the bus carries it: 1 to 255, then 1 again.
[[nodiscard]] std::uint8_t boot_counter_on_can(std::int32_t value);

}  // namespace farpoint::daemon
