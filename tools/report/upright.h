// SPDX-License-Identifier: Apache-2.0
// The truth's axes as the page draws them: z up.
#pragma once

#include <string>

#include "tools/evaluate/run_metrics.h"

namespace farpoint::tools::report {

// Turns a recording's truth whose own axes have no z up, like KITTI odometry's (x right, y down, z forward),
// so that x points ahead at the start, y to the left, z up. Exchanges and negates axes, nothing else. Returns
// a sentence of that for the page; without a change an empty one.
//
// Up is the axis that the first camera's images have on top, on average, where the path extends less along it
// than along z: a camera that looks down has another direction on top. A simulated world, a text file and a
// truth without orientation stay as they are.
std::string turn_upright(Truth* truth);

}  // namespace farpoint::tools::report
