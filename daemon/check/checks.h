// SPDX-License-Identifier: Apache-2.0
// The checks of --check, a function a topic. Each adds its lines and never throws for what a user may have
// wrong. None opens anything for writing, sends anything or starts a thread; the libcamera check only loads
// its module.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/check/findings.h"
#include "daemon/config/config.h"
#include "daemon/config/options.h"
#include "daemon/system/core_plan.h"
#include "drivers/can/link_info.h"
#include "ipc/message.h"

namespace farpoint::daemon {

// Calibration of the live cameras. Returns it where it can be used.
std::optional<calibration_t> check_calibration(const Config& config, Findings* findings);

// Size, model, focal length of each camera, and the hash.
[[nodiscard]] std::string described(const calibration_t& calibration);

// Each live camera, by its driver. `root`: see CameraPath.
void check_cameras(const Config& config, const calibration_t& calibration, const std::string& root,
                   Findings* findings);

// The masks of the cameras: read, held against the images' size, with the share that each covers.
void check_masks(const Config& config, const calibration_t& calibration, Findings* findings);

// The log of a replay: its calibration, images and measurements, read to the end without decoding more than
// the first image. Returns the calibration where it can be used.
std::optional<calibration_t> check_log(const std::string& path, const Config& config, Findings* findings);

// URL and route.
void check_network(const Options& options, const Config& config, Findings* findings);

// The CAN interface, and the wheel speeds from it. What the kernel says of the interface is read by
// read_link().
void check_bus(const Options& options, const Config& config, Findings* findings);
// A part of it. `link`: none where there is no such interface.
void judge_link(const std::string& interface, const std::optional<drivers::LinkInfo>& link,
                const ipc::CanLayout& layout, Findings* findings);

// What this account may do.
struct Privileges {
  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};
  int most_priority = 0;                // real-time
  std::uint64_t most_locked_bytes = 0;  // kUnlimited
  bool may_hold_latency = false;        // /dev/cpu_dma_latency
};
[[nodiscard]] Privileges read_privileges();
// Priorities, cores, locked memory, processor latency, governors (below `root`).
void check_privileges(const RealtimeConfig& config, const Privileges& privileges,
                      const std::vector<Core>& cores, const std::string& root, Findings* findings);

struct Clocks {
  bool is_synchronised = false;    // the system clock
  std::int64_t resolution_ns = 1;  // CLOCK_MONOTONIC
  std::string source;              // the kernel's; empty: unknown
};
[[nodiscard]] Clocks read_clocks();
void check_clocks(const Clocks& clocks, Findings* findings);

// Folders of recording, state, log and commands: there, writable, and with room. `calibration` gives the
// size of a recording; none: unknown.
void check_folders(const Options& options, const Config& config,
                   const std::optional<calibration_t>& calibration, Findings* findings);
// The files of --output, --trajectory, --live-trajectory and --can-log.
void check_outputs(const Options& options, Findings* findings);

}  // namespace farpoint::daemon
