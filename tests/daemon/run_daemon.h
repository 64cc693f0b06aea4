// Runs of the daemon in the test's own process, and what they leave behind.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "daemon/run.h"
#include "ipc/log.h"
#include "ipc/message.h"
#include "tests/ipc/scratch.h"

namespace farpoint::test {

struct Outcome {
  int status = -1;
  std::string out, err;
  [[nodiscard]] long err_lines() const { return std::count(err.begin(), err.end(), '\n'); }
};

// Runs the daemon in this process; warnings and errors only on standard error.
inline Outcome run_daemon(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "farpointd");
  arguments.insert(arguments.end(), {"--set", "log.level=warning"});
  std::vector<const char*> argv;
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

template <typename Message>
std::vector<Message> messages_of(const std::string& log, const std::string& channel) {
  std::vector<Message> all;
  ipc::LogReader reader(log);
  ipc::LogEvent event;
  while (reader.next(&event)) {
    if (event.channel != channel) continue;
    all.emplace_back();
    EXPECT_TRUE(ipc::decode(event.data, &all.back())) << channel;
  }
  return all;
}

}  // namespace farpoint::test
