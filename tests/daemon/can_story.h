// SPDX-License-Identifier: Apache-2.0
// What a bus carried, read by the DBC alone: state, age and validity of each epoch.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "ipc/candump.h"
#include "tests/ipc/dbc.h"
#include "tests/support/paths.h"

namespace farpoint::test {

struct CanEpoch {
  double time_s = 0.0, state = 0.0, age_s = 0.0, valid = 0.0, boot = 0.0;
};

// Of a log in the format of candump.
inline std::vector<CanEpoch> read_can_story(const std::string& log) {
  const auto dbc = read_dbc(source_dir() + "/config/farpoint.dbc");
  std::vector<CanEpoch> story;
  std::ifstream in(log);
  for (std::string line; std::getline(in, line);) {
    ipc::CandumpLine parsed;
    EXPECT_TRUE(ipc::parse_candump_line(line, &parsed)) << line;
    const DbcMessage& message = dbc.at(parsed.frame.id);
    if (message.name != "FARPOINT_STATUS") continue;
    const auto value = [&](const char* name) { return message.signals.at(name).value(parsed.frame); };
    story.push_back({1e-6 * static_cast<double>(parsed.utime), value("State"), value("Age"),
                     value("PoseValid"), value("BootCounter")});
  }
  return story;
}

}  // namespace farpoint::test
