// SPDX-License-Identifier: Apache-2.0
// Which frames of a final trajectory belong to a map that was sound then.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "slam/inspection.h"

namespace farpoint::daemon {

// Time from a frame to the nearest valid pose of its map, up to which adjustment holds both to each other:
// the local window of a vehicle that drives. The young map's frames become valid within it.
inline constexpr double kSoundReach_s = 5.0;
// Frames that wait for a map are posed against it once it is sound, however slow the camera: N at most.
inline constexpr std::size_t kWaitingFrames = 60;

// One entry a frame of the trajectory, 1 where its pose is sound: a pose of the map was published as valid at
// one of `live_utimes` (ascending), no further away than these.
[[nodiscard]] std::vector<std::uint8_t> sound_frames(const slam::MapTrajectory& trajectory,
                                                     std::span<const std::int64_t> live_utimes);

}  // namespace farpoint::daemon
