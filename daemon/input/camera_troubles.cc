// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/camera_troubles.h"

namespace farpoint::daemon {
namespace {

void append(std::int64_t number, const char* what, std::string* line) {
  if (number <= 0) return;
  *line += (line->empty() ? "" : "; ") + std::to_string(number) + " images " + what;
}

}  // namespace

std::string CameraTroubles::take_line(double now_s) {
  const Numbers now{times_unknown_.load(std::memory_order_relaxed),
                    times_backwards_.load(std::memory_order_relaxed),
                    undecodable_.load(std::memory_order_relaxed), flagged_.load(std::memory_order_relaxed)};
  if (now == said_ || now_s < next_line_s_) return {};
  std::string line;
  append(now.times_unknown - said_.times_unknown,
         "with a time stamp of no clock (zero, far off or random), time of arrival in its place", &line);
  append(now.times_backwards - said_.times_backwards,
         "dropped, since their time was not after the one before (stamps that jitter or repeat)", &line);
  append(now.undecodable - said_.undecodable, "dropped, since they were too short or undecodable", &line);
  append(now.flagged - said_.flagged, "dropped, since the driver marked them as damaged", &line);
  said_ = now;
  next_line_s_ = now_s + kQuiet_s;
  return line;
}

}  // namespace farpoint::daemon
