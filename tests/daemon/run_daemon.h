// SPDX-License-Identifier: Apache-2.0
// Runs of the daemon in the test's own process, and what they leave behind.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/run.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"

namespace farpoint::test {

struct Outcome {
  int status = -1;
  std::string out, err;
  [[nodiscard]] long err_lines() const { return std::count(err.begin(), err.end(), '\n'); }
  // Without warnings, which a run may print before the line of its end.
  [[nodiscard]] long error_lines() const {
    long lines = 0;
    std::istringstream in(err);
    for (std::string line; std::getline(in, line);) lines += line.starts_with("farpointd: warning: ") ? 0 : 1;
    return lines;
  }
};

// Runs the daemon in this process; warnings and errors only on standard error.
inline Outcome run_daemon(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "farpointd");
  arguments.insert(arguments.end(), {"--set", "log.level=warning"});
  std::vector<const char*> argv;
  argv.reserve(arguments.size());
  for (const std::string& a : arguments) argv.push_back(a.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Outcome outcome;
  outcome.status = daemon::run(static_cast<int>(argv.size()), argv.data());
  std::fflush(stdout);
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.err = testing::internal::GetCapturedStderr();
  return outcome;
}

inline std::string text_of(const std::string& path) {
  const auto bytes = read_bytes(path);
  return {bytes.begin(), bytes.end()};
}

}  // namespace farpoint::test
