// Lockstep replay of a recorded log: one thread, one order, no clock but the log's.
#pragma once

#include "daemon/config.h"
#include "daemon/options.h"

namespace farpoint::daemon {

// Replays options.replay, writes and sends what the options ask for, and prints the last line. Returns the
// exit status: 0 done, 2 where the log is cut off (what could be read was replayed and written). Throws
// UsageError, ConfigError or InputError before the first frame, std::runtime_error while running; outputs are
// then left as they were.
int replay_lockstep(const Options& options, const Config& config);

}  // namespace farpoint::daemon
