// SPDX-License-Identifier: Apache-2.0
// Replay of a recorded log: in lockstep, with threads at a pace, or as a threaded run was recorded.
#pragma once

#include "daemon/config/config.h"
#include "daemon/config/options.h"
#include "daemon/pipeline/pipeline.h"

namespace farpoint::daemon {

// Replays options.replay, writes and sends what the options ask for, and prints the last line. Returns the
// exit status: 0 done, 2 where the log is cut off (what could be read was replayed and written). Throws
// UsageError, ConfigError or InputError before the first frame, std::runtime_error while running; outputs are
// then left as they were. The hooks are for tests of threaded replay.
int replay(const Options& options, const Config& config, const ThreadHooks& hooks = {});

}  // namespace farpoint::daemon
