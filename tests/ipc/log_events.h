// What is in a log, for comparing two.
#pragma once

#include <string>
#include <vector>

#include "ipc/channels.h"
#include "ipc/log.h"

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

}  // namespace farpoint::test
