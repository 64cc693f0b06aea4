// SPDX-License-Identifier: Apache-2.0
// The log of a run that ends early.
#pragma once

#include <string>

#include "ipc/log.h"

namespace farpoint::tools::simulate {

// Keeps the log as <file>.incomplete, and returns a text for an error's message; empty if nothing is kept.
[[nodiscard]] inline std::string keep_incomplete(ipc::LogWriter* log) {
  const std::string kept = log->keep_incomplete();
  return kept.empty() ? "" : "; the log so far is kept as " + kept;
}

}  // namespace farpoint::tools::simulate
