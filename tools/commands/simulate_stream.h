// SPDX-License-Identifier: Apache-2.0
// `farpoint simulate --stream`: opens the devices of its options, streams, and prints a closing line with
// lateness and pace.
#pragma once

#include <optional>
#include <string>

#include "tools/simulate/simulation.h"

namespace farpoint::tools {

struct StreamRequest {
  std::string video, second_video;        // devices; empty: none
  std::optional<std::string> lcm_url;     // empty: the default one
  std::string can_interface;              // empty: none
  std::string wheels_dbc, wheel_signals;  // as can.wheels_dbc and can.wheel_signals of the daemon
  double pace = 1.0;
  std::string output;  // log of the streamed data; empty: none
};

// Throws InputError for options that contradict each other.
void check(const StreamRequest& request, bool stereo);

// Streams to the end or a signal, and prints the closing line. Throws the devices' errors.
void run_stream(const StreamRequest& request, simulate::Simulation* simulation);

}  // namespace farpoint::tools
