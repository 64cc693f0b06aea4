// SPDX-License-Identifier: Apache-2.0
// The two kinds of failure of a command of `farpoint`. Both carry one line with what is wrong, where, and
// what was expected; the type gives the exit status.
#pragma once

#include <stdexcept>
#include <string>

#include "daemon/config/errors.h"

namespace farpoint::tools {

inline constexpr int kExitDone = 0;
inline constexpr int kExitFailed = 1;   // failed while running, or a condition of --expect is broken
inline constexpr int kExitMisused = 2;  // wrong use, configuration or input

// Wrong use or input: exit status 2.
using daemon::InputError;

// The work could not be done although the input was right (disk full, ...): exit status 1.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace farpoint::tools
