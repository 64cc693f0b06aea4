// SPDX-License-Identifier: Apache-2.0
// What is in a log.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "ipc/message.h"

namespace farpoint::test {

// Every event of a log, its channel first, but those that hold measured times.
inline std::vector<std::string> events_of(const std::string& path) {
  std::vector<std::string> events;
  ipc::LogReader reader(path);
  ipc::LogEvent event;
  while (reader.next(&event)) {
    if (event.channel == ipc::kTimingChannel) continue;
    events.push_back(std::string(event.channel) + ' ' + std::to_string(event.timestamp_us) + ' ' +
                     std::string(event.data.begin(), event.data.end()));
  }
  return events;
}

// The messages of one channel, in order.
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
