// SPDX-License-Identifier: Apache-2.0
// The whole program, without main().
#pragma once

namespace farpoint::daemon {

// Reads the command line and the configuration, and does what they ask. Returns the exit status: 0 done, 1
// failed while running, 2 wrong use, configuration or input; other than 0 with one line on standard error.
int run(int argc, const char* const* argv);

}  // namespace farpoint::daemon
