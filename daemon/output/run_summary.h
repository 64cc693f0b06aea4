// SPDX-License-Identifier: Apache-2.0
// The line that ends a run.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "daemon/config/options.h"
#include "daemon/input/counts.h"
#include "daemon/output/messages.h"
#include "daemon/system/logging.h"

namespace farpoint::daemon {

// cpu_ms: of each frame, on the thread that tracks.
[[nodiscard]] std::string last_line(const RunEnd& end, const InputCounts& in, std::int64_t frames_dropped,
                                    std::vector<double> cpu_ms, const std::vector<std::string>& written);

// Standard output, or standard error where an output goes to standard output.
[[nodiscard]] std::FILE* line_stream(const Options& options);

// Draws the bar: `fraction` as Progress::show(), `frames` tracked so far.
void show_progress(double fraction, const slam::FrameResult& last, std::int64_t frames, Progress* progress);

}  // namespace farpoint::daemon
