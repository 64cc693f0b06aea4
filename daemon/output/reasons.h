// SPDX-License-Identifier: Apache-2.0
// The estimator's reasons as they are published.
#pragma once

#include "ipc/reason.h"
#include "slam/frame_result.h"

namespace farpoint::daemon {

[[nodiscard]] ipc::Reason published(slam::Reason reason);

// Why the frame has no valid pose; by its state where the estimator gives no reason.
[[nodiscard]] ipc::Reason reason_of(const slam::FrameResult& result);

}  // namespace farpoint::daemon
