// SPDX-License-Identifier: Apache-2.0
// Which core each thread gets on a vehicle's computer.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/config.h"

namespace farpoint::daemon {

// One core that this process may use. capacity: the kernel's relative speed, 1024 for the fastest.
struct Core {
  int number = 0;
  int capacity = 1024;
};

// The cores of this process's affinity, ascending. `root` is put before /sys, for tests. Cores without a
// known capacity count as the fastest.
[[nodiscard]] std::vector<Core> usable_cores(const std::string& root = "");

// Fills in what the configuration leaves to the profile: priorities and cores of -1. Profile 'desk': ordinary
// scheduling on any core. Profile 'vehicle': capture 50, output 45, tracking 40 (ordinary on a single core,
// or mapping would starve), mapping ordinary; with four usable cores or more each thread gets a core, never
// core 0, the fastest to tracking, then mapping, output, capture. With four usable cores capture and output
// share one.
[[nodiscard]] RealtimeConfig resolved(const RealtimeConfig& config, const std::vector<Core>& cores);

}  // namespace farpoint::daemon
